// ear live: sensors in, estimate out, until SIGINT or SIGTERM.
#include <opencv2/core/utility.hpp>

#include <signal.h>

#include <algorithm>
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
#include "src/live/preflight.h"
#ifdef EAR_WITH_ROSBAG2
#include "src/live/recorder.h"
#endif
#include "src/log/log.h"
#include "src/recording/input_error.h"
#include "src/recording/writers.h"
#include "tools/commands.h"
#include "tools/live_ros.h"
#include "tools/live_sources.h"
#include "tools/opened_recording.h"

namespace ear::tools {
namespace {

struct LiveArguments {
  std::filesystem::path config;
  std::filesystem::path sensors;
  std::filesystem::path out;
  std::filesystem::path record;
  double duration = 0.0;
  bool check = false;
};

constexpr long kLookNs = 200'000'000;    // between two looks at streams and signals
constexpr double kStatusInterval = 1.0;  // [s] between words to systemd
constexpr double kQueueSeconds = 2.0;
constexpr double kStuck = 5.0;  // [s] of an estimator that takes no samples while they come

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

/// The file of --record: nothing where it is not asked for.
class Record {
 public:
  Record(const std::filesystem::path& file, const Calibration& calibration, const SensorFiles& files)
      : beams_(beam_count(calibration)) {
    if (file.empty()) return;
#ifdef EAR_WITH_ROSBAG2
    recorder_ = std::make_unique<live::Recorder>(file, calibration, files.folder());
#else
    static_cast<void>(files);
    throw InputError(
        "--record: MCAP files are not built in: install libfastcdr-dev, libzstd-dev, liblz4-dev, "
        "libsqlite3-dev and zlib1g-dev, and build again");
#endif
  }

  void add(const QueuedOdometry::Ranges& ranges) {
#ifdef EAR_WITH_ROSBAG2
    if (recorder_) recorder_->add(ranges, beams_);
#endif
    static_cast<void>(ranges);
  }
  template <typename... What>
  void add(const What&... what) {
#ifdef EAR_WITH_ROSBAG2
    if (recorder_) recorder_->add(what...);
#else
    static_cast<void>(sizeof...(what));
#endif
  }

  /// What went wrong, once.
  [[nodiscard]] std::string look() {
#ifdef EAR_WITH_ROSBAG2
    if (!recorder_ || said_) return "";
    std::string text = recorder_->failure();
    if (text.empty() && recorder_->left_out() > 0) text = "--record: the disk is too slow: messages are left out";
    said_ = !text.empty();
    return text;
#else
    return "";
#endif
  }

 private:
  static std::size_t beam_count(const Calibration& calibration) {
    return calibration.lasers ? calibration.lasers->beams.size() : 0;
  }

#ifdef EAR_WITH_ROSBAG2
  std::unique_ptr<live::Recorder> recorder_;
  bool said_ = false;
#endif
  std::size_t beams_;
};

/// All that runs, from the first sample to the last estimate.
class Session {
 public:
  Session(const LiveArguments& args, const live::LiveSettings& settings, const Calibration& calibration,
          const SensorFiles& sensor_files, LiveRos* ros, live::Player* player)
      : ros_(ros),
        player_(player),
        files_(args.out),
        record_(args.record, calibration, sensor_files),
        preflight_(args.check ? std::make_unique<live::Preflight>(calibration) : nullptr),
        estimator_(config_of(settings, calibration, args.check), calibration, {kQueueSeconds, settings.frame_slots},
                   listeners()),
        intake_(estimator_, calibration, clock_, taps()),
        lines_(std::make_unique<MavlinkLines>(lines_of(settings, player != nullptr), intake_)) {
    if (ros_ != nullptr) {
      ros_->publish(calibration, [this](const auto& topic, const auto& type, TimeNs t_ns, const auto& cdr) {
        record_.add(topic, type, t_ns, cdr);
      });
    }
    outputs_ = lines_.get();  // from now on estimates go out
    if (ros_ != nullptr && player_ == nullptr) ros_->start(intake_);
    if (player_ != nullptr) {
      player_->start(intake_);
    } else {
      cameras_ = open_cameras(settings, intake_);
    }
  }

  /// Until there is a reason to stop, which it returns.
  std::string run(const StopSignals& signals, live::Notifier& notifier, double duration) {
    const TimeNs begin = clock_.now();
    notifier.ready();
    log_info("ready");
    while (true) {
      if (const auto signal = signals.wait()) return *signal;
      if (player_ != nullptr && player_->done()) return "the recording has ended";
      const TimeNs now = clock_.now();
      if (preflight_ && all_done()) return "the check is done";
      if (duration > 0.0 && seconds_between(begin, now) >= duration) return "the time is over";
      say();
      tell(notifier, now);
    }
  }

  /// Of --check: throws InputError unless all is right.
  void judge() const {
    if (!preflight_) return;
    int open = 0;
    for (const live::PreflightItem& item : preflight_->items()) {
      log_info("check: " + words_of(item));
      open += item.result == live::PreflightItem::Result::right ? 0 : 1;
    }
    if (open > 0) throw InputError("check: " + std::to_string(open) + " items are not right");
  }

  void stop() {
    if (player_ != nullptr) player_->stop();
    if (ros_ != nullptr) ros_->stop();
    cameras_.reset();
    estimator_.stop();
    say();
    log_info(report_.summary() + "; " + overflow_text(estimator_.overflows()) + "; " +
             std::to_string(estimator_.impatient()) + " frames did not wait for late readings");
  }

 private:
  /// A recording stands for all sensors.
  static std::vector<live::MavlinkSettings> lines_of(const live::LiveSettings& settings, bool plays) {
    std::vector<live::MavlinkSettings> lines = settings.mavlink;
    for (live::MavlinkSettings& line : lines) {
      if (plays) line.inputs = {};
    }
    return lines;
  }

  [[nodiscard]] bool all_done() const {
    const std::vector<live::PreflightItem> items = preflight_->items();
    return std::all_of(items.begin(), items.end(), [](const live::PreflightItem& item) {
      return item.result == live::PreflightItem::Result::right;
    });
  }

  /// A check compares wheels and beams with cameras, which must not know of them.
  static Config config_of(const live::LiveSettings& settings, const Calibration& calibration, bool check) {
    Config config = settings.estimator;
    if (check && !calibration.cameras.empty()) config.filter.odometer.model = OdometerModel::none;
    config.performance.budget_ms = settings.budget_ms.value_or(live::default_budget_ms(calibration));
    return config;
  }

  live::LiveListeners listeners() {
    return {[this](const live::LiveFrame& frame, const Odometry& odometry) {
              report_.take(frame, odometry);
              files_.take(frame);
              if (preflight_) preflight_->add(frame, odometry.calibration());
              send(frame);
            },
            [this](const live::LiveSample& sample) {
              report_.take(sample);
              send(sample);
            }};
  }

  template <typename What>
  void send(const What& what) {
    if (MavlinkLines* const lines = outputs_) {
      lines->take(what);
      if (ros_ != nullptr) ros_->take(what);
    }
  }

  live::IntakeTaps taps() {
    return {[this](const ImuSample& sample, const std::optional<NavState>& state) {
              record_.add(sample);
              check(sample);
              if (ros_ != nullptr) ros_->take(sample, state);
            },
            [this](const EncoderSample& sample) {
              record_.add(sample);
              check(sample);
            },
            [this](const QueuedOdometry::Ranges& ranges) {
              record_.add(ranges);
              check(ranges);
            },
            [this](const StereoFrame& frame) { record_.add(frame); }};
  }

  template <typename What>
  void check(const What& what) {
    if (preflight_) preflight_->add(what);
  }

  void say() {
    if (preflight_) {
      for (const live::PreflightItem& item : preflight_->news()) log_info("check: " + words_of(item));
    }
    for (const std::string& words : intake_.look()) log_warning(words);
    for (const std::string& words : lines_->look()) log_warning(words);
    if (cameras_) {
      for (const std::string& words : cameras_->look()) log_warning(words);
    }
    if (const std::string words = record_.look(); !words.empty()) log_error(words);
    if (ros_ == nullptr) return;
    for (const std::string& words : ros_->look()) log_warning(words);
  }

  /// The watchdog is fed while the estimator takes samples, or there are none.
  void tell(live::Notifier& notifier, TimeNs now) {
    const std::uint64_t samples = report_.samples();
    const std::string rates = intake_.rates();
    if (samples != samples_ || rates.rfind("imu silent", 0) == 0) alive_ns_ = now;
    samples_ = samples;
    if (notifier.watchdog() && seconds_between(alive_ns_, now) < kStuck) notifier.alive();
    if (seconds_between(told_ns_, now) < kStatusInterval) return;
    told_ns_ = now;
    notifier.status(report_.text() + "; " + rates);
    if (ros_ != nullptr) ros_->tell(now, rates);
    log(LogLevel::debug, report_.text() + "; " + rates);
  }

  static std::string words_of(const live::PreflightItem& item) {
    switch (item.result) {
      case live::PreflightItem::Result::right:
        return item.name + ": right: " + item.words;
      case live::PreflightItem::Result::wrong:
        return item.name + ": WRONG: " + item.words;
      default:
        return item.name + ": not done yet: " + item.words;
    }
  }

  LiveRos* ros_;
  live::Player* player_;
  live::LiveClock clock_;
  Report report_;
  Files files_;
  Record record_;
  std::unique_ptr<live::Preflight> preflight_;   ///< with --check
  std::atomic<MavlinkLines*> outputs_{nullptr};  ///< null until all is there
  live::LiveEstimator estimator_;
  live::Intake intake_;
  std::unique_ptr<MavlinkLines> lines_;
  std::unique_ptr<live::StereoCamera> cameras_;
  TimeNs alive_ns_ = clock_.now();
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

/// Where the whole calibration was read from; empty: it comes from several places.
std::filesystem::path folder_of(const LiveArguments& args, const live::LiveSettings& settings) {
  if (!settings.kalibr.empty() || settings.ros) return {};
  if (!settings.calibration.empty()) return find_mav0(settings.calibration);
  return std::filesystem::is_directory(args.sensors / "mav0") ? args.sensors / "mav0" : std::filesystem::path();
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
  std::optional<Calibration> calibration = live_calibration(settings, player.get());
  std::unique_ptr<LiveRos> ros;
  if (settings.ros) ros = std::make_unique<LiveRos>(settings);
  if (ros && !player) {
    std::optional<std::string> signal;
    calibration = ros->complete(*calibration, [&] { return (signal = signals.wait()).has_value(); });
    if (!calibration) return log_info("stops: " + *signal);
  }
  require_usable(*calibration, settings);
  const SensorFiles files(*calibration, folder_of(args, settings));
  Session session(args, settings, files.read(), files, ros.get(), player.get());
  const std::string reason = session.run(signals, notifier, args.duration);
  notifier.stopping();
  log_info("stops: " + reason);
  session.stop();
  session.judge();
}

}  // namespace

void add_live_command(CLI::App& app) {
  auto* command = app.add_subcommand("live", "Estimate from sensors as they deliver, until SIGINT or SIGTERM");
  auto args = std::make_shared<LiveArguments>();
  command->add_option("--config", args->config, "Sensors, outputs and the log (docs/live.md)")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--sensors", args->sensors,
                   "A recording in place of the sensors, played in real time; its calibration, unless --config has one")
      ->check(CLI::ExistingPath);
  command->add_option("--out", args->out, "Also write estimate.tum and states.csv to this folder, as ear run does");
  command->add_option("--record", args->record, "Write what comes in and what goes out to this MCAP file");
  command->add_option("--duration", args->duration, "Stop after so many seconds")->check(CLI::PositiveNumber);
  command->add_flag(
      "--check", args->check,
      "Before a flight, by hand: lift, push, turn and roll the vehicle, and see whether its sensors agree");
  if (const std::string missing = missing_ros_parts(); !missing.empty())
    command->footer("Not in this program: " + missing);
  command->callback([args] { run_live(*args); });
}

}  // namespace ear::tools
