#include "src/live/feature_images.h"

#include <utility>

#include "src/draw_features.h"

namespace ear::live {

void FeatureImages::take(const StereoFrame& frame) {
  if (!wanted_ || frame.left.width != camera_.width || frame.left.height != camera_.height) return;
  Kept kept{frame.t_ns, {}};
  for (std::ptrdiff_t row = 0; row < frame.left.height; ++row) {
    const std::uint8_t* const begin = frame.left.data + row * frame.left.stride;
    kept.pixels.insert(kept.pixels.end(), begin, begin + frame.left.width);
  }
  const std::lock_guard lock(mutex_);
  kept_.push_back(std::move(kept));
  if (kept_.size() > kMost) kept_.pop_front();
}

std::optional<ros2::Image> FeatureImages::draw(const FeatureFrame& features) {
  Kept kept;
  {
    const std::lock_guard lock(mutex_);
    while (!kept_.empty() && kept_.front().t_ns < features.t_ns) kept_.pop_front();
    if (kept_.empty() || kept_.front().t_ns != features.t_ns) return std::nullopt;
    kept = std::move(kept_.front());
    kept_.pop_front();
  }
  ros2::Image image;
  image.header = {ros2::time_of_stamp(features.t_ns), "cam0"};
  image.width = static_cast<std::uint32_t>(camera_.width);
  image.height = static_cast<std::uint32_t>(camera_.height);
  image.encoding = "bgr8";
  image.step = 3 * image.width;
  image.data = draw_features({kept.pixels.data(), camera_.width, camera_.height, camera_.width}, features, camera_);
  return image;
}

}  // namespace ear::live
