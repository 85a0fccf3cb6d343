#include "filter/sources/wheels/wheel_rows.h"

#include <doctest/doctest.h>

#include <random>

#include "tests/support/about.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kRadius = 0.075;
constexpr double kTrackWidth = 0.4;

/// Standing at the origin, IMU above the axle.
State simple_state() {
  State x;
  x.odometer.wheel_radius.setConstant(kRadius);
  x.odometer.track_width = kTrackWidth;
  x.odometer.T_BO.p = {0.0, 0.0, -0.05};
  return x;
}

/// 10 ms in which the rims roll at these speeds over a body that does not pitch.
WheelIncrement rims(double left, double right) {
  WheelIncrement turn;
  turn.to_ns = 10'000'000;
  turn.angle = Eigen::Vector2d(left, right) * 0.01 / kRadius;
  return turn;
}

WheelRows rows_of(const State& x, const WheelIncrement& turn, const Eigen::Vector3d& gyro_B,
                  OdometerModel model = OdometerModel::terrain, bool normal_known = true) {
  return linearize_wheels(x, x.imu.R_WB, x.imu.v_W, turn, gyro_B, model, normal_known);
}

/// As it is where side and slope fit: along the path.
State along_path(State x, const Eigen::Vector3d& gyro_B, OdometerModel model, bool normal_known) {
  const WheelRows rows = rows_of(x, rims(0.0, 0.0), gyro_B, model, normal_known);
  const Eigen::Vector3d path = rows.direction.row(WheelRows::speed).transpose();
  x.imu.v_W = x.imu.R_WB * (0.7 * path - x.imu.rate_B(gyro_B).cross(x.odometer.T_BO.p));
  return x;
}

Eigen::Matrix3d pitched(double nose_down) { return exp_so3({0.0, nose_down, 0.0}); }

}  // namespace

TEST_CASE("wheels: straight on, all rows agree") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  CHECK(rows_of(x, rims(0.5, 0.5), Eigen::Vector3d::Zero()).residual.norm() < 1e-12);
  CHECK(rows_of(x, rims(0.6, 0.6), Eigen::Vector3d::Zero()).residual(WheelRows::speed) == doctest::Approx(0.1));
}

TEST_CASE("wheels: a left turn has the right wheel ahead") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  const double rate = 0.8;
  const WheelIncrement turn = rims(0.5 - 0.5 * kTrackWidth * rate, 0.5 + 0.5 * kTrackWidth * rate);
  CHECK(rows_of(x, turn, {0.0, 0.0, rate}).residual.norm() < 1e-12);
}

TEST_CASE("wheels: a nose-down swing on standing wheels turns the encoders back, and moves the IMU, not the axle") {
  State x = simple_state();
  const double rate = 0.7;              // nose-down is positive about y, to the left
  x.imu.v_W = {rate * 0.05, 0.0, 0.0};  // the IMU is above the axle and goes forward
  const WheelIncrement turn = rims(-rate * kRadius, -rate * kRadius);
  const WheelRows terrain = rows_of(x, turn, {0.0, rate, 0.0});
  CHECK(terrain.residual.norm() < 1e-12);
  CHECK(std::abs(terrain.wheel_speed) < 1e-12);
  const WheelRows planar = rows_of(x, turn, {0.0, rate, 0.0}, OdometerModel::gyro);
  CHECK(planar.residual(WheelRows::speed) == doctest::Approx(-rate * kRadius));
}

TEST_CASE("wheels: uphill the velocity goes up, whatever the body's pitch") {
  State x = simple_state();
  const double hill = 0.3;
  x.imu.R_WB = pitched(0.1);
  x.imu.v_W = 0.5 * Eigen::Vector3d(std::cos(hill), 0.0, std::sin(hill));
  x.ground.n_W = {-std::sin(hill), 0.0, std::cos(hill)};
  CHECK(rows_of(x, rims(0.5, 0.5), Eigen::Vector3d::Zero()).residual.norm() < 1e-12);
  const WheelRows planar = rows_of(x, rims(0.5, 0.5), Eigen::Vector3d::Zero(), OdometerModel::gyro);
  CHECK(std::abs(planar.residual(WheelRows::slope)) > 0.1);
}

TEST_CASE("wheels: the wheel that rolls and the gyroscope tell the speed when the other one stands") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  const double rate = 0.8;
  const double left = 0.5 - 0.5 * kTrackWidth * rate, right = 0.5 + 0.5 * kTrackWidth * rate;
  WheelRows rows = rows_of(x, rims(0.0, right), {0.0, 0.0, rate});
  CHECK(std::abs(rows.residual(WheelRows::speed)) > 0.1);
  rows.measure_at(0.5 * kTrackWidth);
  CHECK(std::abs(rows.residual(WheelRows::speed)) < 1e-12);
  rows = rows_of(x, rims(left, 0.0), {0.0, 0.0, rate});
  rows.measure_at(-0.5 * kTrackWidth);
  CHECK(std::abs(rows.residual(WheelRows::speed)) < 1e-12);
}

TEST_CASE("wheels: the Jacobian of one wheel is the derivative, and knows nothing of the other's radius") {
  std::mt19937_64 rng{52};
  const WheelIncrement turn = rims(0.4, 0.55);
  State x = random_state(rng, 0);
  const Eigen::Vector3d gyro_B = random_vector(rng, 0.5);
  x = along_path(x, gyro_B, OdometerModel::gyro, true);
  const double lever = 0.5 * x.odometer.track_width;
  WheelRows rows = rows_of(x, turn, gyro_B, OdometerModel::gyro);
  rows.measure_at(lever);
  const auto prediction = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
    d.head(part.size()) = part;
    const State moved = with_error(x, d);
    const WheelRows both = rows_of(moved, turn, gyro_B, OdometerModel::gyro);
    return -Eigen::VectorXd::Constant(
        1, both.residual(WheelRows::speed) + 0.5 * moved.odometer.track_width * both.residual(WheelRows::yaw_rate));
  };
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, err::accel_matrix);
  H.rightCols<kGroundColumns>() = rows.H.row(WheelRows::speed);
  CHECK(std::abs(rows.H(WheelRows::speed, ground_column(err::wheel_radius))) < 1e-12);
  CHECK(rows.H(WheelRows::speed, ground_column(err::wheel_radius) + 1) != 0.0);
  check_jacobian(prediction, H);
}

TEST_CASE("wheels: Jacobians of every model are the derivatives") {
  std::mt19937_64 rng{51};
  WheelIncrement turn = rims(0.4, 0.55);
  for (const bool normal_known : {true, false}) {
    for (const OdometerModel model : {OdometerModel::terrain, OdometerModel::gyro}) {
      State x = random_state(rng, 0);
      const Eigen::Vector3d gyro_B = random_vector(rng, 0.5);
      x = along_path(x, gyro_B, model, normal_known);
      const WheelRows rows = rows_of(x, turn, gyro_B, model, normal_known);
      const auto prediction = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
        Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
        d.head(part.size()) = part;
        return -rows_of(with_error(x, d), turn, gyro_B, model, normal_known).residual;
      };
      // The attitude and the position do not appear, nor does the cameras' part.
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(WheelRows::size, err::accel_matrix);
      H.rightCols<kGroundColumns>() = rows.H;
      check_jacobian(prediction, H);
      const auto by_rate = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
        return -rows_of(x, turn, gyro_B + d, model, normal_known).residual;
      };
      check_jacobian(by_rate, rows.J_gyro);
    }
  }
}

TEST_CASE("wheels: an error of the velocity across the path shows nothing of where the wheels point") {
  std::mt19937_64 rng{53};
  const WheelIncrement turn = rims(0.4, 0.55);
  const Eigen::Vector3d gyro_B = random_vector(rng, 0.5);
  for (const bool normal_known : {true, false}) {
    State x = along_path(random_state(rng, 0), gyro_B, OdometerModel::terrain, normal_known);
    const WheelRows along = rows_of(x, turn, gyro_B, OdometerModel::terrain, normal_known);
    x.imu.v_W += x.imu.R_WB * along.direction.transpose().rightCols<2>() * Eigen::Vector2d(0.3, -0.2);
    const WheelRows off = rows_of(x, turn, gyro_B, OdometerModel::terrain, normal_known);
    CHECK((off.residual - along.residual).norm() > 0.2);
    CHECK((off.H - along.H).norm() < 1e-12);
  }
}

TEST_CASE("wheels: what the first order leaves out of the speed is as large as many draws say") {
  std::mt19937_64 rng{54};
  const WheelIncrement turn = rims(0.4, 0.55);
  State x = random_state(rng, 0);
  const Eigen::Vector3d gyro_B = x.imu.b_g;  // it does not turn
  x = along_path(x, gyro_B, OdometerModel::gyro, true);
  // A velocity that was learned along a direction that is not known, and errors of its own.
  const double speed = x.imu.v_W.norm();
  Eigen::Matrix<double, 6, 6> root = Eigen::Matrix<double, 6, 6>::Zero();  // of phi and nu
  root.topLeftCorner<3, 3>() = 0.05 * Eigen::Matrix3d::Identity();
  root.bottomLeftCorner<3, 3>() = -0.02 * speed * x.imu.R_WB * x.odometer.T_BO.R * skew(Eigen::Vector3d::UnitX());
  root.bottomRightCorner<3, 3>() = 0.03 * Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, 6, 6> P = root * root.transpose();
  const auto speed_at = [&](const Eigen::Matrix<double, 6, 1>& error) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
    d.segment<3>(err::odometer) = error.head<3>();
    d.segment<3>(err::nu) = error.tail<3>();
    return -rows_of(with_error(x, d), turn, gyro_B, OdometerModel::gyro).residual(WheelRows::speed);
  };
  const Eigen::Matrix<double, 1, kGroundColumns> H =
      rows_of(x, turn, gyro_B, OdometerModel::gyro).H.row(WheelRows::speed);
  const double predicted = speed_at(Eigen::Matrix<double, 6, 1>::Zero());
  constexpr int kDraws = 20000;
  double squares = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::Matrix<double, 6, 1> white;
    white << random_vector(rng, 1.0), random_vector(rng, 1.0);
    const Eigen::Matrix<double, 6, 1> error = root * white;
    // The turn alone bends the direction too: that is no error of the velocity.
    Eigen::Matrix<double, 6, 1> turned = error;
    turned.tail<3>().setZero();
    const double bent = speed_at(turned) - predicted;
    const double linear = H.segment<3>(ground_column(err::nu)).dot(error.tail<3>());
    squares += std::pow(speed_at(error) - predicted - linear - bent, 2) / kDraws;
  }
  const double expected = speed_left_out(x.imu.R_WB * x.odometer.T_BO.R, P.topLeftCorner<3, 3>(),
                                         P.topRightCorner<3, 3>(), P.bottomRightCorner<3, 3>());
  CHECK(squares == about(expected, 0.05));
}

TEST_CASE("wheels: what readings are off by counts at both ends of a turn") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  x.odometer.reading_error = {0.002, 0.003};  // at the beginning, at the end
  WheelRows rows = rows_of(x, rims(0.6, 0.6), Eigen::Vector3d::Zero());
  rows.count_readings(x.odometer, 1, 0.01);
  CHECK(std::abs(rows.residual(WheelRows::speed)) < 1e-12);
  const auto prediction = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    State moved = x;
    moved.odometer.reading_error += d;
    WheelRows there = rows_of(moved, rims(0.6, 0.6), Eigen::Vector3d::Zero());
    there.count_readings(moved.odometer, 1, 0.01);
    return -there.residual;
  };
  check_jacobian(prediction, rows.H.middleCols<2>(ground_column(err::readings)));
}

TEST_CASE("encoder reader: differences, wrap either way, cumulative counts") {
  EncoderCalibration calibration;
  calibration.resolution = 1000;
  EncoderReader wrapping(calibration);
  CHECK_FALSE(wrapping.add({0, 990, 10}));
  const auto forward_and_back = wrapping.add({10'000'000, 15, 985});
  REQUIRE(forward_and_back);
  CHECK(forward_and_back->angle.x() == doctest::Approx(2.0 * M_PI * 0.025));
  CHECK(forward_and_back->angle.y() == doctest::Approx(-2.0 * M_PI * 0.025));
  CHECK(forward_and_back->duration() == doctest::Approx(0.01));

  calibration.wraps = false;
  EncoderReader cumulative(calibration);
  CHECK_FALSE(cumulative.add({0, 0, 0}));
  CHECK(cumulative.add({10'000'000, 2500, 0})->angle.x() == doctest::Approx(2.0 * M_PI * 2.5));
}
