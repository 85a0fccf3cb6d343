// ear live: sensors in, estimate out, until SIGINT or SIGTERM.
#include <opencv2/core/utility.hpp>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "src/live/session.h"
#include "src/log/log.h"
#include "src/recording/calibration_files.h"
#include "src/recording/input_error.h"
#include "tools/commands.h"
#include "tools/live_view.h"
#include "tools/opened_recording.h"
#include "tools/program_config.h"
#ifdef EAR_WITH_CALIBRATION
#include "tools/calibration/live_calibration.h"
#include "tools/calibration/recorded_drive.h"
#include "tools/calibration/result_files.h"
#endif

namespace ear::tools {
namespace {

struct LiveArguments {
  std::filesystem::path config;
  std::filesystem::path sensors;
  live::SessionOptions session;
  ViewArguments view;
  std::filesystem::path calibrate;
};

#ifdef EAR_WITH_CALIBRATION
/// --calibrate: listens to the estimator, and writes a calibration at the end.
class CalibrationRun {
 public:
  CalibrationRun(const std::filesystem::path& folder, const Calibration& calibration, const Config& config)
      : folder_(folder),
        sought_(calibration::for_search(calibration)),
        live_(calibration, settings_of(config), [](const std::string& words) { log_info(words); }) {}

  /// What the session estimates by: the right camera may be further off than one that was calibrated.
  [[nodiscard]] const Calibration& sought() const { return sought_; }

  [[nodiscard]] live::Onlooker onlooker() {
    return {live_.make(), {}, [this](const live::LiveFrame&, const Odometry&) { live_.hand_over(); }};
  }

  void finish() {
    log_info("calibration: the whole estimate, from " + std::to_string(std::lround(live_.recorded())) + " s");
    const std::string text = calibration::write_result(live_.finish(), folder_);
    std::printf("%s%s\n", text.c_str(), folder_.c_str());
  }

 private:
  static calibration::LiveCalibrationSettings settings_of(const Config& config) {
    calibration::LiveCalibrationSettings settings;
    settings.filter = config.filter;
    return settings;
  }

  std::filesystem::path folder_;
  Calibration sought_;
  calibration::LiveCalibration live_;
};
#else
class CalibrationRun {
 public:
  CalibrationRun(const std::filesystem::path&, const Calibration&, const Config&) {
    throw InputError("--calibrate: this program was built without Ceres (Debian: libceres-dev)");
  }
  [[nodiscard]] static Calibration sought() { return {}; }
  [[nodiscard]] static live::Onlooker onlooker() { return {}; }
  static void finish() {}
};
#endif

/// SIGINT and SIGTERM are taken from a queue, by the main thread; all threads that begin later inherit that.
class StopSignals {
 public:
  StopSignals() {
    ::sigemptyset(&signals_);
    ::sigaddset(&signals_, SIGINT);
    ::sigaddset(&signals_, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }
  /// Waits for one, 0.2 s; the name of the one that came.
  [[nodiscard]] std::optional<std::string> wait() const {
    const timespec patience{0, 200'000'000};
    const int signal = ::sigtimedwait(&signals_, nullptr, &patience);
    if (signal < 0) return std::nullopt;
    return signal == SIGINT ? "SIGINT" : "SIGTERM";
  }

 private:
  sigset_t signals_{};
};

live::LiveSettings settings_of(const LiveArguments& args) {
  live::LiveSettings settings;
  if (args.config.empty()) {
    settings.file = "ear live";
    settings.log.level = LogLevel::info;
  } else {
    settings = live::load_live_settings(args.config);
  }
  settings.estimator = with_environment(settings.estimator);
  return settings;
}

/// Where the whole calibration was read from; empty: it comes from several places.
std::filesystem::path folder_of(const LiveArguments& args, const live::LiveSettings& settings) {
  if (!settings.kalibr.empty() || settings.ros) return {};
  if (!settings.calibration.empty()) return find_mav0(settings.calibration);
  return std::filesystem::is_directory(args.sensors / "mav0") ? args.sensors / "mav0" : std::filesystem::path();
}

/// What the page is headed with.
std::string title_of(const LiveArguments& args) {
  const std::filesystem::path source = args.sensors.empty() ? args.config : args.sensors;
  return (source.has_filename() ? source : source.parent_path()).filename().string();
}

void run_live(const LiveArguments& args) {
  const StopSignals signals;
  cv::setNumThreads(1);
  const live::LiveSettings settings = settings_of(args);
  set_up_log(settings.log);
  live::Notifier notifier;
  std::optional<OpenedRecording> opened;
  std::unique_ptr<live::Player> player;
  if (!args.sensors.empty()) {
    opened.emplace(args.sensors, args.config);
    player = std::make_unique<live::Player>(opened->read({}));
  }
  std::optional<Calibration> calibration = live::known_calibration(settings, player ? &player->calibration() : nullptr);
  std::unique_ptr<live::RosNode> ros;
  if (settings.ros) ros = std::make_unique<live::RosNode>(settings, !player);
  if (ros && !player) {
    std::optional<std::string> signal;
    calibration = ros->complete(*calibration, [&] { return (signal = signals.wait()).has_value(); });
    if (!calibration) return log_info("stops: " + *signal);
  }
  live::require_usable(*calibration, settings);
  const live::SensorFiles files(*calibration, folder_of(args, settings));
  std::optional<LiveView> view;
  if (args.view.port >= 0) view.emplace(args.view, title_of(args), files.read());
  std::optional<CalibrationRun> calibrates;
  if (!args.calibrate.empty()) calibrates.emplace(args.calibrate, files.read(), settings.estimator);
  live::Session session(args.session, settings, calibrates ? calibrates->sought() : files.read(), files.folder(),
                        ros.get(), player.get(),
                        view         ? view->onlooker()
                        : calibrates ? calibrates->onlooker()
                                     : live::Onlooker{});
  const std::string reason = session.run([&] { return signals.wait(); }, notifier);
  notifier.stopping();
  log_info("stops: " + reason);
  session.stop();
  if (view) log_info(view->finish());
  session.judge();
  if (calibrates) calibrates->finish();
}

}  // namespace

void add_live_command(CLI::App& app) {
  auto* command = app.add_subcommand("live", "Estimate from sensors as they deliver, until SIGINT or SIGTERM");
  auto args = std::make_shared<LiveArguments>();
  live::SessionOptions& session = args->session;
  command->add_option("--config", args->config, "Sensors, outputs and the log (docs/live.md)")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--sensors", args->sensors,
                   "A recording in place of the sensors, played in real time; its calibration, unless --config has one")
      ->check(CLI::ExistingPath);
  command->add_option("--out", session.out, "Also write estimate.tum and states.csv to this folder, as ear run does");
  command->add_option("--record", session.record, "Write what comes in and what goes out to this MCAP file");
  command->add_option("--duration", session.duration, "Stop after so many seconds")->check(CLI::PositiveNumber);
  command->add_flag(
      "--check", session.check,
      "Before a flight, by hand: lift, push, turn and roll the vehicle, and see whether its sensors agree");
  add_view_options(*command, args->view);
  command
      ->add_option("--calibrate", args->calibrate,
                   "Say while driving what the calibration still lacks, and write it to this folder at the end "
                   "(docs/calibration.md)")
      ->excludes("--check")
      ->excludes("--view");
  if (const std::string missing = live::missing_ros_parts(); !missing.empty())
    command->footer("Not in this program: " + missing);
  command->callback([args] { run_live(*args); });
}

}  // namespace ear::tools
