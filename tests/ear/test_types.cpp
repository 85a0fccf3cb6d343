// Differences of stamps from outside: right where they fit 64 bits, and the nearest number that fits where they do not.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "ear/types.h"

using namespace ear;

namespace {

constexpr TimeNs kMin = std::numeric_limits<TimeNs>::min();
constexpr TimeNs kMax = std::numeric_limits<TimeNs>::max();

/// In 128 bits, where no difference of stamps overflows.
TimeNs nearest(TimeNs from, TimeNs to) {
  __extension__ using Wide = __int128;
  return static_cast<TimeNs>(std::clamp(Wide{to} - Wide{from}, Wide{kMin}, Wide{kMax}));
}

}  // namespace

TEST_CASE("types: the difference of any two stamps, the nearest that fits where it does not fit") {
  constexpr std::array<TimeNs, 13> kStamps{kMin, kMin + 1,      kMin / 2 - 1, kMin / 2,     -1'000'000'000, -1,  0,
                                           1,    1'000'000'000, kMax / 2,     kMax / 2 + 1, kMax - 1,       kMax};
  for (const TimeNs from : kStamps) {
    for (const TimeNs to : kStamps) {
      CAPTURE(from);
      CAPTURE(to);
      CHECK(duration_ns(from, to) == nearest(from, to));
      CHECK(seconds_between(from, to) == 1e-9 * static_cast<double>(nearest(from, to)));
    }
  }
}

TEST_CASE("types: seconds have the sign of the difference, at the extremes too") {
  CHECK(seconds_between(2'000'000'000, 3'500'000'000) == 1.5);
  CHECK(seconds_between(3'500'000'000, 2'000'000'000) == -1.5);
  CHECK(seconds_between(-1'000'000'000, 1'000'000'000) == 2.0);
  CHECK(seconds_between(kMin, kMin) == 0.0);
  CHECK(seconds_between(kMax, kMax) == 0.0);
  CHECK(seconds_between(kMin, kMax) > 9e9);
  CHECK(seconds_between(kMax, kMin) < -9e9);
  CHECK(seconds_between(-1, kMax) > 9e9);
  CHECK(seconds_between(1, kMin) < -9e9);
}
