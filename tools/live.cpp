// ear live: sensors in, estimate out, until SIGINT or SIGTERM.
#include <opencv2/core/utility.hpp>

#include <signal.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "src/health_text.h"
#include "src/live/live_settings.h"
#include "src/live/notify.h"
#include "src/log/log.h"
#include "src/recording/writers.h"
#include "tools/commands.h"
#include "tools/live_sources.h"

namespace ear::tools {
namespace {

struct LiveArguments {
  std::filesystem::path config;
  std::filesystem::path sensors;
  std::filesystem::path out;
  double duration = 0.0;
};

constexpr long kLookNs = 200'000'000;      // between two looks at streams and signals
constexpr double kStatusInterval = 1.0;    // [s] between words to systemd
constexpr double kStuck = 5.0;             // [s] of an estimator that takes no samples while they come

/// SIGINT and SIGTERM are taken from a queue, by the main thread; all threads that begin later inherit that.
class StopSignals {
 public:
  StopSignals() {
    ::sigemptyset(&signals_);
    ::sigaddset(&signals_, SIGINT);
    ::sigaddset(&signals_, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }
  /// Waits for one; the name of the one that came.
  [[nodiscard]] std::optional<std::string> wait() const {
    const timespec patience{0, kLookNs};
    const int signal = ::sigtimedwait(&signals_, nullptr, &patience);
    if (signal < 0) return std::nullopt;
    return signal == SIGINT ? "SIGINT" : "SIGTERM";
  }

 private:
  sigset_t signals_{};
};

/// What the estimator's thread said last, for the main thread.
class Report {
 public:
  void take(const live::LiveFrame& frame, const Odometry& odometry) {
    const std::lock_guard lock(mutex_);
    const bool reduced = frame.health.load_step != load_step_;
    load_step_ = frame.health.load_step;
    text_ = to_text(frame.health);
    ++frames_;
    estimates_ += frame.estimate ? 1 : 0;
    imu_ = odometry.input_counts().imu;
    if (reduced) log_info("load step " + std::to_string(load_step_) + (load_step_ > 0 ? ": work is left out" : ""));
  }
  void take(const live::LiveSample& /*sample*/) { ++samples_; }

  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  [[nodiscard]] std::string summary() const {
    const std::lock_guard lock(mutex_);
    return std::to_string(frames_) + " frames and steps, " + std::to_string(estimates_) + " estimates, " +
           std::to_string(samples_) + " inertial samples, " + std::to_string(imu_.rejected()) + " of these refused";
  }

 private:
  mutable std::mutex mutex_;
  std::string text_ = "no frame yet";
  std::uint64_t frames_ = 0, estimates_ = 0;
  int load_step_ = 0;
  StreamCounts imu_;
  std::atomic<std::uint64_t> samples_{0};
};

/// estimate.tum and states.csv, on request.
class Files {
 public:
  explicit Files(const std::filesystem::path& folder) {
    if (folder.empty()) return;
    std::filesystem::create_directories(folder);
    trajectory_ = std::make_unique<TumWriter>(folder / "estimate.tum");
    states_ = std::make_unique<StatesWriter>(folder / "states.csv");
  }

  /// A full disk ends the files, not the estimate.
  void take(const live::LiveFrame& frame) {
    if (!trajectory_ || !frame.estimate) return;
    try {
      trajectory_->write(*frame.estimate);
      states_->write(*frame.estimate, to_text(frame.estimate->health));
    } catch (const std::exception& error) {
      log_error(std::string(error.what()) + ": no more is written");
      trajectory_.reset();
    }
  }

 private:
  std::unique_ptr<TumWriter> trajectory_;
  std::unique_ptr<StatesWriter> states_;
};

std::string overflow_text(const Overflows& lost) {
  return std::to_string(lost.imu) + " inertial samples, " + std::to_string(lost.encoder) + " wheel readings, " +
         std::to_string(lost.laser) + " ranges, " + std::to_string(lost.frames) + " frames refused by full queues";
}

/// Looks at all that runs, and tells people and systemd, until there is a reason to stop, which it returns.
class Supervisor {
 public:
  Supervisor(live::Intake& intake, MavlinkLines& lines, const Report& report, live::Notifier& notifier)
      : intake_(intake), lines_(lines), report_(report), notifier_(notifier), begin_ns_(intake.clock().now()) {}

  std::string run(const StopSignals& signals, const live::Player* player, double duration) {
    notifier_.ready();
    log_info("ready");
    while (true) {
      if (const auto signal = signals.wait()) return *signal;
      if (player != nullptr && player->done()) return "the recording has ended";
      const TimeNs now = intake_.clock().now();
      if (duration > 0.0 && seconds_between(begin_ns_, now) >= duration) return "the time is over";
      for (const std::string& words : intake_.look()) log_warning(words);
      for (const std::string& words : lines_.look()) log_warning(words);
      tell_systemd(now);
    }
  }

 private:
  /// The watchdog is fed while the estimator takes samples, or there are none.
  void tell_systemd(TimeNs now) {
    const std::uint64_t samples = report_.samples();
    if (samples != samples_ || intake_.rates().find("imu silent") == 0) alive_ns_ = now;
    samples_ = samples;
    if (notifier_.watchdog() && seconds_between(alive_ns_, now) < kStuck) notifier_.alive();
    if (seconds_between(told_ns_, now) < kStatusInterval) return;
    told_ns_ = now;
    notifier_.status(report_.text() + "; " + intake_.rates());
    log(LogLevel::debug, report_.text() + "; " + intake_.rates());
  }

  live::Intake& intake_;
  MavlinkLines& lines_;
  const Report& report_;
  live::Notifier& notifier_;
  TimeNs begin_ns_;
  TimeNs alive_ns_ = begin_ns_;
  TimeNs told_ns_ = 0;
  std::uint64_t samples_ = 0;
};

live::LiveSettings settings_of(const LiveArguments& args) {
  if (!args.config.empty()) return live::load_live_settings(args.config);
  live::LiveSettings settings;
  settings.file = "ear live";
  settings.log.level = LogLevel::info;
  return settings;
}

void run_live(const LiveArguments& args) {
  const StopSignals signals;
  cv::setNumThreads(1);
  const live::LiveSettings settings = settings_of(args);
  set_up_log(settings.log);
  std::unique_ptr<live::Player> player;
  if (!args.sensors.empty()) player = std::make_unique<live::Player>(args.sensors);
  const Calibration calibration = live_calibration(settings, player.get());
  Config config = settings.estimator;
  config.performance.budget_ms = settings.budget_ms.value_or(live::default_budget_ms(calibration));

  const live::LiveClock clock;
  live::Notifier notifier;
  Report report;
  Files files(args.out);
  MavlinkLines* lines = nullptr;  // begins after the estimator, which it feeds
  std::mutex lines_mutex;
  live::LiveListeners listeners;
  listeners.on_frame = [&](const live::LiveFrame& frame, const Odometry& odometry) {
    report.take(frame, odometry);
    files.take(frame);
    const std::lock_guard lock(lines_mutex);
    if (lines != nullptr) lines->take(frame);
  };
  listeners.on_imu = [&](const live::LiveSample& sample) {
    report.take(sample);
    const std::lock_guard lock(lines_mutex);
    if (lines != nullptr) lines->take(sample);
  };
  live::LiveEstimator estimator(config, calibration, {2.0, settings.frame_slots}, listeners);
  live::Intake intake(estimator, calibration, clock, {});
  MavlinkLines mavlink(settings.mavlink, intake);
  {
    const std::lock_guard lock(lines_mutex);
    lines = &mavlink;
  }
  if (player) player->start(intake);
  const std::string reason = Supervisor(intake, mavlink, report, notifier).run(signals, player.get(), args.duration);
  notifier.stopping();
  log_info("stops: " + reason);
  if (player) player->stop();
  estimator.stop();
  log_info(report.summary() + "; " + overflow_text(estimator.overflows()) + "; " +
           std::to_string(estimator.impatient()) + " frames did not wait for late readings");
}

}  // namespace

void add_live_command(CLI::App& app) {
  auto* command = app.add_subcommand("live", "Estimate from sensors as they deliver, until SIGINT or SIGTERM");
  auto args = std::make_shared<LiveArguments>();
  command->add_option("--config", args->config, "Sensors, outputs and the log (docs/live.md)")
      ->check(CLI::ExistingFile);
  command->add_option("--sensors", args->sensors,
                      "A recording in place of the sensors, played in real time; its calibration, unless --config has one")
      ->check(CLI::ExistingPath);
  command->add_option("--out", args->out, "Also write estimate.tum and states.csv to this folder, as ear run does");
  command->add_option("--duration", args->duration, "Stop after so many seconds")->check(CLI::PositiveNumber);
  command->callback([args] { run_live(*args); });
}

}  // namespace ear::tools
