#include "filter/sources/wheels/speed_change.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "filter/sources/wheels/wheels.h"
#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

constexpr TimeNs kStart = 1'000'000'000;
constexpr double kPeriod = 0.01;  // [s] of the encoders
constexpr double kPrior = 0.01;   // [s]
constexpr double kRadius = 0.1;
constexpr double kReading = 2e-4;  // [rad]

TimeNs at(double t) { return kStart + static_cast<TimeNs>(std::llround(1e9 * t)); }

WheelIncrement increment(int i) { return {at(kPeriod * i), at(kPeriod * (i + 1)), {}}; }

/// A vehicle that drives straight on; v(t) and its derivative.
struct Motion {
  double mean = 0.0, swing = 0.0;  // [m/s]
  [[nodiscard]] double path(double t) const { return mean * t - swing * std::cos(2.0 * t) / 2.0; }
  [[nodiscard]] double speed(double t) const { return mean + swing * std::sin(2.0 * t); }
  [[nodiscard]] double accel(double t) const { return 2.0 * swing * std::cos(2.0 * t); }
};

struct Found {
  double offset = 0.0, sigma = 0.0;  // [s]
};

/// What a filter that knows all but the encoders' clock has found of it after 20 s, readings stamped `late` [s].
Found found(const Motion& motion, double late) {
  Calibration calibration;
  calibration.encoder.emplace();
  calibration.encoder->wheel_radius = {kRadius, kRadius};
  calibration.encoder->rate_hz = 1.0 / kPeriod;
  calibration.encoder->noise_counts = kReading / (2.0 * M_PI) * static_cast<double>(calibration.encoder->resolution);
  Ekf ekf(FilterConfig{}, calibration);
  ImuState x;
  x.t_ns = kStart;
  x.v_W.x() = motion.speed(0.0);
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(err::clones, 1e-9);
  sigma(err::encoder_offset) = kPrior;
  ekf.start(x, sigma);

  ImuBuffer imu(8192);
  for (double t = -0.1; t < 20.0; t += 0.005) {
    imu.push({at(t), Eigen::Vector3d::Zero(), {motion.accel(t), 0.0, 9.81}});
  }
  Wheels wheels(OdometerConfig{}, calibration, false);
  Records records;
  std::mt19937_64 rng{5};
  std::normal_distribution<double> noise(0.0, kReading);
  double before = 0.0;
  for (double t = 0.2; t < 19.9; t += kPeriod) {
    const double reading = motion.path(t) / kRadius + noise(rng);
    const WheelIncrement stamped{at(t - kPeriod + late), at(t + late), Eigen::Vector2d::Constant(reading - before)};
    before = reading;
    if (t < 0.2 + kPeriod) continue;
    ekf.propagate(imu, middle_of(later_by(ekf.state().odometer.time_offset, stamped)), {}, 0.0);
    wheels.update(stamped, {imu}, ekf, records);
  }
  return {ekf.state().odometer.time_offset,
          std::sqrt(ekf.covariance().matrix()(err::encoder_offset, err::encoder_offset))};
}

}  // namespace

TEST_CASE("speed change: that of a speed that grows evenly, and none of one that is constant or uncertain") {
  SpeedChange change;
  double last = 0.0;
  for (int i = 0; i < 500; ++i) last = change.add(0.5 + 0.8 * kPeriod * i, 1e-3, increment(i));
  CHECK(last == about(0.8, 0.03));
  for (int i = 500; i < 1000; ++i) last = change.add(4.5, 1e-3, increment(i));
  CHECK(last == 0.0);

  SpeedChange uncertain;
  for (int i = 0; i < 500; ++i) last = uncertain.add(0.5 + 0.8 * kPeriod * i, 0.2, increment(i));
  CHECK(last == 0.0);
}

TEST_CASE("speed change: nothing is known of it across a gap, as while a vehicle flies") {
  SpeedChange change;
  for (int i = 0; i < 100; ++i) change.add(0.5, 1e-3, increment(i));
  for (int i = 300; i < 310; ++i) CHECK(change.add(1.5, 1e-3, increment(i)) == 0.0);
}

TEST_CASE("speed change: readings that are stamped late, or early, show by how much") {
  for (const double late : {0.0, 0.01, 0.03, -0.02}) {
    CAPTURE(late);
    const Found result = found({0.6, 0.5}, late);
    CHECK(result.sigma < 0.3 * kPrior);  // wheels slip by more than these do
    const double the_prior_keeps = late * std::pow(result.sigma / kPrior, 2);
    CHECK(std::abs(result.offset + late - the_prior_keeps) < 1e-3);
  }
}

TEST_CASE("speed change: at a constant speed, or at rest, they show nothing of it") {
  for (const double speed : {0.0, 0.6}) {
    CAPTURE(speed);
    const Found result = found({speed, 0.0}, 0.02);
    CHECK(result.offset == 0.0);
    CHECK(result.sigma == about(kPrior, 1e-9));
  }
}
