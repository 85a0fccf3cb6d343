#include "filter/sources/clock_excess.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "filter/ingest/limits.h"
#include "tests/support/turning_rig.h"

using namespace ear;

namespace {

ClockExcess seen(TurningRig& rig, int frames) {
  ClockExcess excess;
  for (int i = 0; i < frames; ++i) excess.add(rig.next());
  return excess;
}

/// What is found, and after how many frames; 0 if nothing is.
struct Found {
  double off = 0.0;
  int frames = 0;
};

Found find(TurningRig rig, int frames, double known = 4e-6) {
  ClockExcess excess;
  for (int i = 1; i <= frames; ++i) {
    excess.add(rig.next());
    const double off = excess.take(known);
    if (off > 0.0) return {off, i};
  }
  return {};
}

}  // namespace

TEST_CASE("clock excess: the offset is by how much later the images are, to within its variance") {
  for (const double late : {0.0, 0.03, -0.03}) {
    CAPTURE(late);
    double mean = 0.0, squares = 0.0;
    constexpr int kRuns = 400;
    for (unsigned seed = 0; seed < kRuns; ++seed) {
      TurningRig rig(seed);
      rig.late = late;
      rig.axes = 0.05 * Eigen::Matrix3d::Random();
      rig.bias = {0.1, -0.2, 0.3};
      const auto offset = seen(rig, 90).offset();
      REQUIRE(offset);
      mean += offset->value / kRuns;
      squares += std::pow(offset->value - late, 2) / offset->variance / kRuns;
    }
    CHECK(std::abs(mean - late) < 1e-3);
    // White noise, of which what is older counts less: the variance is stated too large by up to two.
    CHECK(squares > 0.4);
    CHECK(squares < 1.2);
  }
}

TEST_CASE(
    "clock excess: a clock that is off is found in a few seconds, at other rates and with noise of any size too") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    for (const double dt : {1.0 / 30.0, 0.1}) {
      for (const double late : {0.06, -0.06}) {
        TurningRig rig(seed);
        rig.dt = dt;
        rig.late = late;
        const Found found = find(rig, static_cast<int>(4.0 / dt));
        CHECK(found.frames > 0);
        CHECK(std::abs(found.off - 0.06) < 0.03);
      }
    }
  }
}

TEST_CASE("clock excess: sound clocks, a bias, and sensors that point elsewhere are none") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    CHECK(find(TurningRig(seed), 3000).frames == 0);
    TurningRig noisy(seed);
    noisy.noise = 8.0;
    CHECK(find(noisy, 3000).frames == 0);
    TurningRig turned(seed);
    turned.bias = {0.5, -0.5, 0.5};
    turned.axes << 0.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.1;
    CHECK(find(turned, 3000).frames == 0);
    TurningRig still(seed);
    still.size = 0.0;
    still.late = 0.1;
    CHECK(find(still, 3000).frames == 0);  // nothing shows it
  }
}

TEST_CASE("clock excess: what the state does not know of the clock, and what no reading is late by, are none") {
  TurningRig late(3);
  late.late = 0.03;
  CHECK(find(late, 300).frames > 0);
  CHECK(find(late, 300, 0.01 * 0.01).frames == 0);
  late.late = 2.0 * kSilent;
  CHECK(find(late, 90).frames == 0);
}

TEST_CASE("clock excess: only frames that follow each other count, and what is no number is left out") {
  TurningRig rig(5);
  rig.late = 0.05;
  ClockExcess excess;
  for (int i = 0; i < 600; ++i) {
    const SeenTurn frame = rig.next();
    if (i % 3 != 2) excess.add(frame);  // of three, the last is always missing
  }
  CHECK_FALSE(excess.offset());
  TurningRig whole(5);
  whole.late = 0.05;
  ClockExcess other;
  for (int i = 0; i < 90; ++i) {
    SeenTurn frame = whole.next();
    if (i % 20 == 7) frame.beyond_B.y() = std::numeric_limits<double>::quiet_NaN();
    if (i % 20 == 13) frame.variance = 0.0;
    other.add(frame);
  }
  REQUIRE(other.offset());
  CHECK(std::abs(other.offset()->value - 0.05) < 0.02);
}
