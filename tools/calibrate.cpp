// ear calibrate RECORDING...: wheels, beams, cameras and clocks from drives, and what the drives did not show.
#include <opencv2/core/utility.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/allan.h"
#include "calibration/calibrate.h"
#include "calibration/degree.h"
#include "calibration/wanted_motion.h"
#include "src/log/log.h"
#include "src/recording/calibration_files.h"
#include "src/recording/calibration_writer.h"
#include "src/recording/config_file.h"
#include "src/recording/input_error.h"
#include "src/recording/recording.h"
#include "tools/calibration/board_images.h"
#include "tools/calibration/board_start.h"
#include "tools/calibration/recorded_drive.h"
#include "tools/calibration/report.h"
#include "tools/calibration/result_files.h"
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
  fs::path cameras;
  calibration::PrintedBoard board;
  std::string squares = "10x7";
  std::string lens;
};

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
  calibration::Drive drive = calibration::recorded_drive(recording, path.string(), config, [&](double share) {
    progress.show(path.string() + ": " + std::to_string(static_cast<int>(100.0 * share)) + " % read");
  });
  for (const Warning& warning : recording.warnings()) {
    log_warning(warning.kind + ", " + std::to_string(warning.count) + " times, first at " + warning.first);
  }
  for (const std::string& words : calibration::ends_early(drive)) log_warning(words);
  return drive;
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

  const std::string text = calibration::write_result(result, args.out);
  if (!args.report.empty())
    calibration::write_text(args.report, calibration::to_html(args.recordings.front().string(), result));
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
  calibration::write_text(args.out / "imu_noise.json", calibration::to_json(noise, motion));
  std::printf("%s%s\n", text.c_str(), (args.out / "imu_noise.json").c_str());
}

/// "10x7": columns and rows.
calibration::PrintedBoard board_of(const CalibrateArguments& args) {
  calibration::PrintedBoard board = args.board;
  char rest = 0;
  if (std::sscanf(args.squares.c_str(), "%dx%d%c", &board.shape.columns, &board.shape.rows, &rest) != 2) {
    throw InputError("--board: columns x rows of squares are needed, as in 10x7, not '" + args.squares + "'");
  }
  return board;
}

/// What the recording, or --calibration, says of its cameras; nothing where that is not all of them.
std::optional<Calibration> known_cameras(const fs::path& folder, std::size_t cameras, const CalibrateArguments& args) {
  const fs::path mav0 = fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
  if (args.calibration.empty() && !fs::exists(mav0 / "cam0" / "sensor.yaml")) return std::nullopt;
  Warnings warnings;
  Calibration known = load_calibration(mav0, args.calibration, warnings, CalibrationKind::alone);
  if (known.cameras.size() < cameras) return std::nullopt;
  known.cameras.resize(cameras);
  return known;
}

LensModel lens_of(const CalibrateArguments& args, const std::optional<Calibration>& known) {
  if (args.lens == "equidistant") return LensModel::equidistant;
  if (args.lens.empty() && known) return known->cameras[0].lens;
  return LensModel::radial_tangential;
}

/// A new start for the lenses; where the cameras are, relative to the body, stays as it is known.
void keep_body(const std::optional<Calibration>& known, Calibration& start) {
  const Eigen::Isometry3d T_C0C1 = start.cameras.size() > 1 ? start.cameras[1].T_BC : Eigen::Isometry3d::Identity();
  if (known) {
    start.imu = known->imu;
    start.camera_time_offset = known->camera_time_offset;
    start.camera_time_offset_sigma = known->camera_time_offset_sigma;
    start.cameras[0].T_BC = known->cameras[0].T_BC;
    start.cameras[0].pose_sigma = known->cameras[0].pose_sigma;
    for (std::size_t i = 0; i < start.cameras.size(); ++i) start.cameras[i].rate_hz = known->cameras[i].rate_hz;
  } else {
    start.cameras[0].T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // looks ahead
    start.cameras[0].pose_sigma = PoseSigma{10.0 * calibration::kDegree, 0.1};
  }
  if (start.cameras.size() > 1) start.cameras[1].T_BC = start.cameras[0].T_BC * T_C0C1;
}

/// In words, where the square's size is what may be wrong.
std::string scale_check(const std::optional<Calibration>& known, const Calibration& found) {
  if (!known || found.cameras.size() < 2) return {};
  const auto baseline = [](const Calibration& c) {
    return (c.cameras[1].T_BC.translation() - c.cameras[0].T_BC.translation()).norm();
  };
  const double ratio = baseline(found) / baseline(*known);
  if (!(std::abs(ratio - 1.0) > 0.1)) return {};
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "the baseline is %.2f times the one given: is --square the size of a square?\n", ratio);
  return text.data();
}

void calibrate_cameras(const CalibrateArguments& args) {
  if (const std::string missing = calibration::missing_board_parts(); !missing.empty()) throw InputError(missing);
  const calibration::PrintedBoard board = board_of(args);
  OpenedRecording opened(args.cameras, args.config);
  Progress progress;
  calibration::BoardRecording seen = calibration::find_board(opened.folder(), board, [&](std::size_t images) {
    progress.show(args.cameras.string() + ": " + std::to_string(images) + " images searched");
  });
  progress.finish();
  const std::optional<Calibration> known = known_cameras(opened.folder(), seen.cameras.size(), args);
  Calibration start = calibration::board_start(seen.cameras, lens_of(args, known), board.shape, seen.views);
  keep_body(known, start);
  const calibration::BoardResult result = calibration::calibrate_cameras(start, board.shape, seen.views);

  fs::create_directories(args.out);
  const std::string heading = known ? "by ear calibrate --cameras; T_BS is the one given"
                                    : "by ear calibrate --cameras; T_BS is a guess (looks ahead): state it";
  for (std::size_t i = 0; i < result.calibration.cameras.size(); ++i) {
    write_camera(result.calibration, i, args.out, heading);
  }
  std::string text = calibration::to_text(result) + scale_check(known, result.calibration);
  if (!known)
    text += "Where the cameras sit in the body a board does not show: state T_BS of cam0, then ear calibrate\n";
  calibration::write_text(args.out / "calibration.txt", text);
  calibration::write_text(args.out / "calibration.json", calibration::to_json(result));
  const fs::path report = args.report.empty() ? args.out / "report.html" : args.report;
  calibration::write_text(report, calibration::to_html(args.cameras.string(), result));
  std::printf("%s%s\n", text.c_str(), args.out.c_str());
}

void calibrate(const CalibrateArguments& args) {
  if (args.plan) {
    std::printf("%s", calibration::recommended_drive().c_str());
    return;
  }
  if (!args.cameras.empty()) {
    calibrate_cameras(args);
    return;
  }
  if (!args.imu.empty()) {
    calibrate_imu(args);
    return;
  }
  if (!args.moving.empty()) throw InputError("--moving: noise in motion is told against that at rest, --imu");
  if (args.recordings.empty()) throw InputError("ear calibrate: a RECORDING is needed, or --cameras, --imu, --plan");
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
  command->add_option("--cameras", args->cameras,
                      "Images of a ChArUco board that is moved before the cameras: lenses and stereo pose");
  command->add_option("--board", args->squares, "Its squares, columns x rows")->capture_default_str();
  command->add_option("--square", args->board.shape.square, "Edge of a square [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--marker", args->board.marker, "Edge of a marker [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--dictionary", args->board.dictionary, "Of the markers; OpenCV's name")->capture_default_str();
  command->add_option("--lens", args->lens, "With --cameras; otherwise as given, else radial-tangential")
      ->check(CLI::IsMember({"radial-tangential", "equidistant"}));
  command->add_flag("--plan", args->plan, "Print the drive to make");
  command->add_option("--threads", args->threads, "For the batch estimate")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([args] { calibrate(*args); });
}

}  // namespace ear::tools
