// Images with their features drawn in, for people who look: made only while somebody does.
#pragma once

#include <atomic>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "src/ros2/messages.h"

namespace ear::live {

class FeatureImages {
 public:
  explicit FeatureImages(const CameraCalibration& camera) : camera_(camera) {}

  /// Does somebody look? By any thread.
  void want(bool wanted) { wanted_ = wanted; }
  [[nodiscard]] bool wanted() const { return wanted_; }

  /// By the cameras' thread: keeps the left image until its features are there.
  void take(const StereoFrame& frame);
  /// By the estimator's thread: the image that these features are of, as bgr8; nothing if it is not kept.
  [[nodiscard]] std::optional<ros2::Image> draw(const FeatureFrame& features);

 private:
  static constexpr std::size_t kMost = 4;  ///< images that wait

  struct Kept {
    TimeNs t_ns = 0;
    std::vector<std::uint8_t> pixels;
  };

  CameraCalibration camera_;
  std::atomic<bool> wanted_{false};
  std::mutex mutex_;
  std::deque<Kept> kept_;
};

}  // namespace ear::live
