// Wheels and inertial sensors that are mounted as the calibration says, and not.
#include "filter/sources/wheels/mounting_watch.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <random>

using namespace ear;

namespace {

constexpr double kRadius = 0.1, kTrack = 0.4, kStep = 0.01;  // [m], [m], [s]

/// What is wrong, and how rough the drive is.
struct Rig {
  double mounted = 0.0;      ///< [rad] the inertial sensors turned about up, against what is stated
  double rolled_over = 1.0;  ///< -1: wheels that count backwards
  double yaw_sign = 1.0;     ///< -1: of the gyroscope
  bool exchanged = false;    ///< left and right wheel
  double slip = 0.0;         ///< share of the wheels' speed that does not move the vehicle
  double accel_noise = 0.3;  ///< [m/s^2] of a sample
  double rocking = 0.05;     ///< [rad] nose up and down, and to the sides
  bool straight = false;
  double gentle = 1.0;  ///< factor on its turns
  double jerk = 0.0;    ///< force ahead that seems to come with a force to the left, times that
};

double speed_at(double t) { return 0.4 + 0.3 * std::sin(0.9 * t); }                          // [m/s]
double yaw_rate_at(double t) { return 0.5 * std::sin(0.35 * t) + 0.2 * std::sin(1.3 * t); }  // [rad/s]

/// Drives by the formulas above. When the watch says so first [s]; INFINITY if it never does.
double contradicts_after(const Rig& rig, double duration, unsigned seed) {
  EncoderCalibration encoder;
  encoder.wheel_radius = {kRadius, kRadius};
  encoder.track_width = kTrack;
  MountingWatch watch({}, encoder);
  ImuBuffer imu(4096);
  std::mt19937_64 rng{seed};
  std::normal_distribution<double> normal;
  const Eigen::AngleAxisd mounting(-rig.mounted, Eigen::Vector3d::UnitZ());
  const auto ns = [](double t) { return static_cast<TimeNs>(std::llround(1e9 * t)); };
  const auto yaw_rate = [&](double t) { return rig.straight ? 0.0 : rig.gentle * yaw_rate_at(t); };
  double first = INFINITY;
  for (double t = 0.0; t < duration; t += kStep) {
    ImuSample sample;
    sample.t_ns = ns(t);
    const double pitch = rig.rocking * std::sin(2.0 * t),
                 pitch_rate = 2.0 * rig.rocking * std::cos(2.0 * t);  // nose down
    const double roll = rig.rocking * std::sin(3.0 * t),
                 roll_rate = 3.0 * rig.rocking * std::cos(3.0 * t);  // to the right
    const double ahead = (speed_at(t + 1e-3) - speed_at(t - 1e-3)) / 2e-3;
    const double left = speed_at(t) * yaw_rate(t);
    const Eigen::Vector3d force(ahead + rig.jerk * left - 9.81 * pitch, left + 9.81 * roll, 9.81);
    const Eigen::Vector3d noise(normal(rng), normal(rng), normal(rng));
    sample.accel_B = mounting * (force + rig.accel_noise * noise);
    sample.gyro_B = mounting * Eigen::Vector3d(roll_rate, pitch_rate, rig.yaw_sign * yaw_rate(t));
    imu.push(sample);
    if (t == 0.0) continue;
    const double speed = speed_at(t - 0.5 * kStep) / (1.0 - rig.slip), turn = 0.5 * kTrack * yaw_rate(t - 0.5 * kStep);
    WheelIncrement increment{ns(t - kStep), ns(t), kStep / kRadius * Eigen::Vector2d(speed - turn, speed + turn)};
    const double middle = t - 0.5 * kStep;
    increment.angle.array() -= kStep * 2.0 * rig.rocking * std::cos(2.0 * middle);  // of the body about the axle
    increment.angle *= rig.rolled_over;
    if (rig.exchanged) increment.angle.reverseInPlace();
    const Eigen::Vector3d up(-rig.rocking * std::sin(2.0 * middle), rig.rocking * std::sin(3.0 * middle), 1.0);
    watch.add(increment, imu, Eigen::Vector3d::Zero(), mounting * up);
    if (watch.contradicts() && first == INFINITY) first = t;
  }
  return first;
}

double degrees(double angle) { return angle * M_PI / 180.0; }

/// Of 20 drives with this rig, in how many the watch says so.
int found(const Rig& rig, double duration) {
  int drives = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) drives += contradicts_after(rig, duration, seed) < INFINITY ? 1 : 0;
  return drives;
}

}  // namespace

TEST_CASE("mounting: as stated, or nearly, is nothing to speak of, on rough ground and with slip either") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    CHECK(contradicts_after({}, 120.0, seed) == INFINITY);
    Rig off;
    off.mounted = degrees(seed % 2 == 0 ? 20.0 : -20.0);
    CHECK(contradicts_after(off, 120.0, seed) == INFINITY);
    Rig slips;
    slips.slip = 0.5;
    CHECK(contradicts_after(slips, 120.0, seed) == INFINITY);
    Rig noisy;
    noisy.accel_noise = 3.0;
    CHECK(contradicts_after(noisy, 120.0, seed) == INFINITY);
    Rig car;
    car.straight = true;
    CHECK(contradicts_after(car, 120.0, seed) == INFINITY);
  }
}

TEST_CASE("mounting: jerks ahead in turns that hardly change the velocity are no axes that are exchanged") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Rig jerks;
    jerks.gentle = 0.1;
    jerks.jerk = seed % 2 == 0 ? 9.0 : -9.0;
    CHECK(contradicts_after(jerks, 120.0, seed) == INFINITY);
  }
}

TEST_CASE("mounting: axes that are exchanged or reversed show within a minute or two") {
  for (const double angle : {90.0, -90.0, 180.0, 120.0}) {
    CAPTURE(angle);
    Rig turned;
    turned.mounted = degrees(angle);
    CHECK(found(turned, 120.0) >= 17);  // 98 in 100 or more
    turned.straight = true;
    CHECK(found(turned, 60.0) >= 17);
  }
  Rig backwards;
  backwards.rolled_over = -1.0;
  CHECK(found(backwards, 60.0) >= 17);
  Rig mirrored;
  mirrored.yaw_sign = -1.0;
  CHECK(found(mirrored, 60.0) >= 17);
  Rig exchanged;
  exchanged.exchanged = true;
  CHECK(found(exchanged, 60.0) >= 17);
}
