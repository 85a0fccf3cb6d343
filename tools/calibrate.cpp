// ear calibrate RECORDING...: wheels, beams, cameras and clocks from drives, and what the drives did not show.
#include <opencv2/core/utility.hpp>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "calibration/allan.h"
#include "calibration/calibrate.h"
#include "calibration/stated.h"
#include "calibration/wanted_motion.h"
#include "src/recording/calibration_files.h"
#include "src/recording/calibration_writer.h"
#include "src/recording/config_file.h"
#include "src/recording/input_error.h"
#include "src/recording/recording.h"
#include "tools/calibration/recorded_drive.h"
#include "tools/calibration/report.h"
#include "tools/calibration/result_text.h"
#include "tools/commands.h"
#include "tools/input_options.h"
#include "tools/opened_recording.h"
#include "tools/progress.h"

namespace ear::tools {
namespace {

namespace fs = std::filesystem;

struct CalibrateArguments {
  std::vector<fs::path> recordings;
  fs::path out = "ear-calibration";
  fs::path config;
  std::vector<fs::path> calibration;
  std::vector<fs::path> reference;
  double reference_sigma = 1.0;
  fs::path imu;
  fs::path moving;
  fs::path report;
  bool plan = false;
  int threads = 2;
};

constexpr double kDegree = 3.14159265358979323846 / 180.0;

void write_text(const fs::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  stream.close();
  if (!stream) throw InputError(located(file, 0, "", "cannot be written"));
}

/// Of each beam, the mean of its axes.
std::vector<BeamSigma> beam_sigmas(const calibration::Result& result) {
  std::vector<BeamSigma> sigmas;
  if (!result.calibration.lasers) return sigmas;
  for (const LaserBeam& beam : result.calibration.lasers->beams) {
    const auto mean = [&](const std::string& what) {
      return calibration::mean_sigma(result.findings, "laser0 " + beam.name + ": " + what).value_or(0.0);
    };
    sigmas.push_back({1e-3 * mean("origin"), kDegree * mean("direction")});
  }
  return sigmas;
}

calibration::Drive read_drive(const fs::path& path, const CalibrateArguments& args, const Config& config,
                              std::optional<Calibration>& given, Progress& progress) {
  const OpenedRecording opened(path, args.config);
  RecordingOptions options;
  options.calibration_files = args.calibration;
  Recording recording = opened.read(options);
  if (const auto missing = check_sensors(recording.calibration())) {
    throw InputError(located(path, 0, missing->where, missing->message));
  }
  if (!given) given = recording.calibration();
  const bool same = given->cameras.size() == recording.calibration().cameras.size() &&
                    given->encoder.has_value() == recording.calibration().encoder.has_value() &&
                    given->lasers.has_value() == recording.calibration().lasers.has_value();
  if (!same) throw InputError(located(path, 0, "", "other sensors than the recording before: one vehicle at a time"));
  return calibration::recorded_drive(recording, path.string(), config, [&](double share) {
    progress.show(path.string() + ": " + std::to_string(static_cast<int>(100.0 * share)) + " % read");
  });
}

void calibrate_drives(const CalibrateArguments& args) {
  cv::setNumThreads(1);
  const Config config = args.config.empty() ? Config{} : load_config(args.config);
  const auto start = std::chrono::steady_clock::now();
  Progress progress;
  std::vector<calibration::Drive> drives;
  std::optional<Calibration> given;
  for (const fs::path& path : args.recordings) drives.push_back(read_drive(path, args, config, given, progress));
  if (args.reference.size() > drives.size()) throw InputError("--reference: more files than recordings");
  for (std::size_t i = 0; i < args.reference.size(); ++i) {
    calibration::add_reference(args.reference[i], args.reference_sigma, drives[i]);
  }
  calibration::Settings settings;
  settings.filter = config.filter;
  settings.threads = args.threads;
  settings.progress = [&](const std::string& line) { progress.show(line); };
  const calibration::Result result = calibration::calibrate(*given, calibration::priors_of(*given), drives, settings);
  progress.finish();

  fs::create_directories(args.out);
  write_calibration(result.calibration, args.out, "by ear calibrate", beam_sigmas(result));
  const std::string text = calibration::to_text(result);
  write_text(args.out / "calibration.txt", text);
  write_text(args.out / "calibration.json", calibration::to_json(result));
  if (!args.report.empty()) write_text(args.report, calibration::to_html(args.recordings.front().string(), result));
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  std::printf("%s%.1f s: %s\n", text.c_str(), taken.count(), args.out.c_str());
}

std::vector<ImuSample> read_imu(const fs::path& path, const CalibrateArguments& args) {
  const OpenedRecording opened(path, args.config);
  RecordingOptions options;
  options.accept_bad_calibration = true;
  Recording recording = opened.read(options);
  std::vector<ImuSample> imu;
  while (const std::optional<Sample> sample = recording.next()) {
    if (const auto* inertial = std::get_if<ImuSample>(&*sample)) imu.push_back(*inertial);
  }
  return imu;
}

void calibrate_imu(const CalibrateArguments& args) {
  const calibration::ImuNoise noise = calibration::noise_at_rest(read_imu(args.imu, args));
  std::string text = calibration::to_text(noise);
  std::optional<calibration::MotionNoise> motion;
  if (!args.moving.empty()) {
    motion = calibration::noise_in_motion(noise, read_imu(args.moving, args));
    text += calibration::to_text(*motion);
  }
  fs::create_directories(args.out);
  write_text(args.out / "imu_noise.json", calibration::to_json(noise, motion));
  std::printf("%s%s\n", text.c_str(), (args.out / "imu_noise.json").c_str());
}

void calibrate(const CalibrateArguments& args) {
  if (args.plan) {
    std::printf("%s", calibration::recommended_drive().c_str());
    return;
  }
  if (!args.imu.empty()) {
    calibrate_imu(args);
    return;
  }
  if (!args.moving.empty()) throw InputError("--moving: noise in motion is told against that at rest, --imu");
  if (args.recordings.empty()) throw InputError("ear calibrate: a RECORDING is needed, or --imu, or --plan");
  calibrate_drives(args);
}

}  // namespace

void add_calibrate_command(CLI::App& app) {
  auto* command =
      app.add_subcommand("calibrate", "Wheels, beams, cameras and clocks from drives (docs/calibration.md)");
  auto args = std::make_shared<CalibrateArguments>();
  command->add_option("RECORDING", args->recordings, "Drives of one vehicle; the first one's calibration is the start");
  command->add_option("--out", args->out, "Folder for sensor.yaml files, calibration.txt and calibration.json")
      ->capture_default_str();
  add_config_option(*command, args->config);
  add_calibration_option(*command, args->calibration);
  command->add_option("--reference", args->reference, "Positions that something else measured, one file per RECORDING")
      ->check(CLI::ExistingPath);
  command->add_option("--reference-sigma", args->reference_sigma, "Of one such position, one axis [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--report", args->report, "HTML page: residuals before and after, hits of beams");
  command->add_option("--imu", args->imu, "A recording at rest: the noise of the IMU, and nothing else");
  command->add_option("--moving", args->moving,
                      "With --imu: a hover or a drive; how much noisier the IMU is in motion");
  command->add_flag("--plan", args->plan, "Print the drive to make");
  command->add_option("--threads", args->threads, "For the batch estimate")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([args] { calibrate(*args); });
}

}  // namespace ear::tools
