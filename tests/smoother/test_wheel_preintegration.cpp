#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "filter/ekf/so3.h"
#include "smoother/wheel_preintegration.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_drive.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::smoother;
using namespace ear::test;

namespace {

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();
const Eigen::Vector3d kNoRotation = Eigen::Vector3d::Zero();

WheelModel wheels_along_y() {
  WheelModel wheels;
  wheels.radius = {0.075, 0.075};
  return wheels;
}

/// Constant rate [rad/s] and wheel speeds [rad/s] in steps of 10 ms.
WheelDisplacement drive(const WheelModel& wheels, const Eigen::Vector3d& n_Bi, const Eigen::Vector3d& rate_B,
                        const Eigen::Vector2d& wheel_rate, double duration) {
  WheelPreintegration integration(wheels, WheelNoise{});
  integration.start(n_Bi, Eigen::Vector3d::Zero());
  const int steps = static_cast<int>(std::lround(duration / 0.01));
  for (int i = 0; i < steps; ++i) integration.add_interval(rate_B, 0.01, 0.01 * wheel_rate);
  return integration.result();
}

WheelModel random_wheels(std::mt19937_64& rng) {
  WheelModel wheels;
  wheels.radius = {0.074, 0.077};
  wheels.track_width = 0.4;
  wheels.y_B = (Eigen::Vector3d::UnitY() + random_vector(rng, 0.1)).normalized();
  return wheels;
}

Eigen::Vector3d random_normal(std::mt19937_64& rng) { return (kUp + random_vector(rng, 0.2)).normalized(); }

}  // namespace

TEST_CASE("wheel_preintegration: straight ahead on flat ground") {
  const WheelDisplacement z = drive(wheels_along_y(), kUp, kNoRotation, {10.0, 10.0}, 1.0);
  CHECK((z.alpha_Bi - Eigen::Vector3d(0.75, 0.0, 0.0)).norm() < 1e-12);
  CHECK(z.R_BiBj.isIdentity());
  CHECK(z.duration == doctest::Approx(1.0));
  CHECK(z.distance == doctest::Approx(0.75));
  CHECK(z.usable);
}

TEST_CASE("wheel_preintegration: a left turn leads to the left, along the arc") {
  const double turn = 0.8;  // [rad]
  const WheelDisplacement z = drive(wheels_along_y(), kUp, {0.0, 0.0, turn}, {9.0, 11.0}, 1.0);
  const double arc_radius = 0.75 / turn;
  CHECK((z.alpha_Bi - arc_radius * Eigen::Vector3d(std::sin(turn), 1.0 - std::cos(turn), 0.0)).norm() < 1e-5);
  CHECK(z.alpha_Bi.y() > 0.25);
}

TEST_CASE("wheel_preintegration: a turn on the spot leads nowhere") {
  const WheelDisplacement z = drive(wheels_along_y(), kUp, {0.0, 0.0, 1.0}, {-2.7, 2.7}, 1.0);
  CHECK(z.alpha_Bi.norm() < 1e-12);
  CHECK(z.distance == doctest::Approx(0.075 * 2.7));
}

TEST_CASE("wheel_preintegration: the nose goes down on standing wheels, nothing moves") {
  // Nose down is a positive rate about y; wheels that stand turn backwards relative to the body.
  const WheelDisplacement z = drive(wheels_along_y(), kUp, {0.0, 0.5, 0.0}, {-0.5, -0.5}, 1.0);
  CHECK(z.alpha_Bi.norm() < 1e-12);
  CHECK(drive(wheels_along_y(), kUp, {0.0, 0.5, 0.0}, {0.0, 0.0}, 1.0).alpha_Bi.x() > 0.03);  // locked wheels roll
}

TEST_CASE("wheel_preintegration: uphill leads up, whatever the pitch and roll of the body") {
  const double slope = 0.3;
  const Eigen::Vector3d uphill(-std::sin(slope), 0.0, std::cos(slope));
  const WheelDisplacement z = drive(wheels_along_y(), uphill, kNoRotation, {10.0, 10.0}, 1.0);
  CHECK((z.alpha_Bi - 0.75 * Eigen::Vector3d(std::cos(slope), 0.0, std::sin(slope))).norm() < 1e-12);
  // The body pitches about the axle on the way: no difference.
  const WheelDisplacement pitching = drive(wheels_along_y(), uphill, {0.0, 0.4, 0.0}, {9.6, 9.6}, 1.0);
  CHECK((pitching.alpha_Bi - z.alpha_Bi).norm() < 1e-12);
}

TEST_CASE("wheel_preintegration: wheels that climb unlike each other roll further than the middle of the axle goes") {
  // The left wheel rises by 5 degrees, the right one sinks by as much: the axle rolls to the right as it goes level.
  const double climb = 5.0 * M_PI / 180.0;
  WheelModel wheels = wheels_along_y();
  wheels.track_width = 0.4;
  const double roll_rate = 0.75 * std::sin(climb) / 0.2;
  const WheelDisplacement z = drive(wheels, kUp, {roll_rate, 0.0, 0.0}, {10.0, 10.0}, 0.01);
  CHECK(z.alpha_Bi.x() == doctest::Approx(0.0075 * std::cos(climb)).epsilon(1e-5));
  // A jolt of a vehicle that hardly rolls is not a climb.
  CHECK(drive(wheels, kUp, {1.0, 0.0, 0.0}, {1.0, 1.0}, 0.01).alpha_Bi.x() == doctest::Approx(0.00075).epsilon(1e-4));
}

TEST_CASE("wheel_preintegration: the normal may be taken anew on the way") {
  std::mt19937_64 rng{3};
  const std::vector<WheelInterval> intervals = random_drive(rng, 20);
  const WheelModel wheels = random_wheels(rng);
  const Eigen::Vector3d n_Bi = random_normal(rng);
  const WheelDisplacement z = preintegrate(intervals, wheels, WheelNoise{}, n_Bi, kNoRotation);
  // What the gyroscope says of the same normal changes nothing; another one bends the path.
  const std::vector<WheelInterval> first_half(intervals.begin(), intervals.begin() + 10);
  const Eigen::Matrix3d R_BiBk = preintegrate(first_half, wheels, WheelNoise{}, n_Bi, kNoRotation).R_BiBj;
  const NormalSighting same{10, R_BiBk.transpose() * n_Bi};
  CHECK((preintegrate(intervals, wheels, WheelNoise{}, n_Bi, kNoRotation, &same).alpha_Bi - z.alpha_Bi).norm() < 1e-12);
  const NormalSighting uphill{10, R_BiBk.transpose() * (n_Bi - Eigen::Vector3d(0.2, 0.0, 0.0)).normalized()};
  CHECK(preintegrate(intervals, wheels, WheelNoise{}, n_Bi, kNoRotation, &uphill).alpha_Bi.z() > z.alpha_Bi.z() + 0.01);
}

TEST_CASE("wheel_preintegration: a vehicle on its side does not roll") {
  CHECK_FALSE(drive(wheels_along_y(), {0.0, 0.9, std::sqrt(0.19)}, kNoRotation, {10.0, 10.0}, 0.1).usable);
}

TEST_CASE("wheel_preintegration: the derivatives, by bias, normal, radii and axle") {
  std::mt19937_64 rng{5};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const std::vector<WheelInterval> intervals = random_drive(rng, 30);
    const WheelModel wheels = random_wheels(rng);
    const Eigen::Vector3d n_Bi = random_normal(rng);
    const Eigen::Vector3d b_g = random_vector(rng, 0.05);
    const WheelDisplacement z = preintegrate(intervals, wheels, WheelNoise{}, n_Bi, b_g);

    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return preintegrate(intervals, wheels, WheelNoise{}, n_Bi, b_g + d).alpha_Bi;
        },
        z.J_alpha_bias);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return preintegrate(intervals, wheels, WheelNoise{}, n_Bi + d, b_g).alpha_Bi;
        },
        z.J_alpha_normal);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          WheelModel other = wheels;
          other.radius.array() *= 1.0 + d.array();
          return preintegrate(intervals, other, WheelNoise{}, n_Bi, b_g).alpha_Bi;
        },
        z.J_alpha_radius);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          WheelModel other = wheels;
          other.track_width *= 1.0 + d(0);
          return preintegrate(intervals, other, WheelNoise{}, n_Bi, b_g).alpha_Bi;
        },
        z.J_alpha_track_width);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          WheelModel other = wheels;
          other.y_B += d;
          return preintegrate(intervals, other, WheelNoise{}, n_Bi, b_g).alpha_Bi;
        },
        z.J_alpha_axle);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          const WheelDisplacement other = preintegrate(intervals, wheels, WheelNoise{}, n_Bi, b_g + d);
          return log_so3(other.R_BiBj * z.R_BiBj.transpose());
        },
        z.J_xi_bias);

    // With the normal taken anew on the way: the first one counts until then, the bias through both.
    const NormalSighting sighting{15, random_normal(rng)};
    const WheelDisplacement turned = preintegrate(intervals, wheels, WheelNoise{}, n_Bi, b_g, &sighting);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return preintegrate(intervals, wheels, WheelNoise{}, n_Bi, b_g + d, &sighting).alpha_Bi;
        },
        turned.J_alpha_bias);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return preintegrate(intervals, wheels, WheelNoise{}, n_Bi + d, b_g, &sighting).alpha_Bi;
        },
        turned.J_alpha_normal);
  }
}

namespace {

/// What truly happens to a vehicle that was told `intervals`: wheels that slip, ground that turns and bumps. Written
/// for the test alone: sums up in small steps what add_interval does in one.
struct Truth {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  // of O in B_i
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d n;
};

void move(Truth& truth, const WheelInterval& interval, const WheelModel& wheels, const WheelNoise& noise,
          std::mt19937_64& rng) {
  constexpr int kPieces = 4;
  const double dt = interval.dt / kPieces;
  double path = 0.0;
  for (int piece = 0; piece < kPieces; ++piece) {
    const Eigen::Matrix3d R_middle =
        truth.R * Eigen::AngleAxisd(0.5 * dt * interval.gyro_B.norm(), interval.gyro_B.normalized());
    const Eigen::Vector3d ahead = (R_middle * wheels.y_B).cross(truth.n).normalized();
    const double about_axle = interval.gyro_B.dot(wheels.y_B) * dt;
    const double left = wheels.radius(0) * (interval.turn(0) / kPieces + about_axle);
    const double right = wheels.radius(1) * (interval.turn(1) / kPieces + about_axle);
    const double climb = 0.5 * wheels.track_width * dt * ahead.dot(truth.R * interval.gyro_B);
    truth.p += 0.5 * (std::sqrt(left * left - climb * climb) + std::sqrt(right * right - climb * climb)) * ahead;
    path += 0.5 * (std::abs(left) + std::abs(right));
    truth.R = truth.R * Eigen::AngleAxisd(dt * interval.gyro_B.norm(), interval.gyro_B.normalized());
    if (piece + 1 < kPieces) continue;
    const Eigen::Vector3d slips = random_vector(rng, std::sqrt(path));
    truth.p += noise.slip * slips.x() * ahead + noise.side_slip * slips.y() * truth.n.cross(ahead) +
               noise.roughness * slips.z() * truth.n;
    const Eigen::Vector3d tilt = random_vector(rng, noise.normal_walk * std::sqrt(path));
    truth.n = (truth.n + tilt.cross(truth.n)).normalized();
  }
}

/// Entries of the sample covariance whitened by `covariance`, less the identity; standard deviation sqrt(2 / runs).
double worst_excess(const Eigen::MatrixXd& sampled, const Eigen::MatrixXd& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
  REQUIRE(llt.info() == Eigen::Success);
  const Eigen::MatrixXd half = llt.matrixL().solve(sampled);
  const Eigen::MatrixXd white = llt.matrixL().solve(half.transpose());
  return (white - Eigen::MatrixXd::Identity(white.rows(), white.cols())).cwiseAbs().maxCoeff();
}

constexpr int kRuns = 4000;

/// Runs `noise` through truth and sensors many times, and compares the spread of (alpha, xi) with the covariance.
double covariance_excess(const WheelNoise& noise, double seen_sigma, std::uint64_t seed) {
  std::mt19937_64 rng{seed};
  const std::vector<WheelInterval> intervals = random_drive(rng, 30);
  const WheelModel wheels = random_wheels(rng);
  const Eigen::Vector3d n_Bi = random_normal(rng);
  const std::size_t seen = seen_sigma > 0.0 ? 12 : intervals.size();
  // The covariance, at the means.
  Truth mean;
  mean.n = n_Bi;
  for (std::size_t i = 0; i < std::min(seen, intervals.size()); ++i)
    move(mean, intervals[i], wheels, WheelNoise{}, rng);
  const NormalSighting expected{seen, mean.R.transpose() * mean.n, seen_sigma};
  const WheelDisplacement z = preintegrate(intervals, wheels, noise, n_Bi, kNoRotation, &expected);

  Eigen::Matrix<double, 6, 6> sampled = Eigen::Matrix<double, 6, 6>::Zero();
  for (int run = 0; run < kRuns; ++run) {
    Truth truth;
    truth.n = n_Bi;
    WheelPreintegration integration(wheels, noise);
    integration.start(n_Bi, kNoRotation);
    Eigen::Vector2d reading_error = random_vector(rng, noise.reading).head<2>();
    for (std::size_t i = 0; i < intervals.size(); ++i) {
      const WheelInterval& interval = intervals[i];
      if (i == seen) {
        const Eigen::Vector3d n_Bk = truth.R.transpose() * truth.n;
        integration.set_normal((n_Bk + random_vector(rng, seen_sigma).cross(n_Bk)).normalized(), seen_sigma);
      }
      const Eigen::Vector2d next_error = random_vector(rng, noise.reading).head<2>();
      integration.add_interval(interval.gyro_B + random_vector(rng, noise.gyro / std::sqrt(interval.dt)), interval.dt,
                               interval.turn + next_error - reading_error);
      reading_error = next_error;
      move(truth, interval, wheels, noise, rng);
    }
    const WheelDisplacement measured = integration.result();
    Eigen::Matrix<double, 6, 1> e;
    e << truth.p - measured.alpha_Bi, log_so3(truth.R * measured.R_BiBj.transpose());
    sampled += e * e.transpose() / kRuns;
  }
  return worst_excess(sampled, z.covariance);
}

}  // namespace

TEST_CASE("wheel_preintegration: the covariance is that of many noisy drives") {
  WheelNoise noise;
  noise.gyro = 0.01;
  noise.reading = 0.01;
  noise.slip = 2e-3;
  noise.side_slip = 3e-3;
  noise.roughness = 4e-3;
  noise.normal_walk = 0.03;
  const double bound = 5.0 * std::sqrt(2.0 / kRuns);
  CHECK(covariance_excess(noise, 0.0, 21) < bound);
  CHECK(covariance_excess(noise, 0.02, 22) < bound);  // the normal seen anew on the way
  WheelNoise rotation;                                // a normal seen well through a rotation known badly
  rotation.gyro = 0.01;
  rotation.slip = 1e-3;
  rotation.side_slip = rotation.roughness = 5e-4;
  CHECK(covariance_excess(rotation, 5e-4, 23) < bound);
  WheelNoise readings;  // the encoders' noise by itself, plus what makes it regular
  readings.reading = 0.02;
  readings.gyro = 1e-4;
  readings.slip = readings.side_slip = readings.roughness = 1e-5;
  CHECK(covariance_excess(readings, 0.0, 24) < bound);
}

TEST_CASE("wheel_preintegration: the noise of the readings does not grow with their number") {
  WheelNoise noise;
  noise.reading = 1e-3;
  const WheelModel wheels = wheels_along_y();
  const auto variance = [&](int count, const Eigen::Vector3d& rate_B) {
    WheelPreintegration integration(wheels, noise);
    integration.start(kUp, Eigen::Vector3d::Zero());
    for (int i = 0; i < count; ++i) {
      integration.add_interval(rate_B, 1.0 / count, Eigen::Vector2d::Constant(10.0 / count));
    }
    return Eigen::Matrix3d(integration.result().covariance.topLeftCorner<3, 3>());
  };
  // Straight ahead two readings of each wheel count, half a radius each.
  const double expected = 4.0 * std::pow(0.5 * 0.075 * 1e-3, 2);
  CHECK(variance(1, kNoRotation)(0, 0) == doctest::Approx(expected));
  CHECK(variance(1000, kNoRotation)(0, 0) == doctest::Approx(expected));
  // In a turn the others count by what the direction changed between them, which falls with their number.
  const Eigen::Vector3d turning(0.0, 0.0, 1.0);
  CHECK(variance(1000, turning).trace() < 1.01 * expected);
  CHECK(variance(10, turning).trace() < 1.1 * expected);
}
