// ear evaluate ESTIMATE... TRUTH [--align se3|yaw|none] [--truth-error M] [--json] [--report FILE]: how good
// trajectories are.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tools/commands.h"
#include "tools/evaluation/evaluate.h"
#include "tools/evaluation/moments.h"
#include "tools/evaluation/read.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/summary.h"
#include "tools/filmstrip.h"

namespace ear::tools {
namespace {

namespace fs = std::filesystem;

struct EvaluateArguments {
  std::vector<fs::path> paths;  ///< estimates, then the truth
  evaluation::AlignmentKind kind = evaluation::AlignmentKind::yaw;
  double truth_error = evaluation::Truth{}.error;  ///< [m]
  bool json = false;
  fs::path report;
};

void write_report(const fs::path& path, const fs::path& recording, const evaluation::Trajectory& truth,
                  const std::vector<evaluation::ReportEntry>& entries) {
  const std::vector<evaluation::Moment> moments = film(evaluation::moments_of(entries.front().estimate), recording);
  std::ofstream file(path);
  file << evaluation::to_html(evaluation::distinct_names({recording}).front(), truth, entries, moments) << std::flush;
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

void evaluate(const EvaluateArguments& arguments) {
  const fs::path truth_path = arguments.paths.back();
  const std::vector<fs::path> estimate_paths(arguments.paths.begin(), arguments.paths.end() - 1);
  const std::vector<std::string> names = evaluation::distinct_names(estimate_paths);
  evaluation::Truth truth = evaluation::read_truth_or_positions(truth_path);
  truth.error = arguments.truth_error;

  const std::vector<evaluation::TerrainTruth> terrain = evaluation::read_terrain(truth_path);

  std::vector<evaluation::ReportEntry> entries;
  std::vector<evaluation::Evaluation> evaluations;
  for (std::size_t i = 0; i < estimate_paths.size(); ++i) {
    evaluation::Estimate estimate = evaluation::read_estimate(estimate_paths[i]);
    estimate.name = names[i];
    evaluations.push_back(evaluation::evaluate(estimate, truth, arguments.kind, terrain));
    entries.push_back({std::move(estimate), evaluations.back()});
  }
  if (!arguments.report.empty()) write_report(arguments.report, truth_path, truth.poses, entries);
  std::cout << (arguments.json ? evaluation::to_json(evaluations, truth_path.string())
                               : evaluation::to_table(evaluations));
}

}  // namespace

void add_evaluate_command(CLI::App& app) {
  using evaluation::AlignmentKind;
  const std::map<std::string, AlignmentKind> kinds{
      {"se3", AlignmentKind::se3}, {"yaw", AlignmentKind::yaw}, {"none", AlignmentKind::none}};

  const auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* const command = app.add_subcommand("evaluate", "how far estimated trajectories are from the truth");
  command
      ->add_option("ESTIMATE... TRUTH", arguments->paths,
                   "output folders of ear run, states.csv, TUM or EuRoC csv files; then the truth: a recording, or a "
                   "TUM or EuRoC csv file, or a csv of positions")
      ->required()
      ->expected(-2)  // two or more
      ->option_text(" ");
  command->add_option("--align", arguments->kind, "what the worlds may differ in: se3, yaw (and translation), none")
      ->transform(CLI::CheckedTransformer(kinds, CLI::ignore_case).description(""))
      ->type_name("se3|yaw|none")
      ->default_str("yaw");
  command
      ->add_option("--truth-error", arguments->truth_error,
                   "what the truth's positions may be off by [m]: smaller errors are no false tracking, smaller steps "
                   "no length")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "the figures as JSON instead of a table");
  command->add_option("--report", arguments->report, "also write a page with plots")->type_name("FILE.html");
  command->callback([arguments] { evaluate(*arguments); });
}

}  // namespace ear::tools
