#include "calibration/inertial_factor.h"
#include "calibration/inertial_path.h"
#include "calibration/models.h"
#include "calibration/pixel_factor.h"
#include "smoother/feature_factor.h"
#include "tests/smoother/support.h"
#include "tests/support/random_drive.h"

using namespace ear;
using namespace ear::calibration;
using ear::smoother::test::block;
using ear::test::random_pose;
using ear::test::random_vector;

namespace {

Eigen::VectorXd small(std::mt19937_64& rng, int size, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  Eigen::VectorXd values(size);
  for (double& value : values) value = normal(rng);
  return values;
}

GivenCameras some_cameras(std::mt19937_64& rng, LensModel lens) {
  GivenCameras given;
  given.poses = ear::test::random_cameras(rng);
  for (CameraCalibration& camera : given.lens) {
    camera.fu = 385.0;
    camera.fv = 384.0;
    camera.cu = 320.0;
    camera.cv = 240.0;
    camera.lens = lens;
    camera.distortion = {-0.05, 0.04, 6e-4, -4e-4};
  }
  return given;
}

InverseDepthPoint point_ahead(const Pose& T_WB, const GivenCameras& given, std::mt19937_64& rng) {
  InverseDepthPoint anchor;
  anchor.R_WA = T_WB.R * given.poses.T_BC0.R * exp_so3(random_vector(rng, 0.1));
  anchor.p_WA = T_WB.p + T_WB.R * given.poses.T_BC0.p + random_vector(rng, 0.2);
  anchor.bearing_A = {0.1, -0.2, 1.0};
  anchor.inverse_depth = 0.25;
  return anchor;
}

OdometerState some_odometer() {
  OdometerState odometer;
  odometer.wheel_radius << 0.075, 0.076;
  odometer.track_width = 0.4;
  odometer.T_BO.R = exp_so3({0.02, -0.03, 0.05});
  odometer.T_BO.p = {-0.02, 0.01, -0.05};
  return odometer;
}

}  // namespace

TEST_CASE("calibration: derivatives of an observation in pixels, both cameras and lenses") {
  std::mt19937_64 rng{3};
  for (const LensModel lens : {LensModel::radial_tangential, LensModel::equidistant}) {
    for (int trial = 0; trial < 5; ++trial) {
      const GivenCameras given = some_cameras(rng, lens);
      const Pose T_WB = random_pose(rng, 0.5, 5.0);
      const InverseDepthPoint anchor = point_ahead(T_WB, given, rng);
      const smoother::PointBlock point = smoother::to_block(anchor);
      const PixelObservation seen{{300.0, 250.0}, 0.5, 0.004, random_vector(rng, 0.5), random_vector(rng, 1.0)};
      const Eigen::VectorXd camera = small(rng, 6, 0.02), stereo = small(rng, 6, 0.01), bent = small(rng, 5, 0.01);
      const Eigen::VectorXd time = small(rng, 1, 0.005);
      const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(point.data(), 3);
      smoother::test::check_factor(LeftPixel(seen, given, anchor), {block(T_WB), camera, bent, time, p});
      smoother::test::check_factor(RightPixel(seen, given, anchor), {block(T_WB), camera, stereo, bent, time, p});
    }
  }
}

TEST_CASE("calibration: derivatives of rolling, and of wheels that stand on a plane") {
  std::mt19937_64 rng{5};
  for (int trial = 0; trial < 10; ++trial) {
    RollModel roll;
    roll.given = some_odometer();
    roll.angle = small(rng, 2, 2.0);
    roll.speed_gained = small(rng, 2, 3.0);
    roll.turned = random_vector(rng, 0.2);
    roll.duration = 0.2;
    roll.along = {random_vector(rng, 1.0).normalized(), random_vector(rng, 1.0).normalized()};
    roll.R_im = exp_so3(random_vector(rng, 0.1));
    roll.bend = random_vector(rng, 1e-3);
    const Pose T_i = random_pose(rng, 0.5, 5.0), T_j = random_pose(rng, 0.5, 5.0);
    const Eigen::VectorXd wheels = small(rng, 3, 0.02), axle = small(rng, 5, 0.02);
    smoother::test::check_factor(RollFactor(roll),
                                 {block(T_i), block(T_j), small(rng, 9, 0.1), wheels, axle, small(rng, 1, 0.002)});
    const StandFactor stand(StandModel{some_odometer(), {0.3, -0.2}, 0.002});
    smoother::test::check_factor(stand, {block(T_i), small(rng, 3, 0.2), wheels, axle});
  }
}

TEST_CASE("calibration: derivatives of a beam, the ground's change, the origin and a reference") {
  std::mt19937_64 rng{7};
  for (int trial = 0; trial < 10; ++trial) {
    const Pose T_WB{exp_so3(random_vector(rng, 0.1)), random_vector(rng, 1.0)};
    BeamModel beam;
    beam.p_BL = random_vector(rng, 0.1);
    beam.d_B = Eigen::Vector3d(0.02, -0.01, -1.0).normalized();
    beam.tilt = tangent_basis(-beam.d_B);
    beam.centre = {0.1, 0.2};
    beam.R_kt = exp_so3(random_vector(rng, 0.05));
    beam.onwards = {0.1, random_vector(rng, 0.1), -0.005 * random_pose(rng, 0.5, 1.0).R, random_vector(rng, 0.1)};
    beam.v_kt = random_vector(rng, 0.5);
    beam.rate_B = random_vector(rng, 0.5);
    beam.range = 0.4;
    beam.sigma = 0.004;
    smoother::test::check_factor(BeamFactor(beam), {block(T_WB), small(rng, 9, 0.3), small(rng, 3, 0.1),
                                                    small(rng, 5, 0.02), small(rng, 1, 0.002)});
    smoother::test::check_factor(GroundFactor(GroundModel{{0.1, 0.2}, {0.4, -0.1}, 0.001, 0.01}),
                                 {small(rng, 3, 0.1), small(rng, 3, 0.1)});
    smoother::test::check_factor(OriginFactor(OriginModel{T_WB}), {block(T_WB)});
    smoother::test::check_factor(BiasFactor(BiasModel{}), {small(rng, 9, 0.1)});
    smoother::test::check_factor(ReferenceFactor(ReferenceModel{random_vector(rng, 1.0), beam.onwards, 0.5}),
                                 {block(T_WB), small(rng, 9, 0.3), small(rng, 4, 0.3)});
  }
}

TEST_CASE("calibration: derivatives of the inertial samples, by the gyroscope's errors too") {
  namespace imu_error = smoother::imu_error;
  std::mt19937_64 rng{13};
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<InertialPiece> pieces;
    for (int k = 0; k < 40; ++k) {
      pieces.push_back({0, 0.005, random_vector(rng, 1.0), random_vector(rng, 5.0) + Eigen::Vector3d(0, 0, 9.81), 0.0});
    }
    NavState from;
    from.b_g = random_vector(rng, 0.05);
    from.b_a = random_vector(rng, 0.3);
    const auto with = [&](const Eigen::VectorXd& errors) {
      GyroErrors values{};
      std::copy(errors.begin(), errors.end(), values.begin());
      return preintegrated(pieces, from, values, ImuCalibration{});
    };
    const Eigen::VectorXd errors = small(rng, 9, 0.01);
    const Preintegrated measured = with(errors);
    // Of what was turned and gained, against taking the samples anew with other errors: R = Exp(xi) R^.
    ear::test::check_jacobian(
        [&](const Eigen::VectorXd& step) {
          const smoother::ImuPreintegration moved = with(errors + step).motion;
          Eigen::VectorXd change(9);
          change.segment<3>(imu_error::xi) = log_so3(moved.R_BiBj() * measured.motion.R_BiBj().transpose());
          change.segment<3>(imu_error::dv) = moved.dv_Bi();
          change.segment<3>(imu_error::dp) = moved.dp_Bi();
          return change;
        },
        measured.J_gyro, 1e-5);
    const Pose T_i = random_pose(rng, 0.5, 5.0);
    const Pose T_j{T_i.R * measured.motion.R_BiBj(), T_i.p + random_vector(rng, 0.1)};
    Eigen::VectorXd a = small(rng, 9, 0.5), b = small(rng, 9, 0.5);
    a.segment<3>(smoother::motion_entry::b_g) = b.segment<3>(smoother::motion_entry::b_g) = from.b_g;
    smoother::test::check_factor(InertialFactor(measured), {block(T_i), a, block(T_j), b, errors}, 1e-4);
  }
}

TEST_CASE("calibration: where the body goes after a keyframe turns with it, whatever is frozen") {
  std::mt19937_64 rng{8};
  for (int trial = 0; trial < 5; ++trial) {
    NavState state;
    state.q_WB = Eigen::Quaterniond(exp_so3(random_vector(rng, 0.3)));
    state.p_WB = random_vector(rng, 1.0);
    state.v_W = random_vector(rng, 1.0);
    state.b_a = random_vector(rng, 0.1);
    std::vector<InertialPiece> pieces;
    for (int i = 0; i < 40; ++i) {
      pieces.push_back({5'000'000LL * i, 0.005, random_vector(rng, 0.5), random_vector(rng, 3.0)});
    }
    const auto world = [&](const NavState& from) -> Eigen::Vector3d {
      return from.p_WB + from.q_WB * path_along(pieces, from).back().p_kt;
    };
    NavState other = state;  // another attitude, velocity and bias than what was frozen
    other.q_WB = Eigen::Quaterniond(exp_so3(random_vector(rng, 0.05)) * state.q_WB.toRotationMatrix());
    other.v_W += random_vector(rng, 0.2);
    other.b_a += random_vector(rng, 0.1);
    const PathNode node = path_along(pieces, state).back();
    Onwards onwards{0.2, Eigen::Vector3d::Zero(), node.J_p_ba, state.b_a};
    onwards.pushed = node.p_kt - state.q_WB.conjugate() * (0.2 * state.v_W + 0.5 * 0.04 * kGravity_W);
    BlockValues<double> pose, motion;
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose.v.data()) = other.q_WB.toRotationMatrix();
    Eigen::Map<Eigen::Vector3d>(pose.v.data() + 9) = other.p_WB;
    Eigen::Map<Eigen::Vector3d>(motion.v.data() + smoother::motion_entry::v) = other.v_W;
    Eigen::Map<Eigen::Vector3d>(motion.v.data() + smoother::motion_entry::b_a) = other.b_a;
    CHECK((onwards.position(pose, motion) - world(other)).norm() < 1e-9);
  }
}

TEST_CASE("calibration: a beam meets a tilted plane where a line meets it, by other algebra") {
  std::mt19937_64 rng{9};
  for (int trial = 0; trial < 10; ++trial) {
    const Pose T_WB{exp_so3(random_vector(rng, 0.2)), random_vector(rng, 1.0) + Eigen::Vector3d(0.0, 0.0, 8.0)};
    const Eigen::VectorXd ground = small(rng, 3, 0.1);
    BeamModel beam;
    beam.p_BL = random_vector(rng, 0.1);
    beam.d_B = Eigen::Vector3d(0.1, -0.05, -1.0).normalized();
    beam.tilt = tangent_basis(-beam.d_B);
    beam.centre = {0.3, -0.4};
    const Eigen::Vector3d from = T_WB.p + T_WB.R * beam.p_BL, along = T_WB.R * beam.d_B;
    double low = 0.0, high = 60.0;  // bisection: above the plane, and below it
    for (int i = 0; i < 80; ++i) {
      const double middle = 0.5 * (low + high);
      const Eigen::Vector3d hit = from + middle * along;
      const double plane = ground(0) + ground(1) * (hit.x() - 0.3) + ground(2) * (hit.y() + 0.4);
      (hit.z() > plane ? low : high) = middle;
    }
    beam.range = low;
    const Eigen::VectorXd r = smoother::test::residual(
        BeamFactor(beam),
        {block(T_WB), Eigen::VectorXd::Zero(9), ground, Eigen::VectorXd::Zero(5), Eigen::VectorXd::Zero(1)});
    CHECK(std::abs(r(0)) < 1e-9);
  }
}
