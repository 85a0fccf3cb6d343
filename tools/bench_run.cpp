#include "tools/bench_run.h"

#include <sys/resource.h>

#include <deque>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "ear/odometry.h"
#include "tools/allocation_counter.h"
#include "tools/floor.h"
#include "tools/processor_time.h"
#include "tools/replay.h"

namespace ear::tools {
namespace {

/// Adds up CPU time and allocations of the calling thread between start() and stop().
class Meter {
 public:
  void start() {
    running_ = true;
    start_seconds_ = thread_time();
    start_allocations_ = thread_allocations();
  }
  void stop() {
    if (!running_) return;
    running_ = false;
    seconds_ += thread_time() - start_seconds_;
    allocations_ += thread_allocations() - start_allocations_;
  }
  [[nodiscard]] bool running() const { return running_; }
  [[nodiscard]] double seconds() const { return seconds_; }  ///< up to the last stop()

  /// What was added up since the last call [s], [1].
  std::pair<double, std::uint64_t> take() {
    return {std::exchange(seconds_, 0.0), std::exchange(allocations_, std::uint64_t{0})};
  }

 private:
  bool running_ = false;
  double seconds_ = 0.0;
  double start_seconds_ = 0.0;
  std::uint64_t allocations_ = 0;
  std::uint64_t start_allocations_ = 0;
};

/// CPU time of all threads but this one: of those that decode images ahead [s].
double other_threads_cpu_time() { return process_time() - thread_time(); }

/// Values of one kind, one per frame.
class Series {
 public:
  void add(double value) { values_.push_back(value); }
  [[nodiscard]] std::size_t frames(std::size_t left_out) const {
    return values_.size() > left_out ? values_.size() - left_out : 0;
  }
  [[nodiscard]] Distribution distribution(std::size_t left_out, double factor) const {
    std::vector<double> rest(values_.end() - static_cast<std::ptrdiff_t>(frames(left_out)), values_.end());
    for (double& value : rest) value *= factor;
    return distribution_of(std::move(rest));
  }

 private:
  std::vector<double> values_;
};

class Bench {
 public:
  Bench(const Config& config, Recording& recording)
      : odometry_(config, recording.calibration()), floor_(config.frontend.max_features), recording_(recording) {}

  void run() {
    reading_.start();
    other_seconds_ = other_threads_cpu_time();
    const auto before_sample = [this](const Sample& sample) {
      reading_.stop();
      if (const auto* frame = std::get_if<RecordedFrame>(&sample)) {
        frames_.push_back(*frame);  // put aside by replay() too, with a copy that a driver would not make: not measured
        return;
      }
      samples_seconds_ = pipeline_.seconds();
      pipeline_.start();
    };
    const auto after_sample = [this](const Sample&) {
      pipeline_.stop();
      reading_.start();
    };
    replay(
        recording_, odometry_, [this](const ReplayedFrame& frame) { take(frame); }, before_sample, after_sample);
  }

  [[nodiscard]] BenchFigures figures(const std::string& name, int points, std::size_t left_out) const {
    constexpr double kMs = 1e3;
    const auto of = [&](const Series& series) { return series.distribution(left_out, kMs); };
    BenchFigures figures;
    figures.recording = name;
    figures.frames = pipeline_s_.frames(left_out);
    figures.points = points;
    figures.stages = {{"floor", of(floor_s_)},     {"pipeline", of(pipeline_s_)}, {"read", of(read_s_)},
                      {"pyramid", of(pyramid_s_)}, {"track", of(track_s_)},       {"reject", of(reject_s_)},
                      {"stereo", of(stereo_s_)},   {"detect", of(detect_s_)},     {"filter", of(filter_s_)},
                      {"samples", of(samples_s_)}};
    if (counts_allocations()) figures.allocations = allocations_.distribution(left_out, 1.0);
    const double floor = figures.stage("floor").p50;
    figures.ratio = floor > 0.0 ? figures.stage("pipeline").p50 / floor : 0.0;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    figures.peak_memory_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;
    return figures;
  }

 private:
  void take(const ReplayedFrame& replayed) {
    while (!frames_.empty() && frames_.front().t_ns < replayed.t_ns) frames_.pop_front();  // out of turn
    if (frames_.empty() || frames_.front().t_ns != replayed.t_ns || !pipeline_.running()) return;
    pipeline_.stop();
    const auto [seconds, allocations] = pipeline_.take();
    pipeline_s_.add(seconds);
    allocations_.add(static_cast<double>(allocations));

    const StageTimes stages = odometry_.stage_times();
    pyramid_s_.add(stages.pyramid);
    track_s_.add(stages.track);
    reject_s_.add(stages.reject);
    stereo_s_.add(stages.stereo);
    detect_s_.add(stages.detect);
    filter_s_.add(stages.filter);
    samples_s_.add(samples_seconds_);

    const double other = other_threads_cpu_time();
    read_s_.add(reading_.take().first + other - other_seconds_);
    other_seconds_ = other;
    floor_s_.add(floor_.measure(frames_.front()));
    frames_.pop_front();
    pipeline_.start();
  }

  Odometry odometry_;
  Floor floor_;
  Recording& recording_;
  std::deque<RecordedFrame> frames_;  // that replay() hands over next
  Meter pipeline_, reading_;
  double other_seconds_ = 0.0;
  double samples_seconds_ = 0.0;  // since the last frame, without the sample that released it
  Series floor_s_, pipeline_s_, read_s_, pyramid_s_, track_s_, reject_s_, stereo_s_, detect_s_, filter_s_, samples_s_;
  Series allocations_;
};

}  // namespace

BenchFigures run_bench(const Config& config, Recording& recording, const std::string& name, std::size_t left_out) {
  if (recording.calibration().cameras.size() < 2) {
    throw std::runtime_error(name + ": the benchmark needs a stereo pair");
  }
  Bench bench(config, recording);
  bench.run();
  return bench.figures(name, config.frontend.max_features, left_out);
}

}  // namespace ear::tools
