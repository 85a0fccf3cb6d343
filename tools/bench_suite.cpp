#include "tools/bench_suite.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include "src/recording/recording.h"
#include "tools/bench_run.h"
#include "tools/progress.h"
#include "tools/simulator/picture_files.h"
#include "tools/simulator/recording_writer.h"
#include "tools/simulator/simulation.h"

namespace ear::tools {
namespace {

struct SuiteRecording {
  const char* name;
  const char* sequence;
  double starts;  ///< [s] when it does what it is called
};
constexpr std::array kRecordings = {SuiteRecording{"standing", "static", 2.0}, SuiteRecording{"drive", "flat1", 3.0},
                                    SuiteRecording{"flight", "fly1", 10.0}};

const SuiteRecording& recording_named(const std::string& name) {
  const auto* const found = std::find_if(std::begin(kRecordings), std::end(kRecordings),
                                         [&](const SuiteRecording& recording) { return recording.name == name; });
  if (found == std::end(kRecordings)) throw std::invalid_argument("bench: the suite has no recording " + name);
  return *found;
}

/// Deletes itself with its end, where it is a temporary one.
class Folder {
 public:
  explicit Folder(const std::filesystem::path& given) : path_(given), temporary_(given.empty()) {
    if (temporary_) path_ = std::filesystem::temp_directory_path() / ("ear_bench_" + std::to_string(::getpid()));
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    if (temporary_) std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  Folder(Folder&&) = delete;
  Folder& operator=(Folder&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  bool temporary_;
};

/// Writes it, unless it is there.
void make_recording(const SuiteRecording& recording, double rate_hz, double seconds,
                    const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder)) return;
  simulator::Options options;
  options.sequence = recording.sequence;
  options.duration = recording.starts + seconds;
  options.camera_rate_hz = rate_hz;
  options.tracks = false;
  const simulator::Simulation simulation(options);
  const std::filesystem::path unfinished = folder.string() + ".unfinished";
  std::filesystem::remove_all(unfinished);
  simulator::write_recording(simulation, unfinished);
  Progress progress;
  const int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  simulator::render_images(
      simulation, simulator::all_pictures(simulation), unfinished, threads, [&](std::size_t done, std::size_t total) {
        progress.show("rendering " + std::to_string(done) + " of " + std::to_string(total) + " images");
      });
  progress.finish();
  std::filesystem::rename(unfinished, folder);
}

}  // namespace

std::vector<std::string> suite_recordings() {
  std::vector<std::string> names;
  names.reserve(kRecordings.size());
  for (const SuiteRecording& recording : kRecordings) names.emplace_back(recording.name);
  return names;
}

SuiteFigures run_suite(const Config& config, const SuiteOptions& options) {
  const Folder folder(options.folder);
  SuiteFigures figures;
  figures.runs = options.repeat;
  for (const std::string& name : options.recordings) {
    const SuiteRecording& recording = recording_named(name);
    for (const double rate_hz : options.rates_hz) {
      const std::filesystem::path path = folder.path() / (name + "_" + std::to_string(std::lround(rate_hz)) + "hz");
      make_recording(recording, rate_hz, options.seconds, path);
      const auto left_out = static_cast<std::size_t>(std::lround(recording.starts * rate_hz));
      std::vector<std::vector<BenchFigures>> runs(options.features.size());
      for (int round = 0; round < options.repeat; ++round) {
        for (std::size_t i = 0; i < options.features.size(); ++i) {
          Config changed = config;
          changed.frontend.max_features = options.features[i];
          Recording source(path);
          runs[i].push_back(run_bench(changed, source, name, left_out));
        }
      }
      for (const std::vector<BenchFigures>& same : runs) figures.cells.push_back(suite_cell(rate_hz, same));
    }
  }
  return figures;
}

}  // namespace ear::tools
