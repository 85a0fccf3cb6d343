// One or two video devices to stereo frames, on a thread of its own.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "src/live/intake.h"
#include "src/live/live_settings.h"
#include "src/live/video_device.h"

namespace ear::live {

class StereoCamera {
 public:
  /// With `right` null, images of `left` are twice as wide as the calibration's where that has two cameras: left and
  /// right, side by side. `delay` [s]: from the middle of the exposure to the driver's stamp. `intake` must outlive it.
  StereoCamera(std::unique_ptr<VideoDevice> left, std::unique_ptr<VideoDevice> right, double delay, Intake& intake);
  ~StereoCamera();
  StereoCamera(const StereoCamera&) = delete;
  StereoCamera& operator=(const StereoCamera&) = delete;
  StereoCamera(StereoCamera&&) = delete;
  StereoCamera& operator=(StereoCamera&&) = delete;

  /// By another thread, a few times a second: what changed, in words.
  [[nodiscard]] std::vector<std::string> look();

  static constexpr double kTogether = 0.003;  ///< [s] between the stamps of two devices' images of one instant

 private:
  void run();
  void take(const VideoImage& left);
  void hand_in(TimeNs monotonic_ns, const ImageView& left, const ImageView& right);

  std::unique_ptr<VideoDevice> left_, right_;
  TimeNs delay_ns_;
  Intake& intake_;
  std::optional<VideoImage> ahead_;  ///< of the right device: too late for the left image before
  std::atomic<std::uint64_t> alone_{0};
  std::uint64_t said_alone_ = 0;
  std::mutex mutex_;  ///< of the words
  std::string failure_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;  ///< last: it uses all else
};

/// Opens the video devices of `settings.cameras`, which must be there. Throws InputError where the calibration does not
/// fit them, and std::runtime_error as open_v4l2().
[[nodiscard]] std::unique_ptr<StereoCamera> open_cameras(const LiveSettings& settings, Intake& intake);

}  // namespace ear::live
