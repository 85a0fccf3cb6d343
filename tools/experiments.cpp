// ear experiments: the paper's tables and figures, or the ablation, from one command.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tools/commands.h"
#include "tools/paper/catalogue.h"
#include "tools/paper/report.h"
#include "tools/paper/schedule.h"
#include "tools/paper/source_hashes.h"
#include "tools/paper/tables.h"

namespace ear::tools {
namespace {

struct ExperimentsArguments {
  std::vector<std::string> only;
  std::optional<int> seeds;
  std::uint64_t first_seed = 1;
  bool quick = false;
  bool ablation = false;
  bool discard_recordings = false;
  paper::Conditions conditions;
};

// Of each kind one: slow cameras and weights, uneven ground, swaying.
const std::vector<std::string> kQuickSequences{"flat3", "wave1", "sway3"};
// Of the ablation: all kinds of ground, and flight.
const std::vector<std::string> kAblationSequences{"flat1", "wave1", "wave2", "slope", "lawn", "fly1"};
constexpr int kSeeds = 5;

std::vector<std::string> sequences_of(const ExperimentsArguments& args) {
  const std::vector<std::string>& known = paper::paper_sequences();
  if (args.only.empty()) {
    if (args.quick) return kQuickSequences;
    return args.ablation ? kAblationSequences : known;
  }
  for (const std::string& name : args.only) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    std::string refusal = "--only: no sequence '";
    refusal.append(name).append("'; there are");
    for (const std::string& one : known) refusal.append(one == known.front() ? " " : ", ").append(one);
    throw std::invalid_argument(refusal);
  }
  return args.only;
}

/// The options that the figures depend on, as one would type them.
std::string command_of(const ExperimentsArguments& args, const std::vector<std::string>& sequences) {
  const paper::Conditions& c = args.conditions;
  std::string command = "ear experiments";
  if (!args.only.empty()) {
    command += " --only ";
    for (const std::string& name : sequences) command += (name == sequences.front() ? "" : ",") + name;
  } else if (args.quick) {
    command += " --quick";
  }
  if (args.ablation) command += " --ablation";
  if (c.tracks) command += " --tracks";
  if (c.duration) command += " --duration " + paper::number_text(*c.duration);
  return command + " --seeds " + std::to_string(c.seeds.size()) + " --first-seed " + std::to_string(args.first_seed);
}

std::string markdown_of(const std::vector<paper::Table>& tables, const paper::Origin& origin) {
  std::string text = "    " + origin.command + "\n\nOn " + origin.kind +
                     ". Median of the seeds, in brackets the worst. Estimator " + origin.estimator + ", simulator " +
                     origin.simulator + ".\n";
  for (const paper::Table& table : tables) text += "\n" + paper::to_markdown(table);
  return text;
}

void run_experiments(ExperimentsArguments args) {
  cv::setNumThreads(1);  // the same result whatever the machine
  const std::vector<std::string> sequences = sequences_of(args);
  paper::Conditions& conditions = args.conditions;
  conditions.keep_recordings = !args.discard_recordings;
  const int seeds = args.seeds.value_or(args.quick ? 1 : kSeeds);
  for (int i = 0; i < seeds; ++i) conditions.seeds.push_back(args.first_seed + static_cast<std::uint64_t>(i));

  const std::vector<paper::TableDefinition> definitions =
      args.ablation ? paper::ablation_tables(sequences, conditions.tracks) : paper::paper_tables(sequences);
  const std::vector<paper::Setup> setups = paper::setups_of(definitions);
  const std::size_t made = paper::measure(conditions, setups);

  std::vector<std::pair<paper::Setup, std::vector<paper::Result>>> measured;
  measured.reserve(setups.size());
  for (const paper::Setup& setup : setups) measured.emplace_back(setup, paper::results_of(conditions, setup));
  const paper::Lookup lookup = [&](const paper::Setup& setup) -> const std::vector<paper::Result>& {
    return std::find_if(measured.begin(), measured.end(), [&](const auto& m) { return m.first == setup; })->second;
  };
  const std::vector<paper::Table> tables = paper::fill(definitions, lookup);
  const paper::Origin origin{command_of(args, sequences), conditions.tracks ? "feature tracks" : "rendered images",
                             conditions.seeds, paper::estimator_sources(), paper::simulator_sources()};
  paper::write_complete(conditions.out / "results.md", markdown_of(tables, origin));
  paper::write_complete(conditions.out / "results.json", paper::to_json(tables, origin));
  paper::write_complete(conditions.out / "report.html", paper::to_html(tables, origin, setups, lookup));
  std::printf("%zu of %zu runs measured, the others were there: %s\n", made, setups.size() * conditions.seeds.size(),
              (conditions.out / "report.html").c_str());
}

}  // namespace

void add_experiments_command(CLI::App& app) {
  const auto args = std::make_shared<ExperimentsArguments>();
  paper::Conditions& conditions = args->conditions;
  conditions.out = "ear-experiments";
  CLI::App* command =
      app.add_subcommand("experiments", "the paper's tables and figures, or the ablation (docs/results.md)");
  command->add_option("--only", args->only, "sequences, with commas; else all fifteen")->delimiter(',');
  command->add_option("--seeds", args->seeds, "how many; 5, with --quick 1")->check(CLI::Range(1, 1000));
  command->add_option("--first-seed", args->first_seed, "they count up from here")->capture_default_str();
  command->add_flag("--quick", args->quick, "three sequences, one seed: within ten minutes on two cores");
  command->add_flag("--ablation", args->ablation, "what each ingredient gives at 30, 15, 10 and 5 Hz, instead");
  command->add_flag("--tracks", conditions.tracks,
                    "feature tracks in memory, not rendered images: seconds, not minutes");
  command->add_option("--duration", conditions.duration, "[s] stop each sequence earlier")->check(CLI::PositiveNumber);
  command->add_option("--threads", conditions.threads, "recordings at a time; the figures do not depend on it")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--discard-recordings", args->discard_recordings,
                    "delete each recording after its runs: of 0.5 to 1.5 GB each few are there at a time");
  command->add_option("--out", conditions.out, "folder for report.html, results.md, results.json and what was measured")
      ->capture_default_str();
  command->callback([args] { run_experiments(*args); });
}

}  // namespace ear::tools
