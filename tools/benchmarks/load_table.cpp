// load_table: what each load step (src/load_governor.h) saves of a frame, and what it costs in accuracy.
//
//   load_table --sequences flat1,fly1 --seeds 501..503 --images 12
//
// One row of a Markdown table per step. Cost: CPU time of the pipeline per frame of the camera, on the first seconds of
// each sequence, rendered in memory. Accuracy: the filter on the feature tracks of whole sequences.
#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdio>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "ear/odometry.h"
#include "filter/filter.h"
#include "src/load_governor.h"
#include "tools/benchmarks/program.h"
#include "tools/evaluation/evaluate.h"
#include "tools/experiments/sample_feed.h"
#include "tools/experiments/seeds.h"
#include "tools/experiments/simulation_truth.h"
#include "tools/experiments/statistics.h"
#include "tools/processor_time.h"
#include "tools/simulator/film.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {
namespace {

constexpr double kBudget = 1.0;   // [s] of a clock that is not the machine's
constexpr double kContent = 0.8;  // of the budget: keeps the step
constexpr int kWarmUp = 10;       // frames that are not counted
constexpr double kRate = 30.0;    // of the camera [Hz]

struct Arguments {
  std::vector<std::string> sequences{"flat1", "fly1"};
  std::vector<std::string> seeds{"501..503"};
  double images = 12.0;  // [s]
};

LoadLimits full() { return {FrontendConfig{}.max_features, FilterConfig{}.window, 1, 1}; }

LoadGovernor at_step(int step) {
  LoadGovernor load(kBudget, full());
  while (load.step() < step) load.add(2.0 * kBudget, 0);
  return load;
}

simulator::Simulation simulate(const std::string& sequence, std::uint64_t seed) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.camera_rate_hz = kRate;
  options.calibration_error = 1.0;
  return simulator::Simulation(options);
}

/// RMS of the position error on feature tracks [m].
double track_error(const simulator::Simulation& simulation, int step) {
  const LoadLimits limits = at_step(step).limits();
  Filter filter(FilterConfig{}, simulation.calibration());
  evaluation::Estimate estimate;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    hand_over(simulation, delivery, filter);
    if (delivery.stream != simulator::SensorStream::camera) continue;
    const auto turn = static_cast<int>(delivery.index);
    if (turn % limits.frame_every != 0) continue;
    FeatureFrame frame = simulation.tracks(delivery.index);
    // Ids grow: the oldest come first.
    const auto most = static_cast<std::size_t>(limits.max_features);
    if (frame.features.size() > most) frame.features.resize(most);
    if (turn / limits.frame_every % limits.stereo_every != 0) {
      frame.right_skipped = true;
      for (FeatureObservation& feature : frame.features) feature.has_right = false;
    }
    filter.set_window(limits.window);
    if (const auto result = filter.process(frame)) append(estimate, *result);
  }
  std::vector<TimeNs> times;
  for (const evaluation::Pose& pose : estimate.poses) times.push_back(pose.t_ns);
  const SimulationTruth truth = truth_of(simulation, times);
  return evaluation::evaluate(estimate, truth.poses, evaluation::AlignmentKind::yaw, truth.terrain).position_rmse;
}

/// The first seconds of a sequence.
simulator::Options beginning(const std::string& sequence, double duration) {
  simulator::Options options;
  options.sequence = sequence;
  options.duration = duration;
  options.camera_rate_hz = kRate;
  options.calibration_error = 1.0;
  return options;
}

/// Mean CPU time of the pipeline per frame of the camera [ms].
double cost(const simulator::Film& film, int step) {
  Config config;
  config.performance.budget_ms = 1e3 * kBudget;
  int reached = 0;
  bool running = false;
  double now = 0.0;
  const Clock clock = [&] {  // asked before and after a frame: dear until the step is reached, then as it should be
    if (running) now += reached < step ? 20.0 * kBudget : kContent * kBudget * at_step(step).limits().frame_every;
    running = !running;
    return now;
  };
  Odometry odometry(config, film.simulation.calibration(), clock);
  double total = 0.0;
  int frames = 0, since = 0;
  for (const simulator::Delivery& delivery : film.simulation.deliveries()) {
    const double start = tools::process_time();
    hand_over(film.simulation, delivery, odometry);
    const bool image = delivery.stream == simulator::SensorStream::camera;
    if (image) odometry.add_stereo(film.frame(delivery.index));
    const double duration = tools::process_time() - start;
    reached = odometry.health().load_step;
    since += image && reached == step ? 1 : 0;
    if (since <= kWarmUp) continue;
    total += duration;
    frames += image ? 1 : 0;
  }
  return 1e3 * total / frames;
}

void print_header(const Arguments& args) {
  std::printf("| step | features | clones | right image of | frames used |");
  for (const std::string& sequence : args.sequences) std::printf(" %s: ms | ATE [m] |", sequence.c_str());
  std::printf("\n|---|---|---|---|---|");
  for (std::size_t i = 0; i < args.sequences.size(); ++i) std::printf("---|---|");
  std::printf("\n");
}

void load_table(const Arguments& args) {
  cv::setNumThreads(1);
  std::vector<std::vector<simulator::Simulation>> simulations;
  std::vector<simulator::Film> films;
  for (const std::string& sequence : args.sequences) {
    films.emplace_back(beginning(sequence, args.images));
    simulations.emplace_back();
    for (const std::uint64_t seed : parse_seeds(args.seeds)) simulations.back().push_back(simulate(sequence, seed));
  }
  print_header(args);
  for (int step = 0; step <= LoadGovernor::kLastStep; ++step) {
    const LoadLimits limits = at_step(step).limits();
    std::printf("| %d | %d | %d | 1/%d | 1/%d |", step, limits.max_features, limits.window, limits.stereo_every,
                limits.frame_every);
    for (std::size_t i = 0; i < films.size(); ++i) {
      std::vector<double> errors;
      for (const simulator::Simulation& simulation : simulations[i]) errors.push_back(track_error(simulation, step));
      std::printf(" %.2f | %.3f |", cost(films[i], step), median(errors));
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

int parse_and_run(int argc, char** argv) {
  Arguments args;
  CLI::App app{"load_table: what each load step saves, and what it costs in accuracy", "load_table"};
  app.add_option("--sequences", args.sequences, "a,b,..")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", args.seeds, "7 or 501..505, of the tracks")->delimiter(',')->capture_default_str();
  app.add_option("--images", args.images, "[s] that are rendered of each sequence")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  return tools::run_program(app, argc, argv, [&] { load_table(args); });
}

}  // namespace
}  // namespace ear::experiments

int main(int argc, char** argv) { return ear::tools::run_main(ear::experiments::parse_and_run, argc, argv); }
