// ear bench RECORDING: what the pipeline costs for each stereo frame, beside the floor measured on the same images in
// the same run (tools/floor.h). One thread. Floor, pipeline, read and samples are CPU time of the thread; the stages
// within the pipeline are wall time, so that they mean something on a machine that is otherwise idle.
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "ear/odometry.h"
#include "src/recording/recording.h"
#include "tools/allocation_counter.h"
#include "tools/bench_figures.h"
#include "tools/commands.h"
#include "tools/floor.h"
#include "tools/input_options.h"
#include "tools/opened_recording.h"
#include "tools/processor_time.h"
#include "tools/program_config.h"
#include "tools/replay.h"

namespace ear::tools {
namespace {

constexpr std::size_t kWarmUp = 5;  // frames in which memory is allocated and caches fill

struct BenchArguments {
  std::filesystem::path recording;
  std::filesystem::path config;
  std::filesystem::path compare;
  bool json = false;
};

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
  [[nodiscard]] std::size_t frames() const { return values_.size() > kWarmUp ? values_.size() - kWarmUp : 0; }
  [[nodiscard]] Distribution distribution(double factor) const {
    std::vector<double> rest(values_.end() - static_cast<std::ptrdiff_t>(frames()), values_.end());
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
        frame_ = *frame;  // put aside by replay() too, with a copy that a driver would not make: not measured
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

  [[nodiscard]] BenchFigures figures(const BenchArguments& args, int points) const {
    constexpr double kMs = 1e3;
    BenchFigures figures;
    figures.recording = args.recording.filename().string();
    figures.frames = pipeline_s_.frames();
    figures.points = points;
    figures.stages = {{"floor", floor_s_.distribution(kMs)},   {"pipeline", pipeline_s_.distribution(kMs)},
                      {"read", read_s_.distribution(kMs)},     {"pyramid", pyramid_s_.distribution(kMs)},
                      {"track", track_s_.distribution(kMs)},   {"reject", reject_s_.distribution(kMs)},
                      {"stereo", stereo_s_.distribution(kMs)}, {"detect", detect_s_.distribution(kMs)},
                      {"filter", filter_s_.distribution(kMs)}, {"samples", samples_s_.distribution(kMs)}};
    if (counts_allocations()) figures.allocations = allocations_.distribution(1.0);
    const double floor = figures.stage("floor").p50;
    figures.ratio = floor > 0.0 ? figures.stage("pipeline").p50 / floor : 0.0;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    figures.peak_memory_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;
    return figures;
  }

 private:
  void take(const ReplayedFrame& replayed) {
    if (!frame_ || frame_->t_ns != replayed.t_ns || !pipeline_.running()) return;  // no image, or out of turn
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
    floor_s_.add(floor_.measure(*frame_));
    frame_.reset();
    pipeline_.start();
  }

  Odometry odometry_;
  Floor floor_;
  Recording& recording_;
  std::optional<RecordedFrame> frame_;  // the one that replay() hands over next
  Meter pipeline_, reading_;
  double other_seconds_ = 0.0;
  double samples_seconds_ = 0.0;  // since the last frame, without the sample that released it
  Series floor_s_, pipeline_s_, read_s_, pyramid_s_, track_s_, reject_s_, stereo_s_, detect_s_, filter_s_, samples_s_;
  Series allocations_;
};

BenchFigures read_figures(const std::filesystem::path& file) {
  std::ifstream stream(file);
  const nlohmann::json json = nlohmann::json::parse(stream, nullptr, false);
  try {
    return bench_figures_of(json);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

void bench(const BenchArguments& args) {
  cv::setNumThreads(1);
  const Config config = program_config(args.config);
  std::optional<BenchFigures> before;  // read first: a wrong file is said at once
  if (!args.compare.empty()) before = read_figures(args.compare);
  const OpenedRecording opened(args.recording, args.config);
  Recording recording = opened.read({});
  if (recording.calibration().cameras.size() < 2) {
    throw std::runtime_error(args.recording.string() + ": the benchmark needs a stereo pair");
  }
  Bench bench(config, recording);
  bench.run();
  const BenchFigures figures = bench.figures(args, config.frontend.max_features);
  if (args.json) {
    std::cout << to_json(figures).dump(2) << '\n';
  } else {
    std::cout << table_of(figures);
  }
  if (before) (args.json ? std::cerr : std::cout) << comparison_of(*before, figures);
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto* command = app.add_subcommand("bench", "Measure the time per stereo frame and stage");
  auto args = std::make_shared<BenchArguments>();
  command->add_option("RECORDING", args->recording, "Folder in the EuRoC/ASL layout, or a bag (docs/bags.md)")
      ->required();
  add_config_option(*command, args->config);
  command->add_flag("--json", args->json, "The figures as JSON, for --compare");
  command->add_option("--compare", args->compare, "What --json wrote before: shows the changes since")
      ->check(CLI::ExistingFile);
  command->callback([args] { bench(*args); });
}

}  // namespace ear::tools
