#include "filter/sources/wheels/wheel_agreement.h"

#include <doctest/doctest.h>

#include <random>

using namespace ear;

namespace {

constexpr TimeNs kStep = 10'000'000;

/// Readings of two wheels with the gyroscope's noise, every 10 ms.
class Axle {
 public:
  void roll(double duration, double difference, double growth = 0.0) {
    std::normal_distribution<double> noise(0.0, 0.004);
    const TimeNs end_ns = t_ns_ + static_cast<TimeNs>(1e9 * duration);
    while (t_ns_ < end_ns) {
      t_ns_ += kStep;
      difference += growth * 0.01;
      wheels.add(difference + noise(rng_), sigma, t_ns_);
      if (!wheels.agree() && first_contradiction_ns == 0) first_contradiction_ns = t_ns_;
    }
  }
  void pause(TimeNs duration_ns) { t_ns_ += duration_ns; }
  [[nodiscard]] TimeNs t_ns() const { return t_ns_; }

  WheelAgreement wheels;
  double sigma = 0.0;
  TimeNs first_contradiction_ns = 0;

 private:
  std::mt19937_64 rng_{41};
  TimeNs t_ns_ = 0;
};

}  // namespace

TEST_CASE("wheel agreement: noise, and what uneven ground does, is no contradiction") {
  Axle axle;
  axle.roll(600.0, 0.0);
  axle.roll(60.0, 0.012);
  CHECK(axle.first_contradiction_ns == 0);
}

TEST_CASE("wheel agreement: a wheel that stops is noticed at once, one that coasts within 0.15 s") {
  Axle stops;
  stops.roll(1.0, 0.0);
  stops.roll(0.5, 0.7);
  CHECK(stops.first_contradiction_ns == 1'000'000'000 + kStep);
  Axle coasts;
  coasts.roll(1.0, 0.0);
  coasts.roll(0.5, 0.0, 0.35);
  REQUIRE(coasts.first_contradiction_ns > 0);
  CHECK(coasts.first_contradiction_ns < 1'150'000'000);
}

TEST_CASE("wheel agreement: the difference that unknown radii or an unknown bias make is none") {
  Axle axle;
  axle.sigma = 0.04;
  axle.roll(10.0, 0.1);
  CHECK(axle.wheels.agree());
  axle.sigma = 0.01;
  axle.roll(0.1, 0.1);
  CHECK_FALSE(axle.wheels.agree());
}

TEST_CASE("wheel agreement: it returns after 0.15 s, not while the difference passes zero") {
  Axle axle;
  axle.roll(1.0, 0.2);
  axle.roll(0.5, 0.2, -0.8);  // from 0.2 to -0.2 m/s
  CHECK_FALSE(axle.wheels.agree());
  axle.roll(0.2, 0.0);
  CHECK_FALSE(axle.wheels.agree());
  axle.roll(0.3, 0.0);
  CHECK(axle.wheels.agree());
}

TEST_CASE("wheel agreement: what was before a flight does not count") {
  Axle axle;
  axle.roll(1.0, 0.2);
  axle.pause(2'000'000'000);
  axle.roll(0.02, 0.0);
  CHECK(axle.wheels.agree());
}
