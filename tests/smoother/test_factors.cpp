#include "tests/smoother/support.h"

#include <vector>

#include "smoother/feature_factor.h"
#include "smoother/standstill_factor.h"
#include "smoother/wheel_factor.h"
#include "tests/support/random_drive.h"

using namespace ear;
using namespace ear::smoother;
using namespace ear::smoother::test;
using ear::test::random_pose;
using ear::test::random_vector;

namespace {

Eigen::VectorXd zeros(int size) { return Eigen::VectorXd::Zero(size); }

/// A point seen by both cameras of a body, and where.
struct Scene {
  Pose T_WB;
  CameraState cameras;
  InverseDepthPoint anchor;
  Observation left, right;

  explicit Scene(std::mt19937_64& rng) {
    T_WB = random_pose(rng, 0.5, 5.0);
    cameras = ear::test::random_cameras(rng);
    const Eigen::Matrix3d R_WC = T_WB.R * cameras.T_BC0.R;
    const Eigen::Vector3d p_WC = T_WB.p + T_WB.R * cameras.T_BC0.p;
    anchor.R_WA = R_WC * exp_so3(random_vector(rng, 0.1));
    anchor.p_WA = p_WC + random_vector(rng, 0.3);
    anchor.bearing_A = {0.1, -0.2, 1.0};
    anchor.inverse_depth = 0.2;
    const Eigen::Vector3d p_W = anchor.scaled_W() / anchor.inverse_depth;
    const Eigen::Vector3d p_C0 = R_WC.transpose() * (p_W - p_WC);
    const Eigen::Vector3d p_C1 = cameras.T_C0C1.R.transpose() * (p_C0 - cameras.T_C0C1.p);
    left.uv = cameras.lens_error[0].measured(p_C0.hnormalized());
    right.uv = cameras.lens_error[1].measured(p_C1.hnormalized());
    for (Observation* seen : {&left, &right}) {
      seen->sigma = 2e-3;
      seen->rate_B = random_vector(rng, 0.5);
      seen->v_B = random_vector(rng, 1.0);
      seen->time_offset = cameras.time_offset;
    }
  }

  [[nodiscard]] std::vector<Eigen::VectorXd> values(bool with_right, double time_offset) const {
    const PointBlock point = to_block(anchor);
    CameraState imaging = cameras;
    imaging.time_offset = time_offset;
    const ImagingBlock values = imaging_block(imaging);
    std::vector<Eigen::VectorXd> result = {block(T_WB), block(cameras.T_BC0)};
    if (with_right) result.push_back(block(cameras.T_C0C1));
    result.emplace_back(Eigen::Map<const Eigen::VectorXd>(values.data(), 7));
    result.emplace_back(Eigen::Map<const Eigen::VectorXd>(point.data(), 3));
    return result;
  }
};

}  // namespace

TEST_CASE("factors: a feature where it is seen leaves nothing; seen later, it moved against the body's motion") {
  std::mt19937_64 rng{11};
  const Scene scene(rng);
  CHECK(residual(LeftFactor(scene.left, scene.anchor), scene.values(false, scene.cameras.time_offset)).norm() < 1e-9);
  CHECK(residual(RightFactor(scene.right, scene.anchor), scene.values(true, scene.cameras.time_offset)).norm() < 1e-9);

  // By hand: a camera that looks along the body's x, a point 2 m ahead, the body moves to its left at 1 m/s. Taken 10
  // ms later than thought, the point should be seen 10 mm to the right: 5e-3, measured less predicted is minus that.
  Observation seen;
  seen.v_B = {0.0, 1.0, 0.0};
  InverseDepthPoint ahead;
  ahead.R_WA << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  ahead.inverse_depth = 0.5;
  const Eigen::VectorXd camera = block({ahead.R_WA, Eigen::Vector3d::Zero()});
  const Eigen::VectorXd r = residual(
      LeftFactor(seen, ahead), {block(Pose{}), camera, 0.01 * Eigen::VectorXd::Unit(7, imaging_entry::time_offset),
                                Eigen::Vector3d(0.0, 0.0, ahead.inverse_depth)});
  CHECK(r(0) == doctest::Approx(-5e-3));
  CHECK(std::abs(r(1)) < 1e-12);
}

TEST_CASE("factors: derivatives of a feature's observations, by pose, cameras, time offset and point") {
  std::mt19937_64 rng{12};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const Scene scene(rng);
    check_factor(LeftFactor(scene.left, scene.anchor), scene.values(false, 3e-3));
    check_factor(RightFactor(scene.right, scene.anchor), scene.values(true, 3e-3));
  }
}

TEST_CASE(
    "factors: wheels: forward 0.1 m, measured 0.1 m: nothing left; a body that went further leaves less than none") {
  WheelDisplacement z;
  z.alpha_Bi = {0.1, 0.0, 0.0};
  const OdometerState odometer;
  z.wheels = wheel_model(odometer);
  const WheelFactor factor(z, odometer, 1e-6 * Eigen::Matrix3d::Identity());
  const auto at = [&](double x) {
    return residual(factor, {block(Pose{}), zeros(9), block({Eigen::Matrix3d::Identity(), {x, 0.0, 0.0}}), zeros(6)});
  };
  CHECK(at(0.1).norm() < 1e-9);
  CHECK((at(0.11) - Eigen::Vector3d(-10.0, 0.0, 0.0)).norm() < 1e-9);  // in standard deviations of 1 mm
}

TEST_CASE("factors: wheels: derivatives by poses, bias and wheels") {
  std::mt19937_64 rng{13};
  for (int trial = 0; trial < 10; ++trial) {
    CAPTURE(trial);
    const State x = ear::test::random_state(rng, 0);
    const std::vector<ear::test::WheelInterval> drive = ear::test::random_drive(rng, 10);
    WheelNoise noise;
    noise.slip = 1e-3;
    noise.side_slip = 2e-3;
    noise.roughness = 4e-3;
    const WheelDisplacement z =
        ear::test::preintegrate(drive, wheel_model(x.odometer), noise, Eigen::Vector3d::UnitZ(), x.imu.b_g);
    const WheelFactor factor(z, x.odometer, z.covariance.topLeftCorner<3, 3>());
    Eigen::VectorXd motion = random_values(rng, 9, 0.01);
    check_factor(factor, {block(random_pose(rng, 0.5, 3.0)), motion, block(random_pose(rng, 0.5, 3.0)),
                          random_values(rng, 6, 0.01)});
  }
}

TEST_CASE("factors: wheels: (12) at the values that the displacement was computed with") {
  std::mt19937_64 rng{14};
  State x = ear::test::random_state(rng, 1);
  const std::vector<ear::test::WheelInterval> drive = ear::test::random_drive(rng, 10);
  const Eigen::Vector3d n_Bi = x.clones[0].T_WB.R.transpose() * x.ground.n_W;
  const WheelDisplacement z = ear::test::preintegrate(drive, wheel_model(x.odometer), WheelNoise{}, n_Bi, x.imu.b_g);
  Eigen::VectorXd motion = zeros(9);
  motion.segment<3>(motion_entry::b_g) = x.imu.b_g;
  const WheelFactor factor(z, x.odometer, Eigen::Matrix3d::Identity());
  const Eigen::VectorXd r =
      residual(factor, {block(x.clones[0].T_WB), motion, block({x.imu.R_WB, x.imu.p_WB}), zeros(6)});
  const Pose& T_i = x.clones[0].T_WB;
  const Eigen::Vector3d& p_BO = x.odometer.T_BO.p;
  const Eigen::Vector3d p_WOi = T_i.R * p_BO + T_i.p;
  const Eigen::Vector3d p_WOj = x.imu.R_WB * p_BO + x.imu.p_WB;
  CHECK((r - (z.alpha_Bi - T_i.R.transpose() * (p_WOj - p_WOi))).norm() < 1e-9);
}

TEST_CASE("factors: standing: derivatives, and nothing left where it stands") {
  std::mt19937_64 rng{15};
  const StandstillFactor factor{StandstillConfig{}};
  const Pose pose = random_pose(rng, 1.0, 3.0);
  CHECK(residual(factor, {block(pose), block(pose), zeros(9)}).norm() < 1e-9);
  for (int trial = 0; trial < 5; ++trial) {
    check_factor(factor,
                 {block(random_pose(rng, 0.5, 3.0)), block(random_pose(rng, 0.5, 3.0)), random_values(rng, 9, 1.0)});
  }
}
