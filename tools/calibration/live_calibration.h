// A calibration while the vehicle is driven: what it still does not know, again and again, from what came until then.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "calibration/calibrate.h"
#include "calibration/drive.h"
#include "src/odometry_factory.h"

namespace ear::calibration {

struct LiveCalibrationSettings {
  FilterConfig filter;      ///< of the first guess
  double every = 15.0;      ///< [s] of drive between two estimates, at least
  double longest = 300.0;   ///< [s] of drive that are kept: some 40 MB with cameras
  double frame_gap = 0.09;  ///< [s] between frames that are kept, at least
};

/// Records what the estimator is given, on its thread, and estimates on a thread of its own that yields to all others.
/// No sensor and no estimate waits for it.
class LiveCalibration {
 public:
  /// `say` is told in words, by the thread of this; it must be safe to call from there.
  LiveCalibration(const Calibration& given, const LiveCalibrationSettings& settings,
                  std::function<void(const std::string&)> say);
  ~LiveCalibration();
  LiveCalibration(const LiveCalibration&) = delete;
  LiveCalibration& operator=(const LiveCalibration&) = delete;
  LiveCalibration(LiveCalibration&&) = delete;
  LiveCalibration& operator=(LiveCalibration&&) = delete;

  /// The filter, which this listens to; this must outlive it.
  [[nodiscard]] MakeEstimator make();
  /// By the estimator's thread, after each frame or step: hands over what came since the last.
  void hand_over();

  /// No more samples come. The whole estimate, from all that was kept. Throws as calibrate() does.
  [[nodiscard]] Result finish();
  /// How much was kept [s].
  [[nodiscard]] double recorded() const;

 private:
  void run();
  void stop();
  [[nodiscard]] Drive drive() const;
  [[nodiscard]] Result estimate(const Settings& settings) const;

  Calibration given_;
  LiveCalibrationSettings settings_;
  std::function<void(const std::string&)> say_;
  Drive now_;                 ///< since the last hand-over; the estimator's thread alone
  TimeNs last_frame_ns_ = 0;  ///< that was kept; the same
  mutable std::mutex mutex_;
  std::condition_variable more_;
  std::vector<std::shared_ptr<const Drive>> pieces_;  ///< in the order of time
  bool full_ = false;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all else
};

}  // namespace ear::calibration
