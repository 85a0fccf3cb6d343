#include "src/live/stream_watch.h"
#include "tests/support/about.h"

#include <doctest/doctest.h>

using namespace ear;
using namespace ear::live;
using ear::test::about;

namespace {

constexpr TimeNs kMs = 1'000'000;

/// Samples at a rate from `begin` to `end` [ms], stamped `offset` [ms] away from when they come; what is said
/// meanwhile.
std::vector<std::string> feed(StreamWatch& watch, TimeNs begin, TimeNs end, double rate_hz, TimeNs offset = 0) {
  std::vector<std::string> said;
  double next = static_cast<double>(begin);
  for (TimeNs t = begin; t < end; ++t) {
    for (; rate_hz > 0.0 && next <= static_cast<double>(t); next += 1e3 / rate_hz) {
      watch.note((t + offset) * kMs, t * kMs);
    }
    if (t % 200 != 0) continue;
    for (std::string& words : watch.look(t * kMs)) said.push_back(std::move(words));
  }
  return said;
}

bool contains(const std::vector<std::string>& said, const std::string& words) {
  for (const std::string& text : said) {
    if (text.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("stream watch: nothing is said of a stream that is as it should be") {
  StreamWatch watch("imu", 200.0, 0);
  CHECK(feed(watch, 1, 5000, 200.0).empty());
  CHECK(watch.rate_hz() == about(200.0, 0.05));
}

TEST_CASE("stream watch: silence is said within a second, once, and so is its end") {
  StreamWatch watch("imu", 200.0, 0);
  const auto nothing = feed(watch, 1, 1000, 0.0);
  REQUIRE(nothing.size() == 1);
  CHECK(nothing[0] == "imu: nothing has come yet");
  CHECK(contains(feed(watch, 1000, 3000, 200.0), "imu: samples come"));
  const auto silent = feed(watch, 3000, 4000, 0.0);
  REQUIRE(silent.size() == 1);
  CHECK(contains(silent, "imu: silent for 0."));
  CHECK(feed(watch, 4000, 9000, 0.0).empty());
}

TEST_CASE("stream watch: a slow sensor is not silent between two samples") {
  StreamWatch watch("beams", 1.0, 0);
  CHECK(feed(watch, 1, 10000, 1.0).empty());
}

TEST_CASE("stream watch: a flood is said within a second, and when it is over") {
  StreamWatch watch("imu", 200.0, 0);
  feed(watch, 1, 2000, 200.0);
  CHECK(contains(feed(watch, 2000, 3000, 10000.0), "where the calibration says 200"));
  CHECK(contains(feed(watch, 3000, 5000, 200.0), "samples a second again"));
}

TEST_CASE("stream watch: too few samples") {
  StreamWatch watch("cameras", 30.0, 0);
  feed(watch, 1, 2000, 30.0);
  CHECK(contains(feed(watch, 2000, 4000, 10.0), "cameras: 10 samples a second, where the calibration says 30"));
}

TEST_CASE("stream watch: a clock that is set") {
  StreamWatch watch("imu", 200.0, 0);
  CHECK(feed(watch, 1, 2000, 200.0, 5000).empty());  // another origin is no step
  CHECK(contains(feed(watch, 2000, 3000, 200.0, 6000), "imu: its clock was set by +1.000 s"));
  CHECK(contains(feed(watch, 3000, 4000, 200.0, 5500), "imu: its clock was set by -0.500 s"));
}

TEST_CASE("stream watch: samples that waited are no clock that was set") {
  constexpr TimeNs kMs = 1'000'000;
  StreamWatch watch("imu", 200.0, 0);
  std::vector<std::string> words;
  for (TimeNs t_ns = 5 * kMs; t_ns < 4000 * kMs; t_ns += 5 * kMs) {
    const bool stalled = t_ns > 2000 * kMs && t_ns < 2400 * kMs;
    watch.note(t_ns, stalled ? 2400 * kMs : t_ns);
    if (t_ns % (200 * kMs) == 0 && !stalled) {
      for (std::string& text : watch.look(t_ns)) words.push_back(std::move(text));
    }
  }
  CHECK_FALSE(contains(words, "clock"));
}

TEST_CASE("stream watch: a clock that is set again and again does not fill the log") {
  StreamWatch watch("imu", 200.0, 0);
  std::size_t words = 0;
  std::string all;
  for (int second = 0; second < 40; ++second) {
    for (const std::string& text :
         feed(watch, 1000 * second + 1, 1000 * (second + 1), 200.0, second % 2 == 0 ? 0 : 3000)) {
      if (text.find("clock was set") == std::string::npos) continue;
      ++words;
      all += text;
    }
  }
  CHECK(words >= 6);
  CHECK(words <= 15);  // 39 steps
  CHECK(all.find("times before") != std::string::npos);
}
