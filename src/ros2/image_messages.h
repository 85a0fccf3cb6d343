// sensor_msgs/Image and CompressedImage to 8-bit grey images, and two cameras' images to frames.
#pragma once

#include <array>
#include <deque>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "src/recording/frame_queue.h"
#include "src/recording/warnings.h"
#include "src/ros2/raw_message.h"
#include "src/ros2/stamp_order.h"

namespace ear::ros2 {

/// One camera's image. It owns its pixels.
struct GreyImage {
  TimeNs t_ns = 0;
  TimeNs arrival_ns = 0;  ///< by which frames are ordered among other samples: the stamp, unless the caller says more
  cv::Mat pixels;         ///< 8 bits; empty: could not be read, and a warning says why
};

/// Grey of mono8, 8UC1, mono16, 16UC1 (the upper 8 bits), rgb8, bgr8, rgba8, bgra8, the 8-bit Bayer patterns, yuv422
/// (UYVY) and yuv422_yuy2; of CompressedImage whatever OpenCV reads. `camera` ("cam0") begins warnings. Throws
/// InputError, naming the topic, for other types and encodings, and where fewer pixels came than the size says.
[[nodiscard]] GreyImage grey_image(const RawMessage& message, const std::string& camera, Warnings& warnings);

/// Pairs the images of two cameras whose stamps are within 3 ms, in whatever order they come. A left image whose
/// partner does not come (a later right one did, or eight later left ones) is a frame alone; a right one without a left
/// one is left out. Both are counted. Frames come in the order of time, unless the
/// clock was set back.
class StereoPairing {
 public:
  explicit StereoPairing(bool stereo) : stereo_(stereo) {}

  /// `camera` 0 is left, 1 right. Appends frames that are complete; images whose stamps do not grow are left out, until
  /// five in a row show that the clock was set back.
  void take(std::size_t camera, GreyImage image, std::vector<RecordedFrame>& frames, Warnings& warnings);
  /// What waits, at the end.
  void finish(std::vector<RecordedFrame>& frames, Warnings& warnings);

 private:
  void match(std::vector<RecordedFrame>& frames, Warnings& warnings);
  void emit(std::vector<RecordedFrame>& frames, const GreyImage& right);

  bool stereo_;
  std::array<std::deque<GreyImage>, 2> waiting_;
  std::array<StampOrder, 2> order_;
};

}  // namespace ear::ros2
