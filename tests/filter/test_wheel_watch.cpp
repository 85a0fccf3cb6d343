#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "filter/sources/ground/wheel_watch.h"

using namespace ear;

namespace {

constexpr TimeNs kPeriod = 10'000'000;
constexpr double kRadius = 0.075;

EncoderCalibration make_axle() {
  EncoderCalibration axle;
  axle.wheel_radius = {kRadius, kRadius};
  return axle;
}

/// Two wheels that turn alike, read at 100 Hz.
class Bench {
 public:
  /// The wheels turn at `rate`, the body at `pitch_rate` about the axle [rad/s], for one period.
  WheelWatch::Motion turn(double rate, double pitch_rate) {
    watch_.turn_body(0.01 * pitch_rate);
    angle_ += 0.01 * rate;
    t_ns_ += kPeriod;
    return watch_.add(*reader_.add(read()));
  }

  [[nodiscard]] EncoderSample read() {
    const double counts = angle_ / (2.0 * M_PI) * static_cast<double>(axle_.resolution);
    std::normal_distribution<double> noise(0.0, axle_.noise_counts);
    const auto wrapped = [&](double count) {
      const std::int64_t n = std::llround(count + noise(rng_)) % axle_.resolution;
      return n < 0 ? n + axle_.resolution : n;
    };
    return {t_ns_, wrapped(counts), wrapped(counts)};
  }

  Bench() { static_cast<void>(reader_.add(read())); }

 private:
  EncoderCalibration axle_ = make_axle();
  WheelWatch watch_{axle_};
  EncoderReader reader_{axle_};
  std::mt19937_64 rng_{3};
  double angle_ = 0.0;
  TimeNs t_ns_ = 0;
};

}  // namespace

TEST_CASE("wheel watch: the way is that of rolling, also backwards; a body that swings on standing wheels makes none") {
  Bench rolling, back, swinging;
  double way = 0.0, way_back = 0.0, way_swinging = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double pitch_rate = 2.0 * std::sin(0.1 * i);
    way += rolling.turn(8.0 - pitch_rate, pitch_rate).distance;
    way_back += back.turn(-8.0 - pitch_rate, pitch_rate).distance;
    way_swinging += swinging.turn(-pitch_rate, pitch_rate).distance;
  }
  CHECK(way == doctest::Approx(8.0 * kRadius).epsilon(0.01));
  CHECK(way_back == doctest::Approx(8.0 * kRadius).epsilon(0.01));
  CHECK(way_swinging < 0.001);
}

TEST_CASE("wheel watch: wheels that are spun up are driven") {
  Bench bench;
  for (int i = 0; i < 50; ++i) CHECK_FALSE(bench.turn(0.0, 0.0).driven);
  bool driven = false;
  for (int i = 0; i < 6; ++i) driven = bench.turn(2.0 * (i + 1), 0.0).driven || driven;  // to 0.9 m/s in 60 ms
  CHECK(driven);
}

TEST_CASE("wheel watch: free wheels are not, whether they follow the swinging body or the world") {
  Bench with_body, in_world;
  double rate = 12.0;
  for (int i = 0; i < 100; ++i) {  // settled: wheels at speed are no news
    with_body.turn(rate, 0.0);
    in_world.turn(rate, 0.0);
  }
  for (int i = 0; i < 300; ++i) {
    CAPTURE(i);
    rate *= 0.995;  // coasting with a time constant of 2 s
    const double pitch_rate = 3.0 * std::sin(0.08 * i);
    CHECK_FALSE(with_body.turn(rate, pitch_rate).driven);
    CHECK_FALSE(in_world.turn(rate - pitch_rate, pitch_rate).driven);
  }
}
