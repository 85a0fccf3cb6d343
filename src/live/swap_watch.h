// Looks at the first images of two cameras: are left and right exchanged?
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "src/swapped_cameras.h"

namespace ear::live {

/// The cameras' thread hands in all frames, another one looks at some of them. Neither waits.
class SwapWatch {
 public:
  SwapWatch(const CameraCalibration& left, const CameraCalibration& right);

  /// By the cameras' thread: copies a pair if one is wanted.
  void take(const StereoFrame& frame);
  /// By one other thread, a few times a second: matches the pair that was copied; once, words about cameras that are
  /// swapped, else "".
  [[nodiscard]] std::string look();

 private:
  SwappedCameras cameras_;
  int width_, height_;
  std::mutex mutex_;  ///< of what follows
  enum class Copy { wanted, there, done } copy_ = Copy::wanted;
  std::vector<std::uint8_t> left_, right_;
};

}  // namespace ear::live
