// ear run RECORDING: replays a recording through the estimator; writes the trajectory and what explains it.
#include <opencv2/core/utility.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "src/health_text.h"
#include "src/log/log.h"
#include "src/recording/calibration_files.h"
#include "src/recording/config_fields.h"
#include "src/recording/config_file.h"
#include "src/recording/input_error.h"
#include "src/recording/recording.h"
#include "src/recording/start_file.h"
#include "src/recording/writers.h"
#include "tools/commands.h"
#include "tools/estimators.h"
#include "tools/flight_controller.h"
#include "tools/input_options.h"
#include "tools/opened_recording.h"
#include "tools/program_config.h"
#include "tools/progress.h"
#include "tools/replay.h"
#include "tools/run_view.h"

namespace ear::tools {
namespace {

struct RunArguments {
  std::filesystem::path recording;
  std::filesystem::path out = "ear-run";
  std::filesystem::path config;
  std::vector<std::filesystem::path> calibration;
  std::filesystem::path start;
  double camera_rate_hz = 0.0;
  bool mono = false;
  std::optional<OdometerModel> odometer;
  std::string estimator = "filter";
  FlightControllerArguments flight_controller;
  RunViewArguments view;
};

constexpr std::size_t kMostChanges = 1000;  // of the health, in summary.json

/// What happened over the whole run.
struct Totals {
  std::uint64_t frames = 0;
  std::uint64_t estimates = 0;
  std::uint64_t standing = 0;
  std::uint64_t reduced = 0;  ///< frames with work left out to keep the budget, or left out themselves
  int most_reduced = 0;       ///< the largest load step
  std::uint64_t features_used = 0;
  std::uint64_t features_rejected = 0;
  std::uint64_t wheel_rows_used = 0;
  std::uint64_t wheel_rows_rejected = 0;
  std::uint64_t beams_used = 0;
  std::uint64_t beams_rejected = 0;
  StageTimes times;
  std::vector<HealthChange> health;

  void add(TimeNs t_ns, const Health& said) {
    const std::string text = to_text(said);
    const bool changed = health.empty() || health.back().text != text;
    if (changed && health.size() < kMostChanges) health.push_back({t_ns, text});
    reduced += said.load_step > 0 ? 1 : 0;
    most_reduced = std::max(most_reduced, said.load_step);
  }

  void add(const ReplayedFrame& frame, const StageTimes& stages) {
    ++frames;
    times.pyramid += stages.pyramid;
    times.track += stages.track;
    times.detect += stages.detect;
    times.stereo += stages.stereo;
    times.reject += stages.reject;
    times.filter += stages.filter;
    if (!frame.estimate) return;
    ++estimates;
    standing += frame.estimate->frame.standing ? 1 : 0;
    features_used += static_cast<std::uint64_t>(frame.estimate->frame.features_used);
    features_rejected += static_cast<std::uint64_t>(frame.estimate->frame.features_rejected);
    wheel_rows_used += static_cast<std::uint64_t>(frame.estimate->frame.wheel_rows_used);
    wheel_rows_rejected += static_cast<std::uint64_t>(frame.estimate->frame.wheel_rows_rejected);
    beams_used += static_cast<std::uint64_t>(frame.estimate->frame.beams_used);
    beams_rejected += static_cast<std::uint64_t>(frame.estimate->frame.beams_rejected);
  }
};

/// Why there is no estimate.
std::string status_text(const Odometry& odometry) {
  const char* const reason = to_text(odometry.health().reason);
  return odometry.status() == Status::lost ? std::string("lost: ") + reason
                                           : std::string("cannot start yet: ") + reason;
}

std::string progress_line(const ReplayedFrame& frame, const Odometry& odometry, const TimeSpan& span,
                          double wall_time) {
  const double done = seconds_between(span.first_ns, frame.t_ns);
  std::array<char, 200> line{};
  const int length = std::snprintf(line.data(), line.size(), "%3.0f %%  %5.1f x real time  ",
                                   100.0 * done / seconds_between(span.first_ns, span.last_ns), done / wall_time);
  char* const end = line.data() + length;
  const std::size_t rest = line.size() - static_cast<std::size_t>(length);
  if (frame.estimate) {
    const Eigen::Vector3d& p = frame.estimate->state.p_WB;
    std::snprintf(end, rest, "position %7.2f %7.2f %6.2f m  tracks %3d  %s  %s", p.x(), p.y(), p.z(),
                  frame.estimate->frame.tracks, frame.estimate->frame.standing ? "standing" : "moving",
                  to_text(frame.estimate->health).c_str());
  } else {
    std::snprintf(end, rest, "%s", status_text(odometry).c_str());
  }
  return line.data();
}

/// What a stream delivered, as "imu_accepted", "imu_not_finite", ...
void add_counts(RunSummary& summary, const std::string& stream, const StreamCounts& counts) {
  const auto add = [&](const char* what, std::uint64_t count) { summary.counts.emplace_back(stream + what, count); };
  add("_accepted", counts.accepted);
  add("_not_finite", counts.not_finite);
  add("_implausible", counts.implausible);
  add("_not_later", counts.not_later);
  add("_far_ahead", counts.far_ahead);
  add("_too_late", counts.too_late);
  add("_repeated", counts.repeated);
  add("_gaps", counts.gaps);
}

RunSummary summarize(const RunArguments& args, const Recording& recording, const Odometry& odometry,
                     const Totals& totals, double wall_time) {
  RunSummary summary;
  const InputCounts inputs = odometry.input_counts();
  summary.recording = args.recording.string();
  summary.counts = {{"frames", totals.frames},
                    {"estimates", totals.estimates},
                    {"frames_standing", totals.standing},
                    {"frames_reduced", totals.reduced},
                    {"largest_load_step", static_cast<std::uint64_t>(totals.most_reduced)},
                    {"features_used", totals.features_used},
                    {"features_rejected", totals.features_rejected},
                    {"wheel_rows_used", totals.wheel_rows_used},
                    {"wheel_rows_rejected", totals.wheel_rows_rejected},
                    {"beams_used", totals.beams_used},
                    {"beams_rejected", totals.beams_rejected},
                    {"imu_spikes", inputs.imu_spikes},
                    {"clock_jumps", inputs.clock_jumps},
                    {"wild_features", inputs.features_rejected},
                    {"steps_rejected", inputs.steps_rejected},
                    {"resets", odometry.health().reset_counter}};
  add_counts(summary, "imu", inputs.imu);
  add_counts(summary, "camera", inputs.camera);
  add_counts(summary, "encoder", inputs.encoder);
  add_counts(summary, "laser", inputs.laser);
  summary.duration_s = seconds_between(recording.span().first_ns, recording.span().last_ns);
  summary.wall_time_s = wall_time;
  const StageTimes& t = totals.times;
  summary.stage_times_s = {{"pyramid", t.pyramid}, {"track", t.track},   {"detect", t.detect},
                           {"stereo", t.stereo},   {"reject", t.reject}, {"filter", t.filter}};
  summary.health = totals.health;
  summary.warnings = recording.warnings();
  summary.calibration = odometry.calibration();
  return summary;
}

void run(const RunArguments& args) {
  cv::setNumThreads(1);  // the same result whatever the machine
  Config config = program_config(args.config);
  if (args.odometer) config.filter.odometer.model = *args.odometer;
  RecordingOptions options;
  options.calibration_files = args.calibration;
  options.camera_rate_hz = args.camera_rate_hz;
  options.mono = args.mono;
  const OpenedRecording opened(args.recording, args.config);
  Recording recording = opened.read(options);
  if (const auto missing = check_sensors(recording.calibration())) {
    throw InputError(located(args.recording, 0, missing->where, missing->message));
  }
  std::optional<RunView> view;
  if (args.view.server.port >= 0) view.emplace(args.view, args.recording, recording);
  const MakeEstimator make = estimator_named(args.estimator);
  Odometry odometry = OdometryFactory::make(config, recording.calibration(), view ? view->tapped(make) : make);
  if (!args.start.empty()) odometry.start_at(load_start(args.start, recording.span()));

  std::filesystem::create_directories(args.out);
  TumWriter trajectory(args.out / "estimate.tum");
  StatesWriter states(args.out / "states.csv");
  save_config(config, args.out / "config.yaml");

  std::optional<FlightController> flight_controller;
  if (!args.flight_controller.address.empty()) {
    flight_controller.emplace(args.flight_controller, recording.calibration(), recording.span().first_ns);
  }
  const auto before_sample = [&](const Sample& sample) {
    if (view) view->before_sample(sample);
    if (flight_controller) flight_controller->before_sample(sample, odometry);
  };

  Totals totals;
  Progress progress;
  const auto start = std::chrono::steady_clock::now();
  const auto wall_time = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const auto on_frame = [&](const ReplayedFrame& frame) {
    if (flight_controller) flight_controller->after_frame(frame, odometry);
    if (view) view->after_frame(frame, odometry);
    totals.add(frame, odometry.stage_times());
    totals.add(frame.t_ns, odometry.health());
    if (frame.estimate) {
      trajectory.write(*frame.estimate);
      states.write(*frame.estimate, to_text(frame.estimate->health));
    }
    progress.show(progress_line(frame, odometry, recording.span(), wall_time()));
  };
  replay(recording, odometry, on_frame, before_sample);
  progress.finish();
  write_summary(summarize(args, recording, odometry, totals, wall_time()), args.out / "summary.json");

  std::printf("%llu of %llu frames estimated, %.1f s of recording in %.1f s: %s\n",
              static_cast<unsigned long long>(totals.estimates), static_cast<unsigned long long>(totals.frames),
              seconds_between(recording.span().first_ns, recording.span().last_ns), wall_time(), args.out.c_str());
  if (totals.reduced > 0) {
    std::printf("work was left out at %llu frames to keep %g ms, up to load step %d\n",
                static_cast<unsigned long long>(totals.reduced), config.performance.budget_ms, totals.most_reduced);
  }
  if (flight_controller) std::printf("%s\n", flight_controller->report().c_str());
  if (view) std::printf("%s\n", view->finish().c_str());
  for (const Warning& warning : recording.warnings()) {
    log_warning(warning.kind + ", " + std::to_string(warning.count) + " times, first at " + warning.first);
  }
  if (totals.estimates == 0) {
    throw InputError(args.recording.string() + ": no estimate: " + status_text(odometry));
  }
}

}  // namespace

void add_run_command(CLI::App& app) {
  auto* command = app.add_subcommand("run", "Estimate the trajectory of a recording");
  auto args = std::make_shared<RunArguments>();
  command
      ->add_option("RECORDING", args->recording,
                   "Folder in the EuRoC/ASL layout (docs/recordings.md), or a bag of ROS 1 or 2 (docs/bags.md)")
      ->required();
  command->add_option("--out", args->out, "Folder for estimate.tum, states.csv, summary.json, config.yaml")
      ->capture_default_str();
  add_config_option(*command, args->config);
  add_calibration_option(*command, args->calibration);
  command->add_option("--start", args->start, "Begin with the state in this file (docs/recordings.md)")
      ->check(CLI::ExistingFile);
  command->add_option("--camera-rate", args->camera_rate_hz, "Leave out frames to reach this rate [Hz]")
      ->check(CLI::PositiveNumber);
  command->add_flag("--mono", args->mono, "Ignore the right camera");
  std::map<std::string, OdometerModel> models;
  for (const auto& [name, model] : names_of(OdometerModel{})) models.emplace(name, model);
  command->add_option("--odometer", args->odometer, "What is made of the wheels: none, differential, gyro or terrain")
      ->transform(CLI::CheckedTransformer(models));
  command->add_option("--estimator", args->estimator, "filter, or smoother to compare with (docs/smoother.md)")
      ->check(CLI::IsMember(estimator_names()))
      ->capture_default_str();
  add_options(*command, args->flight_controller);
  add_options(*command, args->view);
  command->callback([args] { run(*args); });
}

}  // namespace ear::tools
