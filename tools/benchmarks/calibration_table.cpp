// calibration_table: what `ear calibrate` makes of drawn vehicles, on simulated feature tracks.
//
//   calibration_table --seeds 501..510 --sequence calibrate --calibration-error 5
//
// One row of a Markdown table per parameter: prior, posterior, error, normalized error, refusals.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <mutex>
#include <string>
#include <vector>

#include "calibration/calibrate.h"
#include "tools/benchmarks/program.h"
#include "tools/calibration/simulated_drive.h"
#include "tools/experiments/figures.h"
#include "tools/experiments/in_parallel.h"
#include "tools/experiments/seeds.h"
#include "tools/progress.h"

namespace ear::experiments {
namespace {

struct Arguments {
  std::string sequence = "calibrate";
  std::vector<std::string> seeds{"501..505"};
  double calibration_error = 5.0;
  std::optional<double> duration;
  int threads = 2;
  bool verbose = false;
  bool perfect_sensors = false;
  double track_sigma = 0.5;
  double interval = calibration::Settings{}.interval;
  std::vector<std::string> drives;  ///< that the calibrated filter is measured on
};

/// Of one parameter over all vehicles.
struct Row {
  std::string name, unit;
  double prior = 0.0, posterior = 0.0, mean = 0.0, squares = 0.0, normalized = 0.0, worst = 0.0;
  int count = 0, shown = 0;
};

void add(std::vector<Row>& rows, const calibration::Result& result, const std::vector<double>& errors) {
  rows.resize(result.findings.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Row& row = rows[i];
    const calibration::Finding& finding = result.findings[i];
    row.name = finding.name;
    row.unit = finding.unit;
    row.prior = finding.prior;
    row.posterior += finding.posterior;
    const double normalized = errors[i] / finding.posterior;
    row.mean += errors[i];
    row.squares += errors[i] * errors[i];
    row.normalized += normalized * normalized;
    row.worst = std::max(row.worst, std::abs(normalized));
    row.shown += finding.shown ? 1 : 0;
    ++row.count;
  }
}

/// The filter on another drive of the same vehicle, by one calibration.
struct OtherDrive {
  std::string sequence, told;
  double ate = 0.0, nees = 0.0;
};

std::vector<OtherDrive> drive_on(const Arguments& args, const simulator::Options& calibrated_on,
                                 const calibration::Result& result) {
  std::vector<OtherDrive> figures;
  for (const std::string& sequence : args.drives) {
    simulator::Options options = calibrated_on;
    options.sequence = sequence;
    options.duration.reset();
    const simulator::Simulation simulation(options);
    const calibration::Priors priors = calibration::drawn_priors(args.calibration_error);
    const Calibration given = calibration::with_priors(simulation.calibration(), priors);
    const auto measured = [&](const std::string& told, const Calibration& calibration) {
      Calibration same_biases = calibration;
      same_biases.imu.accel_bias_sigma = result.calibration.imu.accel_bias_sigma;  // as large whatever the calibration
      const Figures run = measure(simulation, same_biases, FilterConfig{}, evaluation::AlignmentKind::yaw);
      figures.push_back({sequence, told, run.ate_rmse.value_or(NAN), run.nees_position.value_or(NAN)});
    };
    measured("given", given);
    measured("calibrated", result.calibration);
    measured("true", simulation.true_calibration());
  }
  return figures;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return NAN;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void print(const Arguments& args, const std::vector<OtherDrive>& figures) {
  if (args.drives.empty()) return;
  std::printf("\n| drive | calibration | ATE, median [m] | NEES of position, mean |\n|---|---|---|---|\n");
  for (const std::string& sequence : args.drives) {
    for (const char* told : {"given", "calibrated", "true"}) {
      std::vector<double> ate;
      double nees = 0.0;
      for (const OtherDrive& figure : figures) {
        if (figure.sequence != sequence || figure.told != told) continue;
        ate.push_back(figure.ate);
        nees += figure.nees;
      }
      std::printf("| %s | %s | %.4f | %.2f |\n", sequence.c_str(), told, median_of(ate),
                  nees / static_cast<double>(ate.size()));
    }
  }
}

void print(const std::vector<Row>& rows) {
  std::printf(
      "| | unit | prior | posterior | mean error | RMS error | mean squared normalized error | largest | shown |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    const double n = row.count;
    std::printf("| %s | %s | %.3g | %.3g | %+.3g | %.3g | %.2f | %.1f | %d of %d |\n", row.name.c_str(),
                row.unit.c_str(), row.prior, row.posterior / n, row.mean / n, std::sqrt(row.squares / n),
                row.normalized / n, row.worst, row.shown, row.count);
  }
}

void calibration_table(const Arguments& args) {
  const std::vector<std::uint64_t> seeds = parse_seeds(args.seeds);
  std::vector<Row> rows;
  std::vector<OtherDrive> others;
  std::mutex mutex;
  std::size_t done = 0;
  tools::Progress progress;
  in_parallel(seeds.size(), args.threads, [&](std::size_t i) {
    simulator::Options options;
    options.sequence = args.sequence;
    options.seed = seeds[i];
    options.duration = args.duration;
    options.calibration_error = args.calibration_error;
    options.sensor_noise = !args.perfect_sensors;
    options.track.sigma_px = args.track_sigma;
    const simulator::Simulation simulation(options);
    const auto start = std::chrono::steady_clock::now();
    calibration::Settings settings;
    settings.threads = 1;
    settings.interval = args.interval;
    if (args.verbose) settings.progress = [](const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); };
    const calibration::SimulatedCalibration made = calibration::calibrate_simulated(simulation, settings);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    const std::vector<OtherDrive> figures = drive_on(args, options, made.result);
    const std::lock_guard<std::mutex> lock(mutex);
    others.insert(others.end(), figures.begin(), figures.end());
    add(rows, made.result, made.errors);
    if (args.verbose) {
      const calibration::Noise& noise = made.result.noise;
      std::fprintf(stderr, "seed %llu: %.1f s, pixel %.3f slip %.2g beam %.4f\n",
                   static_cast<unsigned long long>(seeds[i]), taken.count(), noise.pixel, noise.roll.slip, noise.beam);
      for (std::size_t k = 0; k < made.errors.size(); ++k) {
        const calibration::Finding& finding = made.result.findings[k];
        std::fprintf(stderr, "  %-45s %10.5f +- %.5f %s, changed by %.5f (%.2f with %s)\n", finding.name.c_str(),
                     made.errors[k], finding.posterior, finding.unit.c_str(), finding.change, finding.correlation,
                     finding.entangled_with.c_str());
      }
    }
    progress.show(std::to_string(++done) + " of " + std::to_string(seeds.size()) + " vehicles");
  });
  progress.finish();
  print(rows);
  print(args, others);
}

int parse_and_run(int argc, char** argv) {
  Arguments args;
  CLI::App app{"calibration_table: calibrations of drawn vehicles", "calibration_table"};
  app.add_option("--sequence", args.sequence, "that they drive, as in ear simulate")->capture_default_str();
  app.add_option("--seeds", args.seeds, "7 or 501..505, several with commas")->delimiter(',')->capture_default_str();
  app.add_option("--calibration-error", args.calibration_error, "as in ear simulate")->capture_default_str();
  app.add_option("--duration", args.duration, "[s] stop earlier");
  app.add_option("--threads", args.threads, "the figures do not depend on it")->capture_default_str();
  app.add_flag("--perfect-sensors", args.perfect_sensors,
               "what the models leave out, alone: no noise but that of the tracks");
  app.add_option("--track-sigma", args.track_sigma, "[px]")->capture_default_str();
  app.add_option("--drives", args.drives, "sequences that the filter then drives, by each calibration")->delimiter(',');
  app.add_option("--interval", args.interval, "[s] between keyframes")->capture_default_str();
  app.add_flag("--verbose", args.verbose, "steps, times and noise on standard error");
  return tools::run_program(app, argc, argv, [&] { calibration_table(args); });
}

}  // namespace
}  // namespace ear::experiments

int main(int argc, char** argv) { return ear::tools::run_main(ear::experiments::parse_and_run, argc, argv); }
