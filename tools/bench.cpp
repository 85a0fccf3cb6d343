// ear bench RECORDING: what the pipeline costs for each stereo frame (tools/bench_run.h); ear bench --suite: the same
// of several recordings, rates and numbers of features (tools/bench_suite.h).
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <stdexcept>
#include <string>

#include "src/recording/recording.h"
#include "tools/bench_figures.h"
#include "tools/bench_run.h"
#include "tools/bench_suite.h"
#include "tools/commands.h"
#include "tools/input_options.h"
#include "tools/machine.h"
#include "tools/opened_recording.h"
#include "tools/program_config.h"
#include "tools/suite_figures.h"
#include "tools/version.h"

namespace ear::tools {
namespace {

struct BenchArguments {
  std::filesystem::path recording;
  std::filesystem::path config;
  std::filesystem::path compare;
  bool json = false;
  bool suite = false;
  SuiteOptions suite_options;
};

/// What `parse` makes of the file that --json wrote before; nothing without one.
template <class Figures>
std::optional<Figures> read_before(const std::filesystem::path& file, Figures (*parse)(const nlohmann::json&)) {
  if (file.empty()) return std::nullopt;
  std::ifstream stream(file);
  const nlohmann::json json = nlohmann::json::parse(stream, nullptr, false);
  try {
    return parse(json);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

/// JSON or the table, and how it compares with what was before.
template <class Figures>
void print(const BenchArguments& args, const Figures& figures, const std::optional<Figures>& before) {
  std::cout << (args.json ? to_json(figures).dump(2) + "\n" : table_of(figures));
  if (before) (args.json ? std::cerr : std::cout) << comparison_of(*before, figures);
}

void bench_one(const BenchArguments& args) {
  const Config config = program_config(args.config);
  const auto before = read_before(args.compare, bench_figures_of);  // first: a wrong file is said at once
  const OpenedRecording opened(args.recording, args.config);
  Recording recording = opened.read({});
  const BenchFigures figures = run_bench(config, recording, args.recording.filename().string());
  print(args, figures, before);
  if (!args.json) std::cout << line_to_paste(figures, this_machine(), commit(), kernels_here(config)) << '\n';
}

void bench_suite(const BenchArguments& args) {
  const Config config = program_config(args.config);
  const auto before = read_before(args.compare, suite_figures_of);
  SuiteFigures figures = run_suite(config, args.suite_options);
  figures.machine = this_machine();
  figures.commit = commit();
  figures.kernels = kernels_here(config);
  print(args, figures, before);
}

void bench(const BenchArguments& args) {
  cv::setNumThreads(1);
  if (args.suite == !args.recording.empty()) throw std::invalid_argument("bench: give either RECORDING or --suite");
  args.suite ? bench_suite(args) : bench_one(args);
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto* command = app.add_subcommand("bench", "Measure the time per stereo frame and stage");
  auto args = std::make_shared<BenchArguments>();
  command->add_option("RECORDING", args->recording, "Folder in the EuRoC/ASL layout, or a bag (docs/bags.md)");
  add_config_option(*command, args->config);
  command->add_flag("--json", args->json, "The figures as JSON, for --compare");
  command->add_option("--compare", args->compare, "What --json wrote before: shows the changes since")
      ->check(CLI::ExistingFile);
  CLI::Option* suite =
      command->add_flag("--suite", args->suite,
                        "Three simulated recordings (standing, drive, flight), each at several rates and features");
  SuiteOptions& options = args->suite_options;
  command->add_option("--folder", options.folder, "Keeps the suite's recordings, and takes those that are there")
      ->needs(suite);
  command->add_option("--recordings", options.recordings, "Which of them")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::IsMember(suite_recordings()))
      ->needs(suite);
  command->add_option("--rates", options.rates_hz, "[Hz] of the camera")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->needs(suite);
  command->add_option("--repeat", options.repeat, "Runs of each, one after the other; their scatter is shown")
      ->capture_default_str()
      ->check(CLI::PositiveNumber)
      ->needs(suite);
  command->add_option("--seconds", options.seconds, "[s] of each recording that count")
      ->capture_default_str()
      ->check(CLI::PositiveNumber)
      ->needs(suite);
  command->add_option("--features", options.features, "Numbers of features")
      ->capture_default_str()
      ->delimiter(',')
      ->needs(suite);
  command->callback([args] { bench(*args); });
}

}  // namespace ear::tools
