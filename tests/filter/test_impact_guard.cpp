#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "filter/ingest/impact_guard.h"

using namespace ear;

namespace {

constexpr double kGravity = 9.81;
constexpr double kRate = 200.0;

ImuCalibration make_imu() {
  ImuCalibration imu;
  imu.rate_hz = kRate;
  return imu;
}

const double kAccelSigma = make_imu().accel_noise * std::sqrt(kRate);  // of a sample [m/s^2]

/// A hovering body's IMU, to which something is added.
class Stream {
 public:
  explicit Stream(const ImpactConfig& config = {}) : guard_(config) {}

  ImuSample sample(const Eigen::Vector3d& force_B, double vibration = 0.0) {
    t_ns_ += static_cast<TimeNs>(1e9 / kRate);
    const double spread = std::hypot(kAccelSigma, vibration);
    return {t_ns_, random(0.014), random(spread) + Eigen::Vector3d(0.0, 0.0, kGravity) + force_B};
  }
  ImuNoiseFactors add(const ImuSample& s) { return guard_.add(s, SampleSigma(make_imu(), 1.0 / kRate)); }
  ImuNoiseFactors add(double upwards, double vibration = 0.0) { return add(sample({0.0, 0.0, upwards}, vibration)); }

 private:
  Eigen::Vector3d random(double sigma) {
    std::normal_distribution<double> normal(0.0, sigma);
    const double x = normal(rng_), y = normal(rng_), z = normal(rng_);
    return {x, y, z};
  }

  ImpactGuard guard_;
  std::mt19937_64 rng_{17};
  TimeNs t_ns_ = 0;
};

double clip(double value, double limit) { return std::clamp(value, -limit, limit); }

}  // namespace

TEST_CASE("impact: ordinary samples keep their noise, also under the strongest vibration that standing allows") {
  Stream stream;
  for (int i = 0; i < 200; ++i) CHECK(stream.add(0.0).accel == 1.0);
  for (int i = 0; i < 100; ++i) stream.add(0.0, 0.03 * i);  // the rotors start
  for (int i = 0; i < 20000; ++i) {
    const ImuNoiseFactors factors = stream.add(0.0, 3.0);
    CHECK(factors.accel == 1.0);
    CHECK(factors.gyro == 1.0);
  }
}

TEST_CASE("impact: a strike counts while it lasts, not a sample longer, and leaves the gyroscope alone") {
  Stream stream;
  for (int i = 0; i < 400; ++i) stream.add(0.0);
  for (int i = 1; i < 6; ++i) {  // half a sine of 30 ms
    const ImuNoiseFactors factors = stream.add(45.0 * std::sin(M_PI * i / 6.0));
    CHECK(factors.accel > 15.0);
    CHECK(factors.gyro == 1.0);
  }
  for (int i = 0; i < 100; ++i) CHECK(stream.add(0.0).accel == 1.0);
}

TEST_CASE("impact: a change that lasts is no strike any more once the mean has followed it, after 0.4 s") {
  Stream stream;
  for (int i = 0; i < 400; ++i) stream.add(0.0);
  CHECK(stream.add(25.0).accel > 10.0);
  for (int i = 0; i < 82; ++i) stream.add(25.0);
  for (int i = 0; i < 100; ++i) CHECK(stream.add(25.0).accel == 1.0);
}

TEST_CASE("impact: a spike of the gyroscope is one of the gyroscope") {
  Stream stream;
  for (int i = 0; i < 400; ++i) stream.add(0.0);
  ImuSample spike = stream.sample(Eigen::Vector3d::Zero());
  spike.gyro_B.x() += 6.0;
  const ImuNoiseFactors factors = stream.add(spike);
  CHECK(factors.gyro > 40.0);
  CHECK(factors.accel == 1.0);
}

TEST_CASE("impact: many strikes do not make a strike ordinary") {
  Stream stream;
  for (int i = 0; i < 100; ++i) stream.add(0.0);
  const double gyro_sigma = make_imu().gyro_noise * std::sqrt(kRate);
  for (int jolt = 0; jolt < 40; ++jolt) {
    for (int i = 0; i < 3; ++i) {
      ImuSample sample = stream.sample(Eigen::Vector3d::Zero());
      sample.gyro_B.x() += i == 0 ? 8.7 : -8.7 + 0.01 * i;
      CHECK(stream.add(sample).gyro * gyro_sigma > 7.0);
    }
    for (int i = 0; i < 12; ++i) stream.add(0.0);
  }
}

TEST_CASE("impact: a flat top is clipped; once seen, its level is known") {
  const double limit = 4.0 * kGravity;
  Stream stream;
  for (int i = 0; i < 400; ++i) stream.add(0.0);
  const auto strike = [&] {
    std::vector<double> factors;
    for (int i = 0; i < 3; ++i) {
      ImuSample s = stream.sample({0.0, 0.0, 60.0});
      s.accel_B.z() = clip(s.accel_B.z(), limit);
      factors.push_back(stream.add(s).accel);
    }
    return factors;
  };
  const std::vector<double> first = strike();
  const double whole = (limit - kGravity) / kAccelSigma;  // all of the deviation may be wrong
  CHECK(first[0] < 0.5 * whole);
  CHECK(first[1] > 0.8 * whole);
  for (int i = 0; i < 400; ++i) CHECK(stream.add(0.0).accel == 1.0);
  CHECK(strike()[0] > 0.8 * whole);
  // A larger value: that level was no limit.
  CHECK(stream.add(50.0).accel < 0.5 * (50.0 / kAccelSigma));
}

TEST_CASE("impact: with a known range the first clipped sample counts in full") {
  ImpactConfig config;
  config.accel_range = 4.0 * kGravity;
  Stream stream(config);
  for (int i = 0; i < 400; ++i) stream.add(0.0);
  ImuSample s = stream.sample({0.0, 0.0, 60.0});
  s.accel_B.z() = config.accel_range;
  CHECK(stream.add(s).accel > 0.8 * (config.accel_range - kGravity) / kAccelSigma);
}

TEST_CASE("impact: the raised noise covers what clipping takes from the velocity") {
  const double limit = 4.0 * kGravity;
  std::mt19937_64 rng(23);
  std::uniform_real_distribution<double> peak(20.0, 70.0), width(0.01, 0.05);
  Stream stream;
  int covered = 0;
  constexpr int kStrikes = 500;
  for (int strike = 0; strike < kStrikes; ++strike) {
    for (int i = 0; i < 200; ++i) stream.add(0.0);
    const double height = peak(rng), duration = width(rng);
    double error = 0.0, variance = 0.0;
    for (double t = 0.0025; t < duration; t += 1.0 / kRate) {
      ImuSample s = stream.sample({0.0, 0.0, height * std::sin(M_PI * t / duration)});
      const double whole = s.accel_B.z();
      s.accel_B.z() = clip(whole, limit);
      error += (whole - s.accel_B.z()) / kRate;
      variance += std::pow(stream.add(s).accel * kAccelSigma / kRate, 2);
    }
    covered += std::abs(error) < 2.0 * std::sqrt(variance) ? 1 : 0;
  }
  CHECK(covered > 0.95 * kStrikes);
}
