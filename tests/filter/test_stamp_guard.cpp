// Which stamps are believed.
#include "filter/ingest/stamp_guard.h"

#include <doctest/doctest.h>

using namespace ear;

namespace {

constexpr TimeNs kPeriod = 5'000'000;
constexpr TimeNs kSecond = 1'000'000'000;

/// Feeds `count` regular stamps from `from_ns` on and returns how many were believed.
int believed(StampGuard& guard, TimeNs from_ns, int count) {
  int result = 0;
  for (int i = 0; i < count; ++i) {
    const Stamp stamp = guard.judge(from_ns + i * kPeriod);
    result += stamp == Stamp::not_later || stamp == Stamp::far_ahead ? 0 : 1;
  }
  return result;
}

}  // namespace

TEST_CASE("stamp guard: stamps in order are believed, duplicates and earlier ones are not") {
  StampGuard guard;
  CHECK(believed(guard, 0, 100) == 100);
  CHECK(guard.judge(99 * kPeriod) == Stamp::not_later);
  CHECK(guard.judge(50 * kPeriod) == Stamp::not_later);
  CHECK(guard.judge(100 * kPeriod) == Stamp::next);
}

TEST_CASE("stamp guard: one false stamp shuts out nothing that follows") {
  for (const TimeNs false_ns : {3600 * kSecond, kLargestStamp - 1, -kLargestStamp + 1, -3600 * kSecond}) {
    CAPTURE(false_ns);
    StampGuard guard;
    CHECK(believed(guard, 0, 100) == 100);
    CHECK(guard.judge(false_ns) == (false_ns > 0 ? Stamp::far_ahead : Stamp::not_later));
    CHECK(believed(guard, 100 * kPeriod, 100) == 100);
  }
}

TEST_CASE("stamp guard: a stream that returns is believed at its third sample") {
  StampGuard guard;
  CHECK(believed(guard, 0, 100) == 100);
  CHECK(guard.judge(10 * kSecond) == Stamp::far_ahead);
  CHECK(guard.judge(10 * kSecond + kPeriod) == Stamp::far_ahead);
  CHECK(guard.judge(10 * kSecond + 2 * kPeriod) == Stamp::next);
  CHECK(guard.judge(10 * kSecond + 3 * kPeriod) == Stamp::next);
}

TEST_CASE("stamp guard: a clock that was set back is believed after a second, a first stamp that was false too") {
  for (const TimeNs first_ns : {100 * kSecond, kLargestStamp - 1}) {
    StampGuard guard;
    CHECK(guard.judge(first_ns) == Stamp::next);
    for (int i = 0; i < 200; ++i) CHECK(guard.judge(i * kPeriod) == Stamp::not_later);
    CHECK(guard.judge(200 * kPeriod) == Stamp::set_back);
    CHECK(guard.judge(201 * kPeriod) == Stamp::next);
  }
}
