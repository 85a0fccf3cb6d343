// Load that is shed when frames cost more than they may. What frames cost is told, not measured.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include "ear/odometry.h"
#include "src/load_governor.h"
#include "src/queued_odometry.h"
#include "tools/experiments/sample_feed.h"
#include "tools/simulator/film.h"
#include "tools/simulator/simulation.h"

namespace ear {
namespace {

constexpr LoadLimits kFull{150, 12, 1, 1};

/// Stamps of frames at a constant rate.
class Stamps {
 public:
  explicit Stamps(double rate_hz) : interval_ns_(std::llround(1e9 / rate_hz)) {}
  TimeNs next() { return now_ns_ += interval_ns_; }

 private:
  TimeNs interval_ns_;
  TimeNs now_ns_ = 0;
};

/// Feeds frames whose cost is that of all work times `share(step)`; the steps at which it changed.
template <typename Share>
std::vector<int> steps(LoadGovernor& load, Stamps& stamps, int frames, double cost, const Share& share) {
  std::vector<int> visited{load.step()};
  for (int i = 0; i < frames; ++i) {
    load.add(cost * share(load.step()), stamps.next());
    if (load.step() != visited.back()) visited.push_back(load.step());
  }
  return visited;
}

TEST_CASE("load: without a budget, or within it, nothing is left out") {
  Stamps stamps(30.0);
  LoadGovernor unlimited(0.0, kFull);
  CHECK(steps(unlimited, stamps, 1000, 10.0, [](int) { return 1.0; }) == std::vector<int>{0});
  LoadGovernor easy(0.010, kFull);
  CHECK(steps(easy, stamps, 1000, 0.009, [](int) { return 1.0; }) == std::vector<int>{0});
  const LoadLimits limits = easy.limits();
  CHECK(limits.max_features == 150);
  CHECK(limits.window == 12);
  CHECK(limits.stereo_every == 1);
  CHECK(limits.frame_every == 1);
}

TEST_CASE("load: steps come in order, and each leaves no more work than the one before") {
  Stamps stamps(30.0);
  LoadGovernor load(0.010, kFull);
  LoadLimits before = load.limits();
  for (int step = 1; step <= LoadGovernor::kLastStep; ++step) {
    CAPTURE(step);
    for (int i = 0; i < 100 && load.step() < step; ++i) load.add(0.011, stamps.next());
    REQUIRE(load.step() == step);
    const LoadLimits now = load.limits();
    CHECK(now.max_features <= before.max_features);
    CHECK(now.window <= before.window);
    CHECK(now.stereo_every >= before.stereo_every);
    CHECK(now.frame_every >= before.frame_every);
    before = now;
  }
  CHECK(load.limits().window >= 3);
  CHECK(load.limits().max_features >= 1);
  CHECK(load.limits().frame_every == 4);
  load.add(0.1, stamps.next());
  CHECK(load.step() == LoadGovernor::kLastStep);
}

TEST_CASE("load: one slow frame is none") {
  Stamps stamps(30.0);
  LoadGovernor load(0.010, kFull);
  for (int i = 0; i < 800; ++i) load.add(i % 100 == 0 ? 0.030 : 0.005, stamps.next());
  CHECK(load.step() == 0);
}

TEST_CASE("load: frames that take very long are answered sooner") {
  Stamps stamps(30.0);
  LoadGovernor load(0.010, kFull);
  load.add(0.070, stamps.next());
  CHECK(load.step() == 0);
  load.add(0.070, stamps.next());
  CHECK(load.step() == 1);
  load.add(0.100, stamps.next());
  CHECK(load.step() == 2);
}

TEST_CASE("load: it comes back step by step when the cost falls, after the same time at every rate") {
  for (const double rate_hz : {5.0, 20.0, 30.0, 60.0}) {
    CAPTURE(rate_hz);
    Stamps stamps(rate_hz);
    LoadGovernor load(0.010, kFull);
    steps(load, stamps, 24, 0.011, [](int) { return 1.0; });
    REQUIRE(load.step() == 3);
    for (const int next : {2, 1, 0}) {
      int frames = 0;
      for (; load.step() != next && frames < 1000; ++frames) load.add(0.002, stamps.next());
      CHECK(frames / rate_hz > 1.5);
      CHECK(frames / rate_hz < 1.65 + 8.0 / rate_hz);  // frames are looked at by eights
    }
  }
}

TEST_CASE("load: at 30 Hz it waits for 48 frames") {
  Stamps stamps(30.0);
  LoadGovernor load(0.010, kFull);
  steps(load, stamps, 24, 0.011, [](int) { return 1.0; });
  REQUIRE(load.step() == 3);
  CHECK(steps(load, stamps, 47, 0.002, [](int) { return 1.0; }) == std::vector<int>{3});
  CHECK(steps(load, stamps, 1, 0.002, [](int) { return 1.0; }) == std::vector<int>{3, 2});
}

TEST_CASE("load: while no frames come, nothing shows that there is time for more") {
  LoadGovernor load(0.010, kFull);
  Stamps before(30.0);
  steps(load, before, 8, 0.011, [](int) { return 1.0; });
  REQUIRE(load.step() == 1);
  const TimeNs gap_ns = 10'000'000'000;
  TimeNs t_ns = 0;
  for (int i = 0; i < 8; ++i) {
    t_ns = before.next() + gap_ns;
    load.add(0.002, t_ns);
  }
  CHECK(load.step() == 1);
}

TEST_CASE("load: where a step is the right one, it is left less and less often") {
  Stamps stamps(30.0);
  LoadGovernor load(0.010, kFull);
  // Step 1 is well within the budget, all work is not.
  const auto share = [](int step) { return step == 0 ? 1.0 : 0.5; };
  const auto changes = [&](int frames) { return steps(load, stamps, frames, 0.011, share).size() - 1; };
  const std::size_t first = changes(2000);
  const std::size_t later = changes(2000);
  CHECK(first >= 3);
  CHECK(first <= 12);
  CHECK(later <= 4);
}

simulator::Options at_ten_hertz() {
  simulator::Options options;
  options.seed = 12;
  options.duration = 20.0;
  options.camera_rate_hz = 10.0;
  return options;
}

const simulator::Film& drive_with_pictures() {
  static const simulator::Film kDrive(at_ten_hertz());
  return kDrive;
}

TEST_CASE("load: slow frames are answered step by step; the output at the IMU's rate goes on; and back again") {
  const simulator::Film& drive = drive_with_pictures();
  Config config;
  config.performance.budget_ms = 10.0;
  double cost = 1e-3;  // [s] of each frame that is used
  double now = 0.0;
  bool running = false;
  const Clock clock = [&] {  // asked before and after a frame
    if (running) now += cost;
    running = !running;
    return now;
  };
  Odometry odometry(config, drive.simulation.calibration(), clock);

  int used_when_slow = 0, frames_when_slow = 0, without_right = 0;
  int largest_step = 0;
  int last_step = 0;
  bool predicted = true;
  bool started = false;
  const TimeNs first_ns = drive.simulation.frame_times().front();
  for (const simulator::Delivery& delivery : drive.simulation.deliveries()) {
    experiments::hand_over(drive.simulation, delivery, odometry);
    if (delivery.stream == simulator::SensorStream::imu && started) {
      predicted = predicted && odometry.predict(drive.simulation.imu()[delivery.index].t_ns).has_value();
    }
    if (delivery.stream != simulator::SensorStream::camera) continue;
    const StereoFrame frame = drive.frame(delivery.index);
    const double t = seconds_between(first_ns, frame.t_ns);
    const bool slow = t > 3.0 && t < 12.0;
    cost = slow ? 60e-3 : 1e-3;
    const std::optional<Estimate> estimate = odometry.add_stereo(frame);
    started = started || estimate.has_value();
    const Health health = odometry.health();
    CHECK(std::abs(health.load_step - last_step) <= 1);
    if (slow) CHECK(health.load_step >= last_step);
    last_step = health.load_step;
    largest_step = std::max(largest_step, last_step);
    if (started) CHECK((health.status == HealthStatus::tracking || health.status == HealthStatus::degraded));
    if (t > 9.5 && slow) {  // all steps were taken
      ++frames_when_slow;
      used_when_slow += estimate.has_value() ? 1 : 0;
      if (estimate) {
        CHECK(estimate->health.load_step == LoadGovernor::kLastStep);
        CHECK(estimate->frame.tracks <= 75);
        CHECK(estimate->frame.clones <= 8);
        without_right += estimate->frame.stereo == 0 ? 1 : 0;
      }
    }
    if (t > 2.0 && t < 3.0) {
      REQUIRE(estimate);
      CHECK(estimate->health.load_step == 0);
    }
  }
  CHECK(predicted);
  CHECK(largest_step == LoadGovernor::kLastStep);
  CHECK(used_when_slow >= 3);
  CHECK(used_when_slow <= frames_when_slow / 4 + 1);
  CHECK(without_right >= 1);
  CHECK(last_step < largest_step);  // on the way back
  CHECK(odometry.input_counts().camera.accepted == drive.simulation.frames().size());
}

TEST_CASE("load: frames that always take too long stop no output, fill no queue and lose no inertial sample") {
  const simulator::Film& drive = drive_with_pictures();
  const simulator::Simulation& simulation = drive.simulation;
  constexpr double kCost = 0.7;  // [s] of a frame that is used; they come every 0.1 s
  constexpr double kSlowFrom = 3.0;
  Config config;
  config.performance.budget_ms = 30.0;
  double cost = 1e-3;
  double now = 0.0;
  bool running = false;
  const Clock clock = [&] {
    if (running) now += cost;
    running = !running;
    return now;
  };
  const QueueCapacity capacity;
  QueuedOdometry odometry(config, simulation.calibration(), capacity, clock);

  const TimeNs first_ns = simulation.frame_times().front();
  double free_at = 0.0;  // [s] when the estimator's thread is done with its frame
  double last_estimate = 0.0, longest_pause = 0.0, largest_delay = 0.0, largest_error = 0.0;
  int missing = 0, present = 0;
  bool started = false;
  Eigen::Isometry3d T_truth = Eigen::Isometry3d::Identity();  // from the estimator's world to the simulation's
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    const double t = seconds_between(first_ns, delivery.arrival_ns);
    if (delivery.stream == simulator::SensorStream::laser) {
      const LaserSample& from = simulation.lasers()[delivery.index];
      QueuedOdometry::Ranges ranges;
      ranges.t_ns = from.t_ns;
      std::copy(from.range.begin(), from.range.end(), ranges.range.begin());
      REQUIRE(odometry.add_laser(ranges));
    } else if (delivery.stream == simulator::SensorStream::encoder) {
      REQUIRE(odometry.add_encoder(simulation.encoders()[delivery.index]));
    } else if (delivery.stream == simulator::SensorStream::camera) {
      odometry.add_stereo(drive.frame(delivery.index));  // may be refused
    } else {
      REQUIRE(odometry.add_imu(simulation.imu()[delivery.index]));
      const std::optional<NavState> live = odometry.live();
      if (started) ++(live ? present : missing);
      if (live) {
        CHECK(live->t_ns == simulation.imu()[delivery.index].t_ns);
        const simulator::Truth truth = simulation.truth(live->t_ns);
        if (T_truth.isApprox(Eigen::Isometry3d::Identity())) {
          const Eigen::Matrix3d R = truth.R_WB * live->q_WB.toRotationMatrix().transpose();
          T_truth.linear() = R;
          T_truth.translation() = truth.p_WB - R * live->p_WB;
        }
        largest_error = std::max(largest_error, (T_truth * live->p_WB - truth.p_WB).norm());
      }
    }
    cost = t > kSlowFrom ? kCost : 1e-3;
    while (t >= free_at) {
      const double before = now;
      std::optional<Estimate> estimate;
      const Progress progress = odometry.process(estimate);
      if (progress == Progress::no_frame) break;
      if (now > before) free_at = t + cost;
      if (!estimate) continue;
      started = true;
      if (t > kSlowFrom + kCost) {
        longest_pause = std::max(longest_pause, t - last_estimate);
        largest_delay = std::max(largest_delay, seconds_between(estimate->state.t_ns, delivery.arrival_ns));
      }
      last_estimate = t;
    }
  }
  const Overflows overflows = odometry.overflows();
  CHECK(missing == 0);
  CHECK(present > 3000);
  CHECK(largest_error < 0.3);
  CHECK(overflows.imu == 0);
  CHECK(overflows.frames > 10);
  CHECK(odometry.odometry().health().load_step == LoadGovernor::kLastStep);
  CHECK(longest_pause < 1.5);
  CHECK(largest_delay < 0.5 * capacity.seconds + kCost);
}

TEST_CASE("load: a budget that is no time is refused") {
  Config config;
  config.performance.budget_ms = -1.0;
  CHECK_THROWS_WITH_AS(Odometry(config, simulator::Simulation(at_ten_hertz()).calibration()),
                       "performance.budget_ms: a time, or 0 for no limit", std::invalid_argument);
}

}  // namespace
}  // namespace ear
