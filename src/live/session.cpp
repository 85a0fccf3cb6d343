#include "src/live/session.h"

#include <algorithm>
#include <utility>

#include "src/log/log.h"
#include "src/recording/input_error.h"

namespace ear::live {
namespace {

constexpr double kStatusInterval = 1.0;  // [s] between words to systemd
constexpr double kQueueSeconds = 10.0;   // of inertial samples, wheel readings, ranges: a stall is not to cost any
constexpr double kStuck = 5.0;           // [s] of an estimator that takes no samples while they come

std::string overflow_text(const Overflows& lost) {
  return std::to_string(lost.imu) + " inertial samples, " + std::to_string(lost.encoder) + " wheel readings, " +
         std::to_string(lost.laser) + " ranges, " + std::to_string(lost.frames) + " frames refused by full queues";
}

/// A recording stands for all sensors.
std::vector<MavlinkSettings> lines_of(const LiveSettings& settings, bool plays) {
  std::vector<MavlinkSettings> lines = settings.mavlink;
  for (MavlinkSettings& line : lines) {
    if (plays) line.inputs = {};
  }
  return lines;
}

/// A check compares wheels and beams with cameras, which must not know of them.
Config config_of(const LiveSettings& settings, const Calibration& calibration, bool check) {
  Config config = settings.estimator;
  if (check && !calibration.cameras.empty()) config.filter.odometer.model = OdometerModel::none;
  config.performance.budget_ms = settings.budget_ms.value_or(default_budget_ms(calibration));
  return config;
}

std::string words_of(const PreflightItem& item) {
  switch (item.result) {
    case PreflightItem::Result::right:
      return item.name + ": right: " + item.words;
    case PreflightItem::Result::wrong:
      return item.name + ": WRONG: " + item.words;
    default:
      return item.name + ": not done yet: " + item.words;
  }
}

}  // namespace

Session::Session(const SessionOptions& options, const LiveSettings& settings, const Calibration& calibration,
                 const std::filesystem::path& calibration_folder, RosNode* ros, Player* player, Onlooker onlooker)
    : options_(options),
      ros_(ros),
      player_(player),
      onlooker_(std::move(onlooker)),
      files_(options.out),
      recorder_(options.record.empty() ? nullptr
                                       : std::make_unique<Recorder>(options.record, calibration, calibration_folder)),
      preflight_(options.check ? std::make_unique<Preflight>(calibration) : nullptr),
      estimator_(config_of(settings, calibration, options.check), calibration, {kQueueSeconds, settings.frame_slots},
                 listeners(), onlooker_.make),
      intake_(estimator_, calibration, clock_, taps()),
      lines_(std::make_unique<MavlinkLines>(lines_of(settings, player != nullptr), intake_)) {
  if (ros_ != nullptr) {
    ros_->publish(calibration, [this](const auto& topic, const auto& type, TimeNs t_ns, const auto& cdr) {
      if (recorder_) recorder_->add(topic, type, t_ns, cdr);
    });
  }
  outputs_ = lines_.get();  // from now on estimates go out
  if (ros_ != nullptr && player_ == nullptr) ros_->start(intake_);
  if (player_ != nullptr) {
    player_->start(intake_);
  } else if (settings.cameras) {
    cameras_ = open_cameras(settings, intake_);
  }
}

std::string Session::run(const std::function<std::optional<std::string>()>& wait, Notifier& notifier) {
  const TimeNs begin = clock_.now();
  last_reported_.alive_ns = begin;
  notifier.ready();
  log_info("ready");
  while (true) {
    if (auto reason = wait()) return *std::move(reason);
    if (player_ != nullptr && player_->done()) return "the recording has ended";
    const TimeNs now = clock_.now();
    if (preflight_ && all_right()) return "the check is done";
    if (options_.duration > 0.0 && seconds_between(begin, now) >= options_.duration) return "the time is over";
    log_news();
    report_status(notifier, now);
  }
}

void Session::stop() {
  if (player_ != nullptr) player_->stop();
  if (ros_ != nullptr) ros_->stop();
  cameras_.reset();
  estimator_.stop();
  log_news();
  log_info(report_.summary() + "; " + overflow_text(estimator_.overflows()) + "; " +
           std::to_string(estimator_.impatient()) + " frames did not wait for late readings");
}

void Session::judge() const {
  if (!preflight_) return;
  int open = 0;
  for (const PreflightItem& item : preflight_->items()) {
    log_info("check: " + words_of(item));
    open += item.result == PreflightItem::Result::right ? 0 : 1;
  }
  if (open > 0) throw InputError("check: " + std::to_string(open) + " items are not right");
}

bool Session::all_right() const {
  const std::vector<PreflightItem> items = preflight_->items();
  return std::all_of(items.begin(), items.end(),
                     [](const PreflightItem& item) { return item.result == PreflightItem::Result::right; });
}

LiveListeners Session::listeners() {
  return {[this](const LiveFrame& frame, const Odometry& odometry) {
            report_.take(frame, odometry);
            files_.take(frame);
            if (preflight_) preflight_->add(frame, odometry.calibration());
            if (onlooker_.on_frame) onlooker_.on_frame(frame, odometry);
            send(frame);
            if (outputs_ != nullptr && ros_ != nullptr) ros_->show(odometry);
          },
          [this](const LiveSample& sample) {
            report_.take(sample);
            send(sample);
          },
          onlooker_.keep_frame};
}

template <typename What>
void Session::send(const What& what) {
  if (MavlinkLines* const lines = outputs_) {
    lines->take(what);
    if (ros_ != nullptr) ros_->take(what);
  }
}

IntakeTaps Session::taps() {
  return {[this](const ImuSample& sample, const std::optional<NavState>& state) {
            note(sample);
            if (ros_ != nullptr) ros_->take(sample, state);
          },
          [this](const EncoderSample& sample) { note(sample); },
          [this](const QueuedOdometry::Ranges& ranges) { note(ranges); },
          [this](const StereoFrame& frame) {
            if (recorder_) recorder_->add(frame);
            if (ros_ != nullptr) ros_->take(frame);
          }};
}

/// Passes one sample to those who ask for all of a kind.
template <typename What>
void Session::note(const What& what) {
  if (recorder_) recorder_->add(what);
  if (preflight_) preflight_->add(what);
}

void Session::log_news() {
  if (preflight_) {
    for (const PreflightItem& item : preflight_->news()) log_info("check: " + words_of(item));
  }
  for (const std::string& words : intake_.look()) log_warning(words);
  for (const std::string& words : lines_->look()) log_warning(words);
  if (cameras_) {
    for (const std::string& words : cameras_->look()) log_warning(words);
  }
  if (recorder_) {
    for (const std::string& words : recorder_->look()) log_error(words);
  }
  if (ros_ == nullptr) return;
  for (const std::string& words : ros_->look()) log_warning(words);
}

/// The watchdog is reset while the estimator takes samples, or there are none.
void Session::report_status(Notifier& notifier, TimeNs now) {
  const std::uint64_t samples = report_.samples();
  const std::string rates = intake_.rates();
  if (samples != last_reported_.samples || rates.rfind("imu silent", 0) == 0) last_reported_.alive_ns = now;
  last_reported_.samples = samples;
  if (notifier.watchdog() && seconds_between(last_reported_.alive_ns, now) < kStuck) notifier.alive();
  if (seconds_between(last_reported_.status_ns, now) < kStatusInterval) return;
  last_reported_.status_ns = now;
  notifier.status(report_.health() + "; " + rates);
  if (ros_ != nullptr) ros_->publish_status(now, rates);
  log(LogLevel::debug, report_.health() + "; " + rates);
}

}  // namespace ear::live
