// The state that is carried on sample by sample, against a motion that is known.
#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <thread>

#include "src/live_state.h"

namespace ear {
namespace {

constexpr TimeNs kPeriod = 5'000'000;
constexpr double kRate = 0.7;   // [rad/s] about z
constexpr double kSpeed = 1.3;  // [m/s]
constexpr double kGravity = 9.81;
constexpr std::size_t kSamples = 100;

/// Along a circle at constant speed.
NavState truth_at(TimeNs t_ns) {
  const double yaw = kRate * 1e-9 * static_cast<double>(t_ns);
  NavState state;
  state.t_ns = t_ns;
  state.q_WB = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  state.v_W = kSpeed * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0);
  state.p_WB = kSpeed / kRate * Eigen::Vector3d(std::sin(yaw), 1.0 - std::cos(yaw), 0.0);
  state.b_g = {0.01, -0.02, 0.03};
  state.b_a = {0.1, 0.2, -0.3};
  return state;
}

ImuSample sample_at(TimeNs t_ns) {
  const NavState truth = truth_at(t_ns);
  return {t_ns, Eigen::Vector3d(0.0, 0.0, kRate) + truth.b_g,
          Eigen::Vector3d(0.0, kSpeed * kRate, kGravity) + truth.b_a};
}

void check(const std::optional<NavState>& state, TimeNs t_ns) {
  REQUIRE(state);
  const NavState truth = truth_at(t_ns);
  CHECK(state->t_ns == t_ns);
  CHECK((state->p_WB - truth.p_WB).norm() < 1e-3);
  CHECK((state->v_W - truth.v_W).norm() < 1e-3);
  CHECK(state->q_WB.angularDistance(truth.q_WB) < 1e-6);
  CHECK(state->b_g == truth.b_g);
}

TEST_CASE("live state: nothing before a state was set; then at every sample, however late it was set") {
  LiveState live(kSamples);
  for (int i = 0; i <= 50; ++i) {
    live.add(sample_at(i * kPeriod));
    CHECK_FALSE(live.state());
  }
  live.set(truth_at(10 * kPeriod), 10 * kPeriod);  // 40 samples ago
  for (int i = 51; i < 200; ++i) {
    live.add(sample_at(i * kPeriod));
    check(live.state(), i * kPeriod);
  }
}

TEST_CASE("live state: the newest state that was set counts") {
  LiveState live(kSamples);
  NavState wrong = truth_at(0);
  wrong.p_WB.x() += 5.0;
  live.add(sample_at(0));
  live.set(wrong, 0);
  live.add(sample_at(kPeriod));
  CHECK(live.state()->p_WB.x() > 4.0);
  live.set(wrong, 0);
  live.set(truth_at(kPeriod), kPeriod);
  live.add(sample_at(2 * kPeriod));
  check(live.state(), 2 * kPeriod);
  live.set(std::nullopt, 0);
  live.add(sample_at(3 * kPeriod));
  CHECK_FALSE(live.state());
}

TEST_CASE("live state: one older than all samples is not used, and none lasts for ever") {
  LiveState live(kSamples);
  live.set(truth_at(0), 0);
  for (int i = 10; i < 20; ++i) live.add(sample_at(i * kPeriod));
  CHECK_FALSE(live.state());
  live.set(truth_at(15 * kPeriod), 15 * kPeriod);
  int last = 0;
  for (int i = 20; i < 1000; ++i) {
    live.add(sample_at(i * kPeriod));
    if (live.state()) last = i;
  }
  CHECK(last == 15 + static_cast<int>(LiveState::kLongest / 5e-3));
}

TEST_CASE("live state: samples that cannot be change nothing; stamps that jump wait for the estimator") {
  LiveState live(kSamples);
  live.add(sample_at(0));
  live.set(truth_at(0), 0);
  live.add(sample_at(kPeriod));
  ImuSample bad = sample_at(2 * kPeriod);
  bad.gyro_B.x() = std::numeric_limits<double>::quiet_NaN();
  live.add(bad);
  live.add(sample_at(kPeriod));
  bad = sample_at(0);
  bad.t_ns = std::numeric_limits<TimeNs>::max();
  live.add(bad);
  live.add(sample_at(2 * kPeriod));
  check(live.state(), 2 * kPeriod);

  ImuSample jumped = sample_at(3 * kPeriod);
  jumped.t_ns -= 1'000'000'000;
  live.add(jumped);
  CHECK_FALSE(live.state());
  live.set(truth_at(3 * kPeriod), jumped.t_ns);  // the estimator's time goes on
  ImuSample next = sample_at(4 * kPeriod);
  next.t_ns -= 1'000'000'000;
  live.add(next);
  check(live.state(), 4 * kPeriod);
}

TEST_CASE("live state: two threads") {
  constexpr int kEnd = 20000;
  LiveState live(kSamples);
  std::atomic<int> added{-1};
  std::atomic<int> set_at{-1};
  std::thread estimator([&] {
    while (set_at < kEnd - 1) {
      const int newest = added;
      if (newest == set_at) {
        std::this_thread::yield();
        continue;
      }
      live.set(truth_at(newest * kPeriod), newest * kPeriod);
      set_at = newest;
    }
  });
  int wrong = 0, known = 0;
  for (int i = 0; i < kEnd; ++i) {
    while (i - set_at > static_cast<int>(kSamples) / 2) std::this_thread::yield();
    live.add(sample_at(i * kPeriod));
    added = i;
    const std::optional<NavState> state = live.state();
    if (!state) continue;
    ++known;
    const NavState truth = truth_at(i * kPeriod);
    wrong += state->t_ns != i * kPeriod || (state->p_WB - truth.p_WB).norm() > 1e-3 ? 1 : 0;
  }
  estimator.join();
  CHECK(wrong == 0);
  CHECK(known > kEnd / 2);
}

}  // namespace
}  // namespace ear
