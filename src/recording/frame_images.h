// Images to frames: what all sources of recordings have in common.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ear/calibration.h"
#include "src/recording/frame_queue.h"

namespace ear {

/// A frame that shares the memory of its images (8-bit grey); an empty one is none.
[[nodiscard]] RecordedFrame make_frame(TimeNs t_ns, TimeNs arrival_ns, std::array<cv::Mat, 2> images);

/// Compares images with their camera's calibration. A camera whose first image does not fit is unusable.
class ImageSizes {
 public:
  /// `any`: accept images of any size, with a warning.
  ImageSizes(std::vector<CameraCalibration> cameras, bool any) : cameras_(std::move(cameras)), any_(any) {}

  /// The image's size is right; or may be used all the same. Throws InputError if the first of a camera is not.
  /// `where`: the image's place, for messages.
  [[nodiscard]] bool accept(std::size_t camera, int width, int height, const std::filesystem::path& where,
                            Warnings& warnings);

 private:
  std::vector<CameraCalibration> cameras_;
  bool any_;
  std::array<bool, 2> seen_{};
};

/// Leaves out frames to reach a lower rate.
class FrameRate {
 public:
  /// `rate_hz` 0 keeps all frames.
  explicit FrameRate(double rate_hz) : rate_hz_(rate_hz) {}
  /// To be asked for every frame, in the order of time.
  [[nodiscard]] bool due(TimeNs t_ns);

 private:
  double rate_hz_;
  std::optional<TimeNs> first_ns_;
  std::optional<TimeNs> last_ns_;
  std::optional<std::int64_t> last_slot_;
};

}  // namespace ear
