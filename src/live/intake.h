// Where every source of samples hands them in: to the estimator, to the watch over the streams, to what records.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/live/live_clock.h"
#include "src/live/live_estimator.h"
#include "src/live/stream_watch.h"
#include "src/live/swap_watch.h"

namespace ear::live {

/// What else is told of samples that the estimator took, each by its sensor's thread: they must not wait.
struct IntakeTaps {
  std::function<void(const ImuSample&, const std::optional<NavState>&)> imu;
  std::function<void(const EncoderSample&)> encoder;
  std::function<void(const QueuedOdometry::Ranges&)> laser;
  std::function<void(const StereoFrame&)> stereo;
};

class Intake {
 public:
  /// Watches the sensors in `calibration`. `estimator` and `clock` must outlive it.
  Intake(LiveEstimator& estimator, const Calibration& calibration, const LiveClock& clock, IntakeTaps taps);

  /// Each by one thread. Samples of a sensor that the calibration has not are passed over. False: refused.
  bool add(const ImuSample& sample);
  bool add(const EncoderSample& sample);
  bool add(const QueuedOdometry::Ranges& ranges);
  bool add(const LaserSample& sample);  ///< the same
  /// Images of another size than the calibration's are refused, which is said once in ten seconds.
  bool add(const StereoFrame& frame);

  /// By one thread, a few times a second: what changed, in words.
  [[nodiscard]] std::vector<std::string> look();
  /// "imu 200 Hz, cameras 30 Hz, wheels silent"; by the same thread.
  [[nodiscard]] std::string rates() const;
  /// Has every sensor of the calibration delivered?
  [[nodiscard]] bool complete() const;

  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  [[nodiscard]] const LiveClock& clock() const { return clock_; }

 private:
  [[nodiscard]] std::vector<StreamWatch*> streams() const;
  [[nodiscard]] bool fits(const ImageView& view, std::size_t camera) const;

  LiveEstimator& estimator_;
  Calibration calibration_;
  const LiveClock& clock_;
  IntakeTaps taps_;
  std::unique_ptr<StreamWatch> imu_, encoder_, laser_, cameras_;  ///< null: there is no such sensor
  std::atomic<int> wrong_width_{0}, wrong_height_{0};             ///< of an image that was refused
  std::unique_ptr<SwapWatch> swap_;                               ///< null: there are no two cameras
  TimeNs said_size_ns_ = 0;
};

}  // namespace ear::live
