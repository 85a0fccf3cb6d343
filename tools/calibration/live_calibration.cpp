#include "tools/calibration/live_calibration.h"

#include <sys/resource.h>

#include <cmath>
#include <exception>
#include <memory>
#include <utility>

#include "calibration/drive_recorder.h"
#include "calibration/still_missing.h"

namespace ear::calibration {
namespace {

constexpr double kPiece = 1.0;  // [s]

/// What is later than what is there.
template <typename Sample>
void append(std::vector<Sample>& all, const std::vector<Sample>& more) {
  for (const Sample& sample : more) {
    if (all.empty() || sample.t_ns > all.back().t_ns) all.push_back(sample);
  }
}

double length(const std::vector<std::shared_ptr<const Drive>>& pieces) {
  return pieces.empty() ? 0.0 : seconds_between(pieces.front()->imu.front().t_ns, pieces.back()->imu.back().t_ns);
}

std::string seconds_text(double seconds) { return std::to_string(std::lround(seconds)) + " s"; }

}  // namespace

LiveCalibration::LiveCalibration(const Calibration& given, const LiveCalibrationSettings& settings,
                                 std::function<void(const std::string&)> say)
    : given_(given), settings_(settings), say_(std::move(say)), thread_([this] { run(); }) {}

LiveCalibration::~LiveCalibration() { stop(); }

MakeEstimator LiveCalibration::make() {
  return [this](const FilterConfig& filter, const Calibration& calibration) {
    return std::make_unique<DriveRecorder>(filter, calibration, now_);
  };
}

void LiveCalibration::hand_over() {
  if (!now_.frames.empty()) {
    const bool soon = seconds_between(last_frame_ns_, now_.frames.back().t_ns) < settings_.frame_gap;
    if (last_frame_ns_ != 0 && soon) {
      now_.frames.pop_back();
    } else {
      last_frame_ns_ = now_.frames.back().t_ns;
    }
  }
  if (now_.imu.empty() || seconds_between(now_.imu.front().t_ns, now_.imu.back().t_ns) < kPiece) return;
  auto piece = std::make_shared<const Drive>(std::exchange(now_, Drive{}));
  {
    const std::lock_guard lock(mutex_);
    full_ = full_ || length(pieces_) >= settings_.longest;
    if (!full_) pieces_.push_back(std::move(piece));
  }
  more_.notify_one();
}

void LiveCalibration::run() {
  ::setpriority(PRIO_PROCESS, 0, 10);  // of this thread alone, on Linux
  double estimated = 0.0;
  bool told = false;
  Settings quick;
  quick.filter = settings_.filter;
  quick.threads = 1;
  quick.rounds = 2;
  while (true) {
    double recorded = 0.0;
    bool full = false;
    {
      std::unique_lock lock(mutex_);
      more_.wait(lock, [&] { return stop_ || (full_ && !told) || length(pieces_) >= estimated + settings_.every; });
      if (stop_) return;
      recorded = length(pieces_);
      full = full_;
    }
    if (full && !told) {
      told = true;
      say_("calibration: " + seconds_text(recorded) + " are kept; what comes now is not used");
    }
    if (recorded < estimated + settings_.every) continue;
    estimated = recorded;
    std::string words;
    try {
      words = missing_text(estimate(quick).findings);
    } catch (const std::exception& error) {
      words = std::string("nothing yet: ") + error.what();
    }
    say_("calibration after " + seconds_text(recorded) + ": " + words);
  }
}

void LiveCalibration::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  more_.notify_one();
  if (thread_.joinable()) thread_.join();
}

double LiveCalibration::recorded() const {
  const std::lock_guard lock(mutex_);
  return length(pieces_);
}

Drive LiveCalibration::drive() const {
  std::vector<std::shared_ptr<const Drive>> pieces;
  {
    const std::lock_guard lock(mutex_);
    pieces = pieces_;
  }
  Drive drive;
  drive.name = "this drive";
  for (const auto& piece : pieces) {
    append(drive.imu, piece->imu);
    append(drive.encoders, piece->encoders);
    append(drive.lasers, piece->lasers);
    append(drive.frames, piece->frames);
  }
  return drive;
}

Result LiveCalibration::estimate(const Settings& settings) const {
  const std::vector<Drive> drives{drive()};
  if (drives[0].imu.empty()) throw std::invalid_argument("no inertial samples");
  return calibrate(given_, priors_of(given_), drives, settings);
}

Result LiveCalibration::finish() {
  stop();
  Settings whole;
  whole.filter = settings_.filter;
  return estimate(whole);
}

}  // namespace ear::calibration
