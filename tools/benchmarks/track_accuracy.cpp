// track_accuracy: the filter's accuracy and consistency on simulated feature tracks, without images and files.
//
//   track_accuracy --sequences flat1,fly1 --seeds 501..505 --calibration both --rate 30,10 --config a.yaml
//
// One Markdown table per configuration file, one row per sequence, camera rate and calibration.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "src/recording/config_file.h"
#include "tools/evaluation/alignment.h"
#include "tools/experiments/table.h"
#include "tools/progress.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {
namespace {

struct Arguments {
  std::vector<std::string> sequences{"all"};
  std::vector<std::string> seeds{"501..505"};
  std::string calibration = "both";
  std::vector<double> rates{30.0};
  std::vector<std::filesystem::path> configs;
  evaluation::AlignmentKind alignment = evaluation::AlignmentKind::yaw;
  std::optional<double> duration;
  int threads = 2;
  bool json = false;
};

/// One simulation, and which calibrations the filter is told on it.
struct Job {
  simulator::Options options;
  std::vector<bool> true_calibration;
};

/// "501..505", "7" -> the numbers.
std::vector<std::uint64_t> parse_seeds(const std::vector<std::string>& texts) {
  std::vector<std::uint64_t> seeds;
  for (const std::string& text : texts) {
    const std::size_t dots = text.find("..");
    const std::uint64_t first = std::stoull(text.substr(0, dots));
    const std::uint64_t last = dots == std::string::npos ? first : std::stoull(text.substr(dots + 2));
    for (std::uint64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
  }
  return seeds;
}

std::vector<Job> jobs_of(const Arguments& args) {
  const bool all = args.sequences == std::vector<std::string>{"all"};
  std::vector<bool> calibrations;
  if (args.calibration != "wrong") calibrations.push_back(true);
  if (args.calibration != "true") calibrations.push_back(false);
  std::vector<Job> jobs;
  for (const std::string& sequence : all ? simulator::sequence_names() : args.sequences) {
    for (const double rate : args.rates) {
      for (const std::uint64_t seed : parse_seeds(args.seeds)) {
        simulator::Options options;
        options.sequence = sequence;
        options.seed = seed;
        options.camera_rate_hz = rate;
        options.duration = args.duration;
        jobs.push_back({options, calibrations});
      }
    }
  }
  return jobs;
}

/// All runs of one job. The samples do not depend on the calibration told, so they are simulated once.
std::vector<Run> run(const Job& job, const FilterConfig& config, evaluation::AlignmentKind alignment) {
  const simulator::Simulation simulation(job.options);
  std::vector<Run> runs;
  for (const bool true_calibration : job.true_calibration) {
    const Calibration& told = true_calibration ? simulation.true_calibration() : simulation.calibration();
    runs.push_back({{job.options.sequence, job.options.camera_rate_hz, true_calibration},
                    job.options.seed,
                    measure(simulation, told, config, alignment)});
  }
  return runs;
}

/// All jobs on several threads; the result does not depend on their number.
std::vector<Run> run_all(const std::vector<Job>& jobs, const FilterConfig& config, const Arguments& args) {
  std::vector<std::vector<Run>> results(jobs.size());
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  std::size_t done = 0;
  tools::Progress progress;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < jobs.size(); i = next++) {
        results[i] = run(jobs[i], config, args.alignment);
        const std::lock_guard<std::mutex> lock(mutex);
        progress.show(std::to_string(++done) + " of " + std::to_string(jobs.size()) + " simulations");
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      failure = std::current_exception();
      next = jobs.size();
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < args.threads; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  progress.finish();
  if (failure) std::rethrow_exception(failure);

  std::vector<Run> runs;
  for (const std::vector<Run>& result : results) runs.insert(runs.end(), result.begin(), result.end());
  return runs;
}

void track_accuracy(const Arguments& args) {
  std::vector<std::filesystem::path> configs = args.configs;
  if (configs.empty()) configs.emplace_back();
  const std::vector<Job> jobs = jobs_of(args);
  for (const std::filesystem::path& file : configs) {
    const Config config = file.empty() ? Config{} : load_config(file);
    const std::vector<Run> runs = run_all(jobs, config.filter, args);
    if (args.json) {
      std::cout << to_json(runs) << std::flush;
      continue;
    }
    std::cout << (file.empty() ? "default settings" : file.string()) << "\n\n" << to_markdown(runs) << std::endl;
  }
}

int parse_and_run(int argc, char** argv) {
  using evaluation::AlignmentKind;
  const std::map<std::string, AlignmentKind> alignments{
      {"se3", AlignmentKind::se3}, {"yaw", AlignmentKind::yaw}, {"none", AlignmentKind::none}};
  Arguments args;
  CLI::App app{"track_accuracy: accuracy and consistency of the filter on simulated feature tracks"};
  app.add_option("--sequences", args.sequences, "a,b,.. or all")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", args.seeds, "7 or 501..505, several with commas")->delimiter(',')->capture_default_str();
  app.add_option("--calibration", args.calibration, "that the filter is told")
      ->check(CLI::IsMember({"true", "wrong", "both"}))
      ->capture_default_str();
  app.add_option("--rate", args.rates, "of the camera [Hz], several with commas")
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--config", args.configs, "settings, several with commas: a table for each")
      ->delimiter(',')
      ->check(CLI::ExistingFile);
  app.add_option("--align", args.alignment, "se3, yaw or none, as in ear evaluate")
      ->transform(CLI::CheckedTransformer(alignments, CLI::ignore_case).description(""))
      ->default_str("yaw");
  app.add_option("--duration", args.duration, "[s] stop earlier");
  app.add_option("--threads", args.threads, "the figures do not depend on it")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--json", args.json, "every run's figures as JSON instead of a table");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {  // also --help
    return app.exit(error);
  }
  track_accuracy(args);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace ear::experiments

int main(int argc, char** argv) {
  try {
    return ear::experiments::parse_and_run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "track_accuracy: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
