// A vehicle without camera and lasers on ground that nothing sees: what it learns by turning on the spot.
#include <doctest/doctest.h>

#include <cmath>
#include <optional>
#include <random>

#include "filter/ekf/so3.h"
#include "filter/filter.h"
#include "tests/support/hand_made_drive.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kImuStep = 0.01;                   // [s]
constexpr double kRadius = 0.1, kTrackWidth = 0.4;  // [m]
constexpr double kPush = 0.5;                       // [m/s^2] for a second, and the same to stop
constexpr double kLeg = 10.0, kTurn = 3.0;          // [s]
constexpr int kLegs = 8;

/// On level ground: straight ahead, a turn on the spot, and so on. The body rocks.
struct Robot {
  double turn = 0.0;                                // after each leg [rad]
  Eigen::Vector3d mounting_W = {0.0, 0.0, 0.0};     // of the sensors on it [rad]
  Eigen::Vector2d phase = Eigen::Vector2d::Zero();  // of its rocking [rad]

  struct Motion {
    double heading = 0.0, distance = 0.0, acceleration = 0.0;
  };
  [[nodiscard]] Motion at(double t) const {
    Motion m;
    for (int leg = 0; leg < kLegs && t > 0.0; ++leg, t -= kLeg + kTurn) {
      const double s = std::min(t, kLeg);
      const double pushed = std::min(s, 1.0), braked = std::max(0.0, s - (kLeg - 1.0));
      m.acceleration = t < 1.0 ? kPush : t > kLeg - 1.0 && t < kLeg ? -kPush : 0.0;
      m.distance += 0.5 * kPush * pushed * pushed + kPush * (s - pushed) - 0.5 * kPush * braked * braked;
      const double part = std::min(std::max(0.0, t - kLeg), kTurn) / kTurn;
      m.heading += turn * (part - std::sin(2.0 * M_PI * part) / (2.0 * M_PI));
    }
    return m;
  }
  [[nodiscard]] double nod(double t) const { return 0.01 * std::sin(5.0 * t + phase.x()); }
  [[nodiscard]] Eigen::Matrix3d R_WB(double t) const {
    const double roll = 0.01 * std::sin(4.0 * t + phase.y());
    return (Eigen::AngleAxisd(at(t).heading, Eigen::Vector3d::UnitZ()) *
            Eigen::AngleAxisd(nod(t), Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
               .toRotationMatrix() *
           exp_so3(mounting_W);
  }
  [[nodiscard]] Eigen::Vector3d gyro_B(double t) const {
    return rate_of([this](double moment) { return R_WB(moment); }, t);
  }
  [[nodiscard]] Eigen::Vector3d accel_B(double t) const {
    const Motion m = at(t);
    const Eigen::Vector3d along(std::cos(m.heading), std::sin(m.heading), 0.0);
    return R_WB(t).transpose() * (m.acceleration * along + Eigen::Vector3d(0.0, 0.0, 9.81));
  }
};

struct Height {
  double error = 0.0, sigma = 0.0;  ///< at the end [m]
};

struct Flaws {
  bool axes = false;  ///< of the gyroscope: they point elsewhere than the accelerometer's
  int repeats = 1;    ///< of each of the encoders' readings
};

/// One of many: bias, mounting, and axes that are off are drawn from what the settings say of them.
Height drive(std::uint64_t seed, double turn, const Flaws& flaws = {}) {
  std::mt19937_64 rng{seed};
  const auto noise = [&](double sigma) { return random_vector(rng, sigma); };
  const FilterConfig config;
  Robot robot;
  robot.turn = turn;
  robot.mounting_W = noise(config.prior.odometer_unseen);
  robot.phase = noise(3.0).head<2>();
  const Eigen::Vector3d b_g = noise(0.01), b_a = noise(config.prior.accel_bias);
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (int axis = 0; flaws.axes && axis < 3; ++axis) axes.col(axis) = noise(config.prior.gyro_axes_unseen);
  axes.diagonal().setOnes();
  Calibration calibration = two_wheels(kRadius, kTrackWidth);
  calibration.imu.gyro_noise = 5e-4;
  calibration.imu.accel_noise = 1e-2;
  EncoderCalibration& axle = *calibration.encoder;
  axle.noise_counts = 20.0;
  Filter filter(config, calibration);

  std::optional<Estimate> last;
  const double standing = 1.0;  // [s] before it begins
  const int steps = static_cast<int>((standing + kLegs * (kLeg + kTurn)) / kImuStep);
  for (int k = 0; k <= steps; ++k) {
    const double t = k * kImuStep - standing;
    filter.add_imu(
        {stamp(k * kImuStep), axes * robot.gyro_B(t) + b_g + noise(5e-3), robot.accel_B(t) + b_a + noise(0.1)});
    const double read = (k - k % flaws.repeats) * kImuStep - standing;
    const Robot::Motion m = robot.at(read);
    const double counts = static_cast<double>(axle.resolution) / (2.0 * M_PI);
    const double both = m.distance / kRadius - robot.nod(read), apart = 0.5 * kTrackWidth / kRadius * m.heading;
    filter.add_encoder(
        {stamp(k * kImuStep), std::llround(counts * (both - apart)), std::llround(counts * (both + apart))});
    if (k % 5 == 0) last = filter.process_without_image(stamp(k * kImuStep));
  }
  REQUIRE(last);
  constexpr int z = estimate_error::position + 2;
  return {last->state.p_WB.z(), std::sqrt(last->covariance(z, z))};
}

constexpr double kNoTurn = 0.0, kQuarter = M_PI / 2.0;  // [rad]
constexpr int kRobots = 10;
constexpr double kConsistent = 3.0;  // 99.9 % of the means of ten with one degree of freedom

/// Means over the robots.
struct Heights {
  double squares = 0.0, sigma = 0.0, nees = 0.0;
};

Heights drives(double turn, const Flaws& flaws = {}) {
  Heights mean;
  for (std::uint64_t seed = 951; seed < 951 + kRobots; ++seed) {
    const Height height = drive(seed, turn, flaws);
    mean.squares += height.error * height.error / kRobots;
    mean.sigma += height.sigma / kRobots;
    mean.nees += std::pow(height.error / height.sigma, 2) / kRobots;
  }
  return mean;
}

}  // namespace

TEST_CASE("unseen ground: by turning on the spot it shows which way is along it") {
  const Heights ahead = drives(kNoTurn), around = drives(kQuarter);
  MESSAGE("ahead ", std::sqrt(ahead.squares), " m, NEES ", ahead.nees, "; around ", std::sqrt(around.squares),
          " m, NEES ", around.nees);
  CHECK(ahead.nees < kConsistent);
  CHECK(around.nees < kConsistent);
  CHECK(around.sigma < 0.85 * ahead.sigma);
  CHECK(around.squares < 0.5 * ahead.squares);
}

TEST_CASE("unseen ground: a turn that the gyroscope takes for a tilt is none of the ground") {
  const Heights around = drives(kQuarter, {true});
  MESSAGE(std::sqrt(around.squares), " m, NEES ", around.nees);
  CHECK(around.nees < kConsistent);
}

TEST_CASE("unseen ground: readings that repeat do not say that it stands") {
  constexpr int kRepeats = 6;
  const Heights ahead = drives(kNoTurn, {false, kRepeats});
  MESSAGE(std::sqrt(ahead.squares), " m, NEES ", ahead.nees);
  CHECK(ahead.nees < kConsistent);
}
