// A vehicle without camera and lasers whose body moves on its springs: where it points is not where it goes.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/so3.h"
#include "filter/filter.h"
#include "tests/support/about.h"
#include "tests/support/hand_made_drive.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kImuStep = 0.01;  // [s]
constexpr double kDuration = 60.0;
constexpr double kRadius = 0.34;  // of the wheels, as the calibration says [m]

/// Along the world's x axis, faster and slower; the body nods with the acceleration and with the road.
struct Car {
  double wheel_factor = 1.0;                        // true radius over that of the calibration
  double mounting_pitch = 0.0, mounting_yaw = 0.0;  // of the sensors on the body, nose down and to the left [rad]
  std::array<double, 8> phase{};                    // of the road [rad]

  static double distance(double t) { return 15.0 * t - 4.0 / 0.3 * std::cos(0.3 * t); }
  static double acceleration(double t) { return 1.2 * std::cos(0.3 * t); }
  [[nodiscard]] double nod(double t) const {
    return -5e-3 * acceleration(t) + 3e-3 * std::sin(0.5 * t + phase[0]) + 2e-3 * std::sin(1.1 * t + phase[1]) +
           2e-3 * std::sin(2.4 * t + phase[2]) + 2e-3 * std::sin(7.5 * t + phase[3]);
  }
  [[nodiscard]] double weave(double t) const {
    return 1.5e-3 * std::sin(0.4 * t + phase[4]) + 1.5e-3 * std::sin(1.0 * t + phase[5]) +
           1e-3 * std::sin(3.1 * t + phase[6]) + 1e-3 * std::sin(6.0 * t + phase[7]);
  }

  [[nodiscard]] Eigen::Matrix3d R_WB(double t) const {
    return (Eigen::AngleAxisd(weave(t) + mounting_yaw, Eigen::Vector3d::UnitZ()) *
            Eigen::AngleAxisd(nod(t) + mounting_pitch, Eigen::Vector3d::UnitY()))
        .toRotationMatrix();
  }
  [[nodiscard]] Eigen::Vector3d gyro_B(double t) const {
    return rate_of([this](double moment) { return R_WB(moment); }, t);
  }
  [[nodiscard]] Eigen::Vector3d accel_B(double t) const {
    return R_WB(t).transpose() * Eigen::Vector3d(acceleration(t), 0.0, 9.81);
  }
  /// Of the wheels against the body, which turns with them as it nods [rad].
  [[nodiscard]] double wheel_angle(double t) const { return distance(t) / (wheel_factor * kRadius) - nod(t); }
};

struct Outcome {
  double radius = 0.0;                                   // mean of both [m]
  Eigen::Vector3d position = Eigen::Vector3d::Zero();    // at the end [m]
  Eigen::Vector3d error = Eigen::Vector3d::Zero();       // of it [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of that [m^2]
  [[nodiscard]] double nees() const { return error.dot(covariance.ldlt().solve(error)); }
};

Outcome drive(const Car& car, std::uint64_t seed, const FilterConfig& config = {}) {
  std::mt19937_64 rng{seed};
  std::normal_distribution<double> normal;
  const auto noise = [&](double sigma) -> Eigen::Vector3d {
    return sigma * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
  };
  Calibration calibration = two_wheels(kRadius, 1.57);
  calibration.imu.gyro_noise = 5e-4;
  calibration.imu.accel_noise = 1e-2;
  EncoderCalibration& axle = *calibration.encoder;
  axle.noise_counts = 20.0;
  Filter filter(config, calibration);

  const Eigen::Vector3d b_g = noise(0.03), b_a = noise(0.02);
  std::optional<Estimate> last;
  const int steps = static_cast<int>(kDuration / kImuStep);
  for (int k = 0; k <= steps; ++k) {
    const double t = k * kImuStep;
    filter.add_imu({stamp(t), car.gyro_B(t) + b_g + noise(5e-3), car.accel_B(t) + b_a + noise(0.1)});
    const auto count = static_cast<std::int64_t>(
        std::llround(car.wheel_angle(t) / (2.0 * M_PI) * static_cast<double>(axle.resolution) + 20.0 * normal(rng)));
    filter.add_encoder({stamp(t), count, count});
    if (k % 5 == 0) last = filter.process_without_image(stamp(t));
  }
  REQUIRE(last);
  Outcome outcome;
  outcome.radius = filter.ekf().state().odometer.wheel_radius.mean();
  outcome.position = last->state.p_WB;
  // The world begins with the first sample: its origin there, its heading that of the body.
  const double heading = -car.weave(0.0) - car.mounting_yaw;
  outcome.error = last->state.p_WB - (Car::distance(kDuration) - Car::distance(0.0)) *
                                         Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0);
  outcome.covariance = last->covariance.block<3, 3>(estimate_error::position, estimate_error::position);
  return outcome;
}

constexpr double kScale = 1e-2;  // to which wheels are known that were measured

/// One of many: mounting and road are drawn from what the settings say of them.
Car some_car(std::uint64_t seed) {
  std::mt19937_64 rng{seed};
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 2.0 * M_PI);
  const PriorConfig prior;
  Car car;
  car.wheel_factor += kScale * normal(rng);
  car.mounting_pitch = prior.odometer_unseen * normal(rng);
  car.mounting_yaw = prior.odometer_unseen * normal(rng);
  for (double& p : car.phase) p = phase(rng);
  return car;
}

}  // namespace

TEST_CASE("swaying body: the covariance knows what wheels, mounting and road do") {
  constexpr int kCars = 40;
  FilterConfig measured;
  measured.prior.wheel_scale = kScale;
  double nees = 0.0, height_nees = 0.0, height = 0.0;
  for (std::uint64_t seed = 911; seed < 911 + kCars; ++seed) {
    const Outcome outcome = drive(some_car(seed), seed, measured);
    nees += outcome.nees() / kCars;
    height_nees += std::pow(outcome.error.z(), 2) / outcome.covariance(2, 2) / kCars;
    height += std::pow(outcome.error.z(), 2) / kCars;
  }
  MESSAGE("NEES of the position ", nees, ", of the height ", height_nees, ", which is off by ", std::sqrt(height));
  CHECK(nees < 4.3);  // 99.9 % of the means of forty with three degrees of freedom
  CHECK(nees > 0.5);
  CHECK(height_nees < 1.8);  // the same with one
}

TEST_CASE("swaying body: the wheels stay as large as the calibration says, and a wrong scale scales the way") {
  Car car = some_car(931);
  car.wheel_factor = 1.0;
  const Outcome right = drive(car, 932);
  CHECK(right.radius == doctest::Approx(kRadius).epsilon(1e-6));
  CHECK(std::abs(right.position.norm() / (Car::distance(kDuration) - Car::distance(0.0)) - 1.0) < 3e-3);

  car.wheel_factor = 1.01;
  const Outcome larger = drive(car, 932);
  CHECK(larger.radius == doctest::Approx(kRadius).epsilon(1e-6));
  CHECK(larger.position.norm() / right.position.norm() == about(1.0 / 1.01, 1e-3));

  FilterConfig sure;
  sure.prior.wheel_scale = 0.0;
  car.wheel_factor = 1.0;
  const Eigen::Matrix3d scale = right.covariance - drive(car, 932, sure).covariance;
  const double prior = FilterConfig{}.prior.wheel_scale;
  CHECK((scale - prior * prior * right.position * right.position.transpose()).norm() < 1e-6 * scale.norm());
}

TEST_CASE("swaying body: an engine that shakes a car that stands shows nothing of the wheels' mounting") {
  std::mt19937_64 rng{941};
  std::normal_distribution<double> normal;
  Calibration calibration;
  calibration.imu.gyro_noise = 1e-3;
  calibration.imu.accel_noise = 3e-2;
  EncoderCalibration& axle = calibration.encoder.emplace();
  axle.wheel_radius = {0.29, 0.29};
  axle.track_width = 1.45;
  axle.T_BO.translation() = Eigen::Vector3d(-1.3, 0.0, -0.5);
  const Pose given = odometer_state(calibration).T_BO;
  const FilterConfig config;
  Filter filter(config, calibration);

  // Mostly up and forward, and never the same at two samples; the body turns with it, the wheels do not.
  const Eigen::Vector3d along = Eigen::Vector3d(0.6, 0.2, 0.8).normalized();
  for (int k = 0; k <= 6000; ++k) {
    const double t = k * kImuStep;
    const Eigen::Vector3d accel = Eigen::Vector3d(0.0, 0.0, 9.81) + 0.8 * normal(rng) * along + random_vector(rng, 0.2);
    filter.add_imu({stamp(t), random_vector(rng, 0.02), accel});
    filter.add_encoder({stamp(t), 0, 0});
    if (k % 5 == 0) filter.process_without_image(stamp(t));
  }
  REQUIRE(filter.ekf().running());
  const auto& learned = filter.ekf().state().odometer.T_BO;
  const auto variance = [&](int entry) { return filter.ekf().covariance().matrix().diagonal().segment<3>(entry); };
  const double turned = log_so3(given.R.transpose() * learned.R).norm();
  const double moved = (learned.p - given.p).norm();
  CAPTURE(turned);
  CAPTURE(moved);
  CHECK(turned < 0.1 * config.prior.odometer_unseen);
  CHECK(moved < 0.1 * config.prior.axle_unseen);
  CHECK(std::sqrt(variance(err::odometer).minCoeff()) > 0.95 * config.prior.odometer_unseen);
  CHECK(std::sqrt(variance(err::axle).minCoeff()) > 0.95 * config.prior.axle_unseen);
}
