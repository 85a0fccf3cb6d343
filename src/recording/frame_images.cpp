#include "src/recording/frame_images.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "src/recording/input_error.h"

namespace ear {
namespace {

ImageView view_of(const cv::Mat& image) {
  if (image.empty()) return {};
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step[0])};
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

}  // namespace

RecordedFrame make_frame(TimeNs t_ns, TimeNs arrival_ns, std::array<cv::Mat, 2> images) {
  auto pixels = std::make_shared<const std::array<cv::Mat, 2>>(std::move(images));
  RecordedFrame frame;
  frame.t_ns = t_ns;
  frame.arrival_ns = arrival_ns;
  frame.left = view_of((*pixels)[0]);
  frame.right = view_of((*pixels)[1]);
  frame.pixels = std::move(pixels);
  return frame;
}

bool ImageSizes::accept(std::size_t camera, int width, int height, const std::filesystem::path& where,
                        Warnings& warnings) {
  const CameraCalibration& expected = cameras_[camera];
  const bool first = !std::exchange(seen_[camera], true);
  if (width == expected.width && height == expected.height) return true;
  const std::string text =
      located(where, 0, "resolution",
              size_text(width, height) + " px, but the calibration says " + size_text(expected.width, expected.height));
  if (first && !any_) throw InputError(text);
  warnings.add("cam" + std::to_string(camera) + ": image size differs from calibration", text);
  return any_;
}

// Time is cut into slots of one wanted period, and the frame nearest to the beginning of each slot is used: half an
// interval before it is early enough, so that stamps may tremble.
bool FrameRate::due(TimeNs t_ns) {
  if (rate_hz_ <= 0.0) return true;
  if (!first_ns_) first_ns_ = t_ns;
  const double interval = seconds_between(std::exchange(last_ns_, t_ns).value_or(t_ns), t_ns);
  const double early = std::min(0.5 * interval * rate_hz_, 0.5);  // in slots; 0.5 after a gap
  const auto slot = static_cast<std::int64_t>(std::floor(seconds_between(*first_ns_, t_ns) * rate_hz_ + early));
  if (last_slot_ && slot <= *last_slot_) return false;
  last_slot_ = slot;
  return true;
}

}  // namespace ear
