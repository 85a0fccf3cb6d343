#include "filter/sources/ground/ground_rows.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

namespace {

std::vector<LaserBeam> three_beams() {
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  return {{"front_left", {0.1, 0.1, -0.03}, down},
          {"front_right", {0.1, -0.1, -0.03}, down},
          {"rear", {-0.16, 0.0, -0.02}, (down + Eigen::Vector3d(-0.05, 0.02, 0.0)).normalized()}};
}

State on_plane(const Eigen::Vector3d& n_W, const Eigen::Matrix3d& R_WB) {
  State x;
  x.imu.R_WB = R_WB;
  x.ground.n_W = n_W.normalized();
  x.odometer.wheel_radius.setConstant(0.075);
  x.odometer.T_BO.p = {-0.02, 0.0, -0.05};
  return x;
}

}  // namespace

TEST_CASE("ground: on a level floor a beam straight down measures its height above it") {
  const State x = on_plane(Eigen::Vector3d::UnitZ(), Eigen::Matrix3d::Identity());
  // The floor is 0.075 below O, which is 0.05 below the body; the beam starts 0.03 below the body.
  CHECK(predict_range(x, x.imu.R_WB, three_beams()[0], 0.0).range == doctest::Approx(0.095));
}

TEST_CASE("ground: nose-down brings the ground closer to the front beams") {
  const State x = on_plane(Eigen::Vector3d::UnitZ(), exp_so3({0.0, 0.1, 0.0}));
  CHECK(predict_range(x, x.imu.R_WB, three_beams()[0], 0.0).range < 0.095 - 0.005);
  CHECK(predict_range(x, x.imu.R_WB, three_beams()[2], 0.0).range > 0.105 + 0.005);
}

TEST_CASE("ground: the axle of a vehicle that stands on its right wheel leans to the left of the ground") {
  // Rolled about x, the left wheel up: y points up from the floor.
  const State up = on_plane(Eigen::Vector3d::UnitZ(), exp_so3({0.1, 0.0, 0.0}));
  CHECK(predict_lean(up, up.imu.R_WB, OdometerAxis::left).lean == doctest::Approx(std::sin(0.1)));
  // On a floor that rises to the left by as much it stands on both.
  const State along = on_plane({0.0, -std::sin(0.1), std::cos(0.1)}, exp_so3({0.1, 0.0, 0.0}));
  CHECK(std::abs(predict_lean(along, along.imu.R_WB, OdometerAxis::left).lean) < 1e-12);
}

TEST_CASE("ground: a vehicle whose nose is down leans forward, unless the ground goes down with it") {
  const State level = on_plane(Eigen::Vector3d::UnitZ(), exp_so3({0.0, 0.1, 0.0}));
  CHECK(predict_lean(level, level.imu.R_WB, OdometerAxis::forward).lean == doctest::Approx(-std::sin(0.1)));
  const State downhill = on_plane({std::sin(0.1), 0.0, std::cos(0.1)}, exp_so3({0.0, 0.1, 0.0}));
  CHECK(std::abs(predict_lean(downhill, downhill.imu.R_WB, OdometerAxis::forward).lean) < 1e-12);
}

TEST_CASE("ground: the plane through the predicted hits is the plane") {
  std::mt19937_64 rng{61};
  for (int i = 0; i < 20; ++i) {
    const State x = on_plane(Eigen::Vector3d::UnitZ() + random_vector(rng, 0.2), exp_so3(random_vector(rng, 0.15)));
    const auto beams = three_beams();
    Eigen::Vector3d range;
    for (std::size_t k = 0; k < 3; ++k) {
      range(static_cast<Eigen::Index>(k)) = predict_range(x, x.imu.R_WB, beams[k], 0.0).range;
    }
    const auto plane = plane_through_hits(beams, range, x.odometer.T_BO.p);
    REQUIRE(plane);
    CHECK((x.imu.R_WB * plane->n_B - x.ground.n_W).norm() < 1e-12);
    CHECK(plane->height == doctest::Approx(0.075));
  }
}

TEST_CASE("ground: no plane from a missing range, or from hits on one line") {
  const auto beams = three_beams();
  CHECK_FALSE(plane_through_hits(beams, {0.1, std::numeric_limits<double>::quiet_NaN(), 0.1}, {0, 0, -0.05}));
  auto in_line = beams;
  in_line[2].p_BL = 0.5 * (beams[0].p_BL + beams[1].p_BL);
  in_line[2].d_B = beams[0].d_B;
  CHECK_FALSE(plane_through_hits(in_line, {0.1, 0.1, 0.1}, {0, 0, -0.05}));
}

TEST_CASE("ground: the paper's angles are the special case of perpendicular beams") {
  // Three beams that leave one point at right angles to each other (the paper's figure 4): phi from the two front
  // ranges, psi from these and the rear one, (2) and (3). The plane's normal has the same direction.
  const Eigen::Vector3d normal = Eigen::Vector3d(0.06, -0.04, 1.0).normalized();
  const double h = 0.2;
  std::vector<LaserBeam> beams(3);
  const double a = std::sqrt(2.0 / 3.0), c = std::sqrt(1.0 / 3.0);
  for (int i = 0; i < 3; ++i) {
    const double azimuth = M_PI / 3.0 + 2.0 * M_PI / 3.0 * i;
    beams[static_cast<std::size_t>(i)].d_B = {a * std::cos(azimuth), a * std::sin(azimuth), -c};
  }
  Eigen::Vector3d range;
  for (Eigen::Index i = 0; i < 3; ++i) range(i) = -h / normal.dot(beams[static_cast<std::size_t>(i)].d_B);
  const auto plane = plane_through_hits(beams, range, Eigen::Vector3d::Zero());
  REQUIRE(plane);
  CHECK((plane->n_B - normal).norm() < 1e-12);
  // With orthonormal beams the normal is proportional to the inverse ranges along them.
  Eigen::Matrix3d D;
  for (Eigen::Index i = 0; i < 3; ++i) D.col(i) = beams[static_cast<std::size_t>(i)].d_B;
  CHECK((D * D.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  const Eigen::Vector3d closed_form = -(D * range.cwiseInverse()).normalized();
  CHECK((closed_form - plane->n_B).norm() < 1e-12);
}

TEST_CASE("ground: slopes of hand-made grounds") {
  const double hill = 0.2;
  const Eigen::Vector3d left_W = Eigen::Vector3d::UnitY();
  const Slope uphill = slope(left_W, {-std::sin(hill), 0.0, std::cos(hill)});
  CHECK(uphill.along == doctest::Approx(hill));
  CHECK(uphill.across == doctest::Approx(0.0));
  const Slope higher_on_the_left = slope(left_W, {0.0, -std::sin(hill), std::cos(hill)});
  CHECK(higher_on_the_left.along == doctest::Approx(0.0));
  CHECK(higher_on_the_left.across == doctest::Approx(hill));
}

TEST_CASE("ground: a vehicle that leaves a ramp straight ahead does not climb, one that rises does") {
  State x;
  x.ground.n_W = Eigen::Vector3d(-std::sin(0.2), 0.0, std::cos(0.2));  // uphill ahead
  x.imu.v_W = {std::cos(0.2), 0.0, std::sin(0.2)};
  CHECK(std::abs(predict_climb(x).speed) < 1e-12);
  x.imu.v_W += 0.3 * x.ground.n_W;
  CHECK(predict_climb(x).speed == doctest::Approx(0.3));
}

TEST_CASE("ground: Jacobians are the derivatives") {
  std::mt19937_64 rng{62};
  for (int i = 0; i < 5; ++i) {
    const State x = random_state(rng, 0);
    const LaserBeam laser{"", random_vector(rng, 0.1),
                          (-Eigen::Vector3d::UnitZ() + random_vector(rng, 0.2)).normalized()};
    for (int beam = 0; beam < kMaxBeams; ++beam) {
      const BeamPrediction z = predict_range(x, x.imu.R_WB, laser, x.odometer.beam_offset(beam));
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, err::camera);
      H.block<1, 2>(0, err::normal) = z.H_normal;
      H.block<1, 3>(0, err::axle) = z.H_axle;
      H(0, err::beams + beam) = 1.0;
      const auto range = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
        Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
        d.head(part.size()) = part;
        d.segment<2>(err::wheel_radius).setZero();
        const State moved = with_error(x, d);
        return Eigen::VectorXd::Constant(
            1, predict_range(moved, moved.imu.R_WB, laser, moved.odometer.beam_offset(beam)).range);
      };
      check_jacobian(range, H);
    }
    for (const OdometerAxis axis : {OdometerAxis::forward, OdometerAxis::left}) {
      const LeanPrediction z = predict_lean(x, x.imu.R_WB, axis);
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, err::camera);
      H.block<1, 2>(0, err::normal) = z.H_normal;
      H.block<1, 3>(0, err::odometer) = z.H_odometer;
      const auto lean = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
        Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
        d.head(part.size()) = part;
        const State moved = with_error(x, d);
        return Eigen::VectorXd::Constant(1, predict_lean(moved, moved.imu.R_WB, axis).lean);
      };
      check_jacobian(lean, H);
    }
    const Eigen::Vector3d y_B = x.odometer.T_BO.R.col(1);
    const auto slopes = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
      Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
      d.segment<3>(err::theta) = part.head<3>();
      d.segment<2>(err::normal) = part.tail<2>();
      const State moved = with_error(x, d);
      const Slope s = slope(moved.imu.R_WB * y_B, moved.ground.n_W);
      return Eigen::Vector2d(s.along, s.across);
    };
    check_jacobian(slopes, slope(x.imu.R_WB * y_B, x.ground.n_W).J);

    const auto climb = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
      Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
      d.head(part.size()) = part;
      return Eigen::VectorXd::Constant(1, predict_climb(with_error(x, d)).speed);
    };
    Eigen::MatrixXd H_climb = Eigen::MatrixXd::Zero(1, err::normal + 2);
    H_climb.middleCols<2>(err::normal) = predict_climb(x).H_normal;
    H_climb.middleCols<3>(err::nu) = predict_climb(x).H_velocity;
    check_jacobian(climb, H_climb);
  }
}
