// Threads that deliver in another order than their stamps give the same estimates.
#include "src/live/live_estimator.h"

#include <doctest/doctest.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "tools/simulator/film.h"

using namespace ear;
using namespace ear::live;

namespace {

/// Collects what the estimator's thread reports, and lets another thread wait for it.
class Reports {
 public:
  LiveListeners listeners() {
    return {[this](const LiveFrame& frame, const Odometry&) {
              const std::lock_guard lock(mutex_);
              frames_.push_back(frame);
              changed_.notify_all();
            },
            [this](const LiveSample& sample) {
              const std::lock_guard lock(mutex_);
              ++samples_;
              states_ += sample.state ? 1 : 0;
            }};
  }
  bool wait_for_frames(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return frames_.size() >= count; });
  }
  [[nodiscard]] std::size_t count() {
    const std::lock_guard lock(mutex_);
    return frames_.size();
  }
  [[nodiscard]] const std::vector<LiveFrame>& frames() const { return frames_; }
  [[nodiscard]] int samples() const { return samples_; }
  [[nodiscard]] int states() const { return states_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<LiveFrame> frames_;
  int samples_ = 0, states_ = 0;
};

/// Three seconds of a drive; readings of the wheels come so many samples late, with stamps to which the calibration
/// says to add `offset` [s].
void drive(const simulator::Film& film, std::size_t late, Reports& reports, double offset = 0.0) {
  const simulator::Simulation& simulation = film.simulation;
  Calibration calibration = simulation.calibration();
  calibration.encoder->time_offset = offset;
  LiveEstimator estimator(Config{}, calibration, {}, reports.listeners());
  std::deque<EncoderSample> held_back;
  std::size_t frames = 0;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    switch (delivery.stream) {
      case simulator::SensorStream::imu:
        REQUIRE(estimator.add_imu(simulation.imu()[delivery.index]));
        break;
      case simulator::SensorStream::encoder:
        held_back.push_back(simulation.encoders()[delivery.index]);
        held_back.back().t_ns = later_by(-offset, held_back.back().t_ns);
        break;
      case simulator::SensorStream::camera:
        REQUIRE(estimator.add_stereo(film.frame(delivery.index)));
        ++frames;
        break;
      default:
        break;
    }
    for (; held_back.size() > late; held_back.pop_front()) REQUIRE(estimator.add_encoder(held_back.front()));
    if (frames > 1) REQUIRE(reports.wait_for_frames(frames - 1));  // the queues are not to be full
  }
  estimator.stop();
}

}  // namespace

TEST_CASE("live: wheel readings that come late, or by another clock, change nothing, and no sample is lost") {
  simulator::Options options;
  options.seed = 11;
  options.duration = 3.0;
  options.camera_rate_hz = 10.0;  // no step without images between two, however long this process is held up
  const simulator::Film film(options);
  Reports in_time, late, by_another_clock;
  drive(film, 0, in_time);
  drive(film, 2, late);
  drive(film, 2, by_another_clock, -0.15);
  CHECK(in_time.samples() == static_cast<int>(film.simulation.imu().size()));
  CHECK(in_time.states() > 200);
  for (const Reports* other : {&late, &by_another_clock}) {
    REQUIRE(in_time.frames().size() == other->frames().size());
    int estimates = 0;
    for (std::size_t i = 0; i < other->frames().size(); ++i) {
      const LiveFrame &a = in_time.frames()[i], &b = other->frames()[i];
      CHECK(a.t_ns == b.t_ns);
      REQUIRE(a.estimate.has_value() == b.estimate.has_value());
      if (!a.estimate) continue;
      ++estimates;
      CHECK(a.estimate->state.p_WB == b.estimate->state.p_WB);
      CHECK(a.estimate->covariance == b.estimate->covariance);
    }
    CHECK(estimates >= 8);
  }
}

TEST_CASE("live: without cameras the wheels carry on, twenty times a second") {
  Calibration calibration;
  calibration.encoder.emplace();
  Reports reports;
  LiveEstimator estimator(Config{}, calibration, {20.0, 4}, reports.listeners());
  ImuSample sample;
  sample.accel_B = {0.0, 0.0, 9.81};
  for (sample.t_ns = 1'000'000'000; sample.t_ns < 4'000'000'000; sample.t_ns += 5'000'000) {
    REQUIRE(estimator.add_encoder({sample.t_ns, 0, 0}));
    REQUIRE(estimator.add_imu(sample));
  }
  estimator.stop();
  CHECK(reports.samples() == 600);
  CHECK(reports.frames().size() == 60);
  CHECK(reports.frames().back().status == Status::tracking);
  CHECK(estimator.overflows().imu == 0);
}

TEST_CASE("live: a step without cameras waits for the wheels; for wheels that fell silent once") {
  Calibration calibration;
  calibration.encoder.emplace();
  calibration.encoder->rate_hz = 200.0;
  Reports reports;
  LiveEstimator estimator(Config{}, calibration, {20.0, 4}, reports.listeners());
  ImuSample sample;
  sample.accel_B = {0.0, 0.0, 9.81};
  sample.t_ns = 1'000'000'000;
  const auto inertial_until = [&](TimeNs end_ns) {
    for (; sample.t_ns < end_ns; sample.t_ns += 5'000'000) REQUIRE(estimator.add_imu(sample));
  };
  TimeNs wheels_ns = 1'000'000'000;
  const auto wheels_until = [&](TimeNs end_ns) {
    for (; wheels_ns < end_ns; wheels_ns += 5'000'000) REQUIRE(estimator.add_encoder({wheels_ns, 0, 0}));
  };
  wheels_until(2'000'000'000);
  inertial_until(2'000'000'000);
  REQUIRE(reports.wait_for_frames(20));

  inertial_until(2'030'000'000);
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  CHECK(reports.count() == 20);
  wheels_until(2'030'000'000);
  REQUIRE(reports.wait_for_frames(21));
  CHECK(estimator.impatient() == 0);

  inertial_until(2'320'000'000);
  REQUIRE(reports.wait_for_frames(27));
  CHECK(estimator.impatient() == 1);
}

TEST_CASE("live: a flood is refused and counted; the estimator goes on") {
  Calibration calibration;
  calibration.encoder.emplace();
  Reports reports;
  LiveEstimator estimator(Config{}, calibration, {}, reports.listeners());
  ImuSample sample;
  sample.accel_B = {0.0, 0.0, 9.81};
  std::uint64_t refused = 0;
  for (int i = 0; i < 200'000; ++i) {
    sample.t_ns += 100'000;
    refused += estimator.add_imu(sample) ? 0 : 1;
  }
  estimator.stop();
  CHECK(estimator.overflows().imu == refused);
  CHECK(reports.samples() == 200'000 - static_cast<int>(refused));
}
