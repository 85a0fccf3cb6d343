#include "src/live/live_estimator.h"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <utility>

namespace ear::live {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPatience{100};    // with readings that belong before a frame and are not there
constexpr std::chrono::milliseconds kNoSamples{500};   // a frame waits for inertial samples, at most
constexpr std::chrono::milliseconds kLongestLook{10};  // that counts as waiting
constexpr TimeNs kLongestHeld = 300'000'000;           // samples are handed over without a frame after this time
constexpr long kWakeNs = 5'000'000;                    // the thread looks again, whatever was missed

TimeNs period(double rate_hz) { return std::llround(1e9 / rate_hz); }

std::size_t sample_slots(const Calibration& calibration, const QueueCapacity& capacity) {
  return static_cast<std::size_t>(std::ceil(2.0 * capacity.seconds * calibration.imu.rate_hz)) + 32;
}

}  // namespace

LiveEstimator::LiveEstimator(const Config& config, const Calibration& calibration, const QueueCapacity& capacity,
                             LiveListeners listeners, MakeEstimator make)
    : queued_(config, calibration, capacity, {}, std::move(make)),
      samples_(sample_slots(calibration, capacity), {}),
      listeners_(std::move(listeners)),
      steps_(!calibration.cameras.empty(), calibration.encoder.has_value()),
      reached_ns_(kNever) {
  if (const auto& encoder = calibration.encoder) {
    encoder_.period_ns = period(encoder->rate_hz);
    encoder_.time_offset = encoder->time_offset;
  }
  if (const auto& lasers = calibration.lasers) {
    laser_.period_ns = period(lasers->rate_hz);
    laser_.time_offset = lasers->time_offset;
  }
  ::sem_init(&news_, 0, 0);
  thread_ = std::thread([this] { run(); });
}

LiveEstimator::~LiveEstimator() {
  stop();
  ::sem_destroy(&news_);
}

void LiveEstimator::stop() {
  if (!thread_.joinable()) return;
  stop_ = true;
  wake();
  thread_.join();
}

bool LiveEstimator::add_imu(const ImuSample& sample, std::optional<NavState>* state) {
  const bool taken = queued_.add_imu(sample);
  const std::optional<NavState> live = queued_.live();
  if (state != nullptr) *state = live;
  LiveSample* const slot = taken ? samples_.slot_to_fill() : nullptr;
  if (slot != nullptr) {
    *slot = {sample, live};
    samples_.push();
  }
  wake();
  return taken;
}

bool LiveEstimator::add_encoder(const EncoderSample& sample) {
  const bool taken = queued_.add_encoder(sample);
  if (taken) encoder_.newest_ns = later_by(encoder_.time_offset, sample.t_ns);
  return taken;
}

bool LiveEstimator::add_laser(const QueuedOdometry::Ranges& ranges) {
  const bool taken = queued_.add_laser(ranges);
  if (taken) laser_.newest_ns = later_by(laser_.time_offset, ranges.t_ns);
  return taken;
}

bool LiveEstimator::add_stereo(const StereoFrame& frame) {
  const bool taken = queued_.add_stereo(frame);
  wake();
  return taken;
}

void LiveEstimator::run() {
  ::pthread_setname_np(::pthread_self(), "estimator");  // for top -H, and for who measures it
  while (true) {
    count_waiting();
    const bool last_time = stop_;  // looked at first: what came before it is still estimated
    while (advance()) continue;
    if (last_time) return;
    timespec until{};
    ::clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += kWakeNs;
    until.tv_sec += until.tv_nsec / 1'000'000'000;
    until.tv_nsec %= 1'000'000'000;
    ::sem_timedwait(&news_, &until);
    while (::sem_trywait(&news_) == 0) continue;  // one look serves all that came
  }
}

/// A stall of this process is no waiting: what came meanwhile is still on its way.
void LiveEstimator::count_waiting() {
  const SteadyClock::time_point now = SteadyClock::now();
  if (waited_) *waited_ += std::min<std::chrono::nanoseconds>(now - looked_, kLongestLook);
  looked_ = now;
}

/// One frame or one inertial sample; false: nothing can be done before more comes.
bool LiveEstimator::advance() {
  if (step_ns_) return take_step();
  const std::optional<TimeNs> frame_ns = queued_.next_frame_ns();
  if (!frame_ns) {
    waited_.reset();
  } else if (reached_ns_ >= *frame_ns) {
    return take_frame(*frame_ns);
  }
  if (samples_.front() != nullptr) {
    take_sample();
    return true;
  }
  if (!frame_ns) return false;
  // No inertial samples: the frame goes on without, once all slots are taken.
  if (!waited_) waited_.emplace(0);
  if (*waited_ < kNoSamples) return false;
  return take_frame(*frame_ns);
}

/// For readings that belong before a frame or a step; a stream that was waited for in vain is not waited for again
/// before it speaks.
bool LiveEstimator::must_wait() {
  if (stop_) return false;
  const std::array<Beside*, 2> streams = {&encoder_, &laser_};
  const auto owed = [this](const Beside* stream) { return is_owed(*stream); };
  if (std::none_of(streams.begin(), streams.end(), owed)) return false;
  if (!waited_) waited_.emplace(0);
  if (*waited_ < kPatience) return true;
  ++impatient_;
  for (Beside* const stream : streams) {
    if (owed(stream)) stream->given_up_ns = stream->newest_ns;
  }
  return false;
}

/// False: it stays, and waits for other sensors.
bool LiveEstimator::take_step() {
  if (must_wait()) return false;
  waited_.reset();
  handed_over_ns_ = *step_ns_;
  report(queued_.step(*step_ns_), *step_ns_);
  step_ns_.reset();
  return true;
}

/// False: it stays, and waits for other sensors.
bool LiveEstimator::take_frame(TimeNs frame_ns) {
  if (must_wait()) return false;
  QueuedFrame* const keep = listeners_.keep_frame ? listeners_.keep_frame() : nullptr;
  std::optional<Estimate> estimate;
  if (queued_.process(estimate, keep) == Progress::no_frame) {
    reached_ns_ = kNever;  // the stamp that reached it was a false one
    return false;
  }
  waited_.reset();
  handed_over_ns_ = frame_ns;
  steps_.saw_frame(frame_ns);
  report(std::move(estimate), frame_ns);
  return true;
}

void LiveEstimator::take_sample() {
  const LiveSample sample = *samples_.front();
  samples_.pop();
  reached_ns_ = sample.imu.t_ns;
  if (listeners_.on_imu) listeners_.on_imu(sample);
  if (!handed_over_ns_) handed_over_ns_ = reached_ns_;
  if (queued_.next_frame_ns()) return;
  const TimeNs step_ns = step_time(reached_ns_, queued_.odometry().frame_time(reached_ns_));
  if (steps_.due(step_ns)) {
    step_ns_ = step_ns;
  } else if (std::abs(duration_ns(*handed_over_ns_, reached_ns_)) > kLongestHeld) {
    handed_over_ns_ = reached_ns_;
    queued_.hand_over_samples();
  }
}

/// Is a reading on its way that is no later than the inertial samples? Stamps vary by a tenth of the period.
bool LiveEstimator::is_owed(const Beside& stream) const {
  const TimeNs newest = stream.newest_ns;
  if (stream.period_ns == 0 || newest == stream.given_up_ns) return false;
  return newest == kNever || duration_ns(newest, reached_ns_) >= stream.period_ns - stream.period_ns / 10;
}

void LiveEstimator::report(std::optional<Estimate> estimate, TimeNs t_ns) {
  if (!listeners_.on_frame) return;
  const Odometry& odometry = queued_.odometry();
  listeners_.on_frame({t_ns, std::move(estimate), odometry.status(), odometry.health()}, odometry);
}

}  // namespace ear::live
