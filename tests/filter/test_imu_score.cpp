#include "filter/sources/imu_score.h"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "filter/ekf/so3.h"
#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

double gyro_score(const ImuScore& score) { return 1.0 / score.noise().gyro; }
double accel_score(const ImuScore& score) { return 1.0 / score.noise().accel; }

constexpr TimeNs kFrame = 33'333'333;
const double kTurnSigma = 1e-4;   // [rad] of the gyroscope over a frame, as stated
const double kShiftSigma = 1e-3;  // [m] of the accelerometer

/// What the images' fit says of its own errors: a turn and a displacement that are hard to tell apart.
Eigen::Matrix<double, 6, 6> covariance_of_images() {
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << 1e-4, 1.5e-4, 1e-4, 5e-4, 5e-4, 5e-4;
  Eigen::Matrix<double, 6, 6> correlation = Eigen::Matrix<double, 6, 6>::Identity();
  correlation(1, 3) = correlation(3, 1) = 0.9;
  correlation(0, 4) = correlation(4, 0) = -0.9;
  return sigma.asDiagonal() * correlation * sigma.asDiagonal();
}

/// What inertial sensors and images are like.
struct Rig {
  double gyro = 1.0, accel = 1.0;  ///< noise, so many times the stated one
  double shift = 0.0;              ///< of every displacement that the images show, along their least certain direction
  double gyro_bias = 0.0;          ///< [rad/s] about z, of which the state knows nothing
  double turn_rate = 0.0;          ///< [rad/s] about x
  double mounting = 0.0;           ///< [rad] standard deviation of the cameras'
  double time_offset = 0.0;        ///< [s] standard deviation
};

/// The score after some time, and how the rates were judged in it.
struct Judged {
  ImuScore score{true, imu_limits(PriorConfig{})};
  int fit = 0, unfit = 0;
};

Judged judged_after(double seconds, const Rig& rig, unsigned seed) {
  std::mt19937_64 rng{seed};
  std::normal_distribution<double> normal;
  const auto draw = [&](int n) { return Eigen::VectorXd::NullaryExpr(n, [&] { return normal(rng); }).eval(); };
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<3>(err::camera).setConstant(rig.mounting);
  sigma(err::time_offset) = rig.time_offset;
  Covariance P(err::clones);
  P.reset(sigma);
  const Eigen::Matrix<double, 6, 6> C = covariance_of_images();
  const Eigen::Matrix<double, 6, 6> L = C.llt().matrixL();
  Judged judged;
  for (TimeNs t_ns = 0; t_ns < static_cast<TimeNs>(1e9 * seconds); t_ns += kFrame) {
    ImuMotion motion;
    motion.duration = 1.0 / 30.0;
    const double turn =
        rig.turn_rate * motion.duration * (rig.time_offset > 0.0 ? std::sin(1e-9 * static_cast<double>(t_ns)) : 1.0);
    const Eigen::Matrix3d turned = exp_so3({turn, 0.0, 0.0});
    motion.T_BiBj.R = turned * exp_so3(rig.gyro * kTurnSigma * draw(3));
    motion.T_BiBj.p = rig.accel * kShiftSigma * draw(3);
    motion.covariance = Eigen::Matrix3d::Identity() * kShiftSigma * kShiftSigma;
    motion.turn_variance = kTurnSigma * kTurnSigma;
    const Eigen::VectorXd off = L * draw(6) + rig.shift / C(3, 3) * C.col(3);
    StereoMotion images;
    images.T_B0B1.R = turned * exp_so3({off(0), off(1), off(2) + rig.gyro_bias * motion.duration});
    images.T_B0B1.p = off.tail<3>();
    images.covariance = C;
    images.matches = images.fitting = 100;
    const std::optional<Innovation> excess = judged.score.add(motion, images, State{}, P, t_ns);
    REQUIRE(excess);
    ++(excess->fits ? judged.fit : judged.unfit);
  }
  return judged;
}

ImuScore score_after(double seconds, double gyro, double accel, double shift, unsigned seed) {
  Rig rig;
  rig.gyro = gyro;
  rig.accel = accel;
  rig.shift = shift;
  return judged_after(seconds, rig, seed).score;
}

}  // namespace

TEST_CASE("imu score: sensors as good as stated keep their noise") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const ImuScore score = score_after(10.0, 1.0, 1.0, 0.0, seed);
    CHECK(gyro_score(score) > 0.9);
    CHECK(accel_score(score) > 0.9);
  }
}

TEST_CASE("imu score: noise beyond the data sheet is found, in the sensor that has it") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const ImuScore gyro = score_after(10.0, 5.0, 1.0, 0.0, seed);
    CHECK(gyro.noise().gyro > 3.5);
    CHECK(gyro.noise().gyro < 6.0);
    CHECK(accel_score(gyro) > 0.9);
    const ImuScore accel = score_after(10.0, 1.0, 6.0, 0.0, seed);
    CHECK(accel.noise().accel > 4.0);
    CHECK(accel.noise().accel < 7.5);
    CHECK(gyro_score(accel) > 0.75);
  }
}

TEST_CASE(
    "imu score: a displacement that the images show wrongly, with a turn to match, is no noise of the gyroscope") {
  for (unsigned seed = 1; seed <= 10; ++seed) CHECK(gyro_score(score_after(10.0, 1.0, 1.0, 1.5e-3, seed)) > 0.85);
}

TEST_CASE("imu score: one image that is wrong changes little, and those in which something moves nothing") {
  ImuScore score = score_after(10.0, 1.0, 1.0, 0.0, 1);
  Covariance P(err::clones);
  P.reset(Eigen::VectorXd::Zero(err::clones));
  ImuMotion motion;
  motion.duration = 1.0 / 30.0;
  motion.covariance = Eigen::Matrix3d::Identity() * kShiftSigma * kShiftSigma;
  motion.turn_variance = kTurnSigma * kTurnSigma;
  StereoMotion images;
  images.T_B0B1.R = exp_so3({0.1, 0.1, 0.1});
  images.covariance = covariance_of_images();
  images.matches = 100;
  images.fitting = 80;
  const double before = gyro_score(score);
  (void)score.add(motion, images, State{}, P, 10 * 1'000'000'000LL);
  CHECK(gyro_score(score) == before);
  images.fitting = 100;
  (void)score.add(motion, images, State{}, P, 10 * 1'000'000'000LL);
  CHECK(gyro_score(score) < before);
  CHECK(gyro_score(score) > 0.5);
}

TEST_CASE("imu score: a bias of the gyroscope that no single image shows is found in half a second") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    CHECK(judged_after(60.0, {}, seed).unfit == 0);
    Rig biased;
    biased.gyro_bias = 0.01;  // three standard deviations of a frame
    CHECK(judged_after(0.5, biased, seed).unfit > 5);
    CHECK(judged_after(10.0, biased, seed).fit < 10);
  }
}

TEST_CASE("imu score: a bias of the gyroscope that jumps is found, but not where something else moves") {
  Covariance P(err::clones);
  P.reset(Eigen::VectorXd::Zero(err::clones));
  for (unsigned seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    CHECK(judged_after(10.0, {}, seed).score.take_excess(P).gyro == 0.0);
    Rig biased;
    biased.gyro_bias = 0.02;
    CHECK(judged_after(2.0, biased, seed).score.take_excess(P).gyro == about(0.02, 0.1));
    Rig moving = biased;
    moving.shift = 0.1;  // the images show another displacement than the samples
    CHECK(judged_after(2.0, moving, seed).score.take_excess(P).gyro == 0.0);
  }
}

TEST_CASE("imu score: nor is it a fault what the cameras' mounting and time offset make of a turn") {
  Rig turning;
  turning.gyro_bias = 0.01;
  turning.turn_rate = 1.0;
  CHECK(judged_after(10.0, turning, 1).unfit > 200);
  Rig mounted = turning;
  mounted.mounting = 0.01;
  CHECK(judged_after(10.0, mounted, 1).unfit == 0);
  turning.time_offset = 0.02;  // the rate changes by up to 1 rad/s^2
  CHECK(judged_after(1.0, turning, 1).unfit == 0);
}

TEST_CASE("imu score: what the samples show at rest is the noise that innovations are compared with") {
  ImuCalibration stated;
  ImuStatistics rest;
  rest.count = 100;
  rest.gyro_density = 4.0 * stated.gyro_noise;
  rest.accel_density = 0.5 * stated.accel_noise;
  ImuScore score(true, imu_limits(PriorConfig{}));
  score.add_rest(rest, stated);
  CHECK(score.noise().gyro == doctest::Approx(4.0));
  CHECK(score.noise().accel == 1.0);  // never less than stated
  rest.count = 5;
  rest.gyro_density = 100.0 * stated.gyro_noise;
  score.add_rest(rest, stated);
  CHECK(score.noise().gyro == doctest::Approx(4.0));
}

TEST_CASE("imu score: switched off, the noise is the stated one") {
  ImuScore score(false, imu_limits(PriorConfig{}));
  CHECK(score.noise().gyro == 1.0);
  CHECK(score.noise().accel == 1.0);
}
