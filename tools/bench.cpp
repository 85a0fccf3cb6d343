// ear bench RECORDING: what the pipeline costs for each stereo frame, beside the floor measured on the same images in
// the same run (tools/floor.h). One thread; CPU time.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "ear/odometry.h"
#include "src/recording/config_file.h"
#include "src/recording/recording.h"
#include "tools/commands.h"
#include "tools/floor.h"

namespace ear::tools {
namespace {

constexpr std::size_t kWarmUp = 5;  // frames in which memory is allocated and caches fill

struct BenchArguments {
  std::filesystem::path recording;
  std::filesystem::path config;
};

// Times of one kind, one for each frame [s].
class Series {
 public:
  void add(double seconds) { times_.push_back(seconds); }

  [[nodiscard]] double quantile_ms(double share) const {
    std::vector<double> rest(times_.begin() + static_cast<std::ptrdiff_t>(std::min(kWarmUp, times_.size())),
                             times_.end());
    if (rest.empty()) return 0.0;
    const auto at = rest.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(rest.size() - 1));
    std::nth_element(rest.begin(), at, rest.end());
    return 1e3 * *at;
  }

  [[nodiscard]] std::size_t size() const { return times_.size(); }

 private:
  std::vector<double> times_;
};

struct Measured {
  Series floor;
  Series pipeline;
  Series pyramid, track, reject, stereo, detect, filter;
};

class Bench {
 public:
  Bench(const Config& config, const Calibration& calibration)
      : odometry_(config, calibration), floor_(config.frontend.max_features) {}

  void add(const ImuSample& sample) {
    const double start = thread_cpu_time();
    odometry_.add_imu(sample);
    imu_seconds_ += thread_cpu_time() - start;
  }

  void add(const RecordedFrame& frame) {
    const double start = thread_cpu_time();
    odometry_.add_stereo(frame);
    measured_.pipeline.add(imu_seconds_ + thread_cpu_time() - start);
    imu_seconds_ = 0.0;
    const StageTimes stages = odometry_.stage_times();
    measured_.pyramid.add(stages.pyramid);
    measured_.track.add(stages.track);
    measured_.reject.add(stages.reject);
    measured_.stereo.add(stages.stereo);
    measured_.detect.add(stages.detect);
    measured_.filter.add(stages.filter);
    measured_.floor.add(floor_.measure(frame));
  }

  [[nodiscard]] const Measured& measured() const { return measured_; }

 private:
  Odometry odometry_;
  Floor floor_;
  Measured measured_;
  double imu_seconds_ = 0.0;  // since the last frame
};

void print(const Measured& measured, int points) {
  const auto row = [](const char* name, const Series& series) {
    std::printf("%-10s %8.3f %8.3f %8.3f\n", name, series.quantile_ms(0.5), series.quantile_ms(0.95),
                series.quantile_ms(1.0));
  };
  std::printf("%zu stereo frames, %d points, one thread\n", measured.pipeline.size(), points);
  std::printf("%-10s %8s %8s %8s\n", "CPU ms", "median", "95 %", "worst");
  row("floor", measured.floor);
  row("pipeline", measured.pipeline);
  std::printf("ratio      %8.3f\n", measured.pipeline.quantile_ms(0.5) / measured.floor.quantile_ms(0.5));
  std::printf("wall ms\n");
  row("pyramid", measured.pyramid);
  row("track", measured.track);
  row("reject", measured.reject);
  row("stereo", measured.stereo);
  row("detect", measured.detect);
  row("filter", measured.filter);
}

void bench(const BenchArguments& args) {
  cv::setNumThreads(1);
  const Config config = args.config.empty() ? Config{} : load_config(args.config);
  Recording recording(args.recording);
  if (recording.calibration().cameras.size() < 2) {
    throw std::runtime_error(args.recording.string() + ": the benchmark needs a stereo pair");
  }
  Bench bench(config, recording.calibration());
  std::optional<RecordedFrame> waiting;  // until the first inertial sample after it, as the images of a real camera
  while (const auto sample = recording.next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*sample)) {
      bench.add(*imu);
      if (waiting && imu->t_ns >= waiting->t_ns) {
        bench.add(*waiting);
        waiting.reset();
      }
    } else if (const auto* frame = std::get_if<RecordedFrame>(&*sample)) {
      waiting = *frame;
    }
  }
  print(bench.measured(), config.frontend.max_features);
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto* command = app.add_subcommand("bench", "Measure the time per stereo frame and stage");
  auto args = std::make_shared<BenchArguments>();
  command->add_option("RECORDING", args->recording, "Folder in the EuRoC/ASL layout (docs/recordings.md)")->required();
  command->add_option("--config", args->config, "Settings; what it leaves out keeps its default")
      ->check(CLI::ExistingFile);
  command->callback([args] { bench(*args); });
}

}  // namespace ear::tools
