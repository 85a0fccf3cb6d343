#include "src/rate_history.h"

#include <doctest/doctest.h>

using namespace ear;

namespace {

constexpr TimeNs kPeriod = 5'000'000;

/// A turn that speeds up: at sample k the rate is k rad/s.
RateHistory speeding_up(int samples) {
  RateHistory rates;
  for (int k = 0; k < samples; ++k) {
    rates.add({k * kPeriod, {0.0, 0.0, static_cast<double>(k)}, {0.0, 0.0, 9.81}});
  }
  return rates;
}

}  // namespace

TEST_CASE("rate history: an image that comes late has the rate of its exposure") {
  const RateHistory rates = speeding_up(200);
  CHECK(rates.gyro_B(100 * kPeriod).z() == doctest::Approx(100.0));
  CHECK(rates.gyro_B(100 * kPeriod + kPeriod / 4).z() == doctest::Approx(100.25));
  CHECK(rates.gyro_B(1000 * kPeriod).z() == doctest::Approx(199.0));  // the newest there is
}

TEST_CASE("rate history: what is long past is dropped, and a clock that jumps back begins anew") {
  RateHistory rates = speeding_up(1001);
  CHECK(rates.gyro_B(0).z() == doctest::Approx(600.0));  // 2 s of 5 s are kept
  rates.add({kPeriod, {0.0, 0.0, -1.0}, {0.0, 0.0, 9.81}});
  CHECK(rates.gyro_B(900 * kPeriod).z() == doctest::Approx(-1.0));
  CHECK(RateHistory().gyro_B(0).isZero());
}
