// track_accuracy: the filter's accuracy and consistency on simulated feature tracks, without images and files.
//
//   track_accuracy --sequences flat1,fly1 --seeds 501..505 --calibration both --rate 30,10 --config a.yaml
//
// One row of a Markdown table per sequence, camera rate, calibration and configuration file, over all seeds.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "src/recording/config_fields.h"
#include "src/recording/config_file.h"
#include "tools/benchmarks/program.h"
#include "tools/estimators.h"
#include "tools/evaluation/alignment.h"
#include "tools/experiments/in_parallel.h"
#include "tools/experiments/seeds.h"
#include "tools/experiments/table.h"
#include "tools/progress.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {
namespace {

struct Arguments {
  std::vector<std::string> sequences{"all"};
  std::vector<std::string> seeds{"501..505"};
  std::string calibration = "both";
  double calibration_error = 1.0;  ///< of the wrong one
  std::vector<OdometerModel> odometers;
  std::vector<std::string> estimators;
  bool without_camera = false;
  std::vector<double> rates{30.0};
  std::vector<std::filesystem::path> configs;
  evaluation::AlignmentKind alignment = evaluation::AlignmentKind::yaw;
  std::optional<double> duration;
  std::vector<std::string> faults;
  double track_sigma_px = simulator::Options{}.track.sigma_px;
  bool perfect_sensors = false;
  int threads = 2;
  bool json = false;
};

/// How the filter is set up on every simulation.
struct Variant {
  bool true_calibration = true;
  std::string settings;
  FilterConfig config;
  EstimatorChoice estimator = {};
};

std::vector<simulator::Options> simulations_of(const Arguments& args) {
  const bool all = args.sequences == std::vector<std::string>{"all"};
  std::vector<simulator::Options> simulations;
  for (const std::string& sequence : all ? simulator::sequence_names() : args.sequences) {
    for (const double rate : args.rates) {
      for (const std::uint64_t seed : parse_seeds(args.seeds)) {
        simulator::Options options;
        options.sequence = sequence;
        options.seed = seed;
        options.camera_rate_hz = rate;
        options.duration = args.duration;
        options.track.sigma_px = args.track_sigma_px;
        options.sensor_noise = !args.perfect_sensors;
        for (const std::string& fault : args.faults) options.faults.push_back(simulator::parse_fault(fault));
        simulations.push_back(options);
      }
    }
  }
  return simulations;
}

/// The settings of every file, with every odometer model that was asked for.
std::vector<Variant> settings_of(const Arguments& args) {
  std::vector<Variant> files;
  if (args.configs.empty()) files.push_back({true, "default", FilterConfig{}});
  for (const std::filesystem::path& file : args.configs) {
    files.push_back({true, file.stem().string(), load_config(file).filter});
  }
  if (args.odometers.empty()) return files;
  std::vector<Variant> settings;
  for (const OdometerModel model : args.odometers) {
    for (Variant variant : files) {
      variant.config.odometer.model = model;
      settings.push_back(variant);
    }
  }
  return settings;
}

/// `settings` once for each estimator that was asked for; those are timed.
std::vector<Variant> with_estimators(const Arguments& args, const std::vector<Variant>& settings) {
  if (args.estimators.empty()) return settings;
  std::vector<Variant> variants;
  for (Variant variant : settings) {
    const std::string name = variant.settings;
    for (const std::string& estimator : args.estimators) {
      variant.settings = estimator;
      if (name != "default") variant.settings.append(" ").append(name);
      variant.estimator = {tools::estimator_named(estimator), true};
      variants.push_back(variant);
    }
  }
  return variants;
}

std::vector<Variant> variants_of(const Arguments& args) {
  std::vector<Variant> variants;
  for (const bool true_calibration : {true, false}) {
    if (args.calibration == (true_calibration ? "wrong" : "true")) continue;
    for (Variant variant : with_estimators(args, settings_of(args))) {
      variant.true_calibration = true_calibration;
      variants.push_back(variant);
    }
  }
  return variants;
}

/// All variants on the same drive: the calibration told changes no sample but those of the accelerometer, by its bias.
std::vector<Run> run(const simulator::Options& options, const std::vector<Variant>& variants, const Arguments& args) {
  std::optional<simulator::Simulation> simulation;
  std::vector<Run> runs;
  for (const Variant& variant : variants) {
    const double calibration_error = variant.true_calibration ? 0.0 : args.calibration_error;
    if (!simulation || simulation->options().calibration_error != calibration_error) {
      simulator::Options told_options = options;
      told_options.calibration_error = calibration_error;
      simulation.emplace(told_options);
    }
    Calibration told = simulation->calibration();
    if (args.without_camera) told.cameras.clear();
    const Setup setup{options.sequence, options.camera_rate_hz, name_of(variant.config.odometer.model),
                      variant.true_calibration, variant.settings};
    runs.push_back(
        {setup, options.seed, measure(*simulation, told, variant.config, args.alignment, {}, variant.estimator)});
  }
  return runs;
}

void track_accuracy(const Arguments& args) {
  const std::vector<simulator::Options> simulations = simulations_of(args);
  const std::vector<Variant> variants = variants_of(args);
  std::vector<std::vector<Run>> results(simulations.size());
  std::mutex mutex;
  std::size_t done = 0;
  tools::Progress progress;
  in_parallel(simulations.size(), args.threads, [&](std::size_t i) {
    results[i] = run(simulations[i], variants, args);
    const std::lock_guard<std::mutex> lock(mutex);
    progress.show(std::to_string(++done) + " of " + std::to_string(simulations.size()) + " simulations");
  });
  progress.finish();

  std::vector<Run> runs;
  for (const std::vector<Run>& result : results) runs.insert(runs.end(), result.begin(), result.end());
  std::cout << (args.json ? to_json(runs) : to_markdown(runs));
}

int parse_and_run(int argc, char** argv) {
  using evaluation::AlignmentKind;
  const std::map<std::string, AlignmentKind> alignments{
      {"se3", AlignmentKind::se3}, {"yaw", AlignmentKind::yaw}, {"none", AlignmentKind::none}};
  Arguments args;
  CLI::App app{"track_accuracy: accuracy and consistency of the filter on simulated feature tracks", "track_accuracy"};
  app.add_option("--sequences", args.sequences, "a,b,.. or all")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", args.seeds, "7 or 501..505, several with commas")->delimiter(',')->capture_default_str();
  app.add_option("--calibration", args.calibration, "that the filter is told")
      ->check(CLI::IsMember({"true", "wrong", "both"}))
      ->capture_default_str();
  app.add_option("--calibration-error", args.calibration_error, "of the wrong one, as in ear simulate")
      ->capture_default_str();
  std::map<std::string, OdometerModel> models;
  for (const auto& [name, model] : names_of(OdometerModel{})) models.emplace(name, model);
  app.add_option("--odometer", args.odometers, "none, differential, gyro or terrain, several with commas; else as set")
      ->delimiter(',')
      ->transform(CLI::CheckedTransformer(models).description(""));
  app.add_option("--estimator", args.estimators, "filter or smoother, both with a comma: a row for each, with its time")
      ->delimiter(',')
      ->check(CLI::IsMember(tools::estimator_names()));
  app.add_flag("--without-camera", args.without_camera, "the other sensors alone, an estimate at the camera's rate");
  app.add_option("--rate", args.rates, "of the camera [Hz], several with commas")
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--config", args.configs, "settings, several with commas: a row for each")
      ->delimiter(',')
      ->check(CLI::ExistingFile);
  app.add_option("--align", args.alignment, "se3, yaw or none, as in ear evaluate")
      ->transform(CLI::CheckedTransformer(alignments, CLI::ignore_case).description(""))
      ->default_str("yaw");
  app.add_option("--duration", args.duration, "[s] stop earlier");
  app.add_option("--fault", args.faults, "what goes wrong, as in ear simulate; may be repeated");
  app.add_option("--track-sigma", args.track_sigma_px, "[px] noise of the tracks: small for the bound that they set")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--perfect-sensors", args.perfect_sensors,
               "IMU without noise and biases, encoders and lasers without noise and faults");
  app.add_option("--threads", args.threads, "the figures do not depend on it")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--json", args.json, "every run's figures as JSON instead of a table");
  return tools::run_program(app, argc, argv, [&] { track_accuracy(args); });
}

}  // namespace
}  // namespace ear::experiments

int main(int argc, char** argv) { return ear::tools::run_main(ear::experiments::parse_and_run, argc, argv); }
