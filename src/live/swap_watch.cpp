#include "src/live/swap_watch.h"

#include <algorithm>

namespace ear::live {
namespace {

void copy(const ImageView& from, std::vector<std::uint8_t>& to) {
  to.clear();
  for (std::ptrdiff_t row = 0; row < from.height; ++row) {
    const std::uint8_t* const begin = from.data + row * from.stride;
    to.insert(to.end(), begin, begin + from.width);
  }
}

}  // namespace

SwapWatch::SwapWatch(const CameraCalibration& left, const CameraCalibration& right)
    : cameras_(left, right), width_(left.width), height_(left.height) {
  if (right.width != width_ || right.height != height_) copy_ = Copy::done;  // their sizes would show it
}

void SwapWatch::take(const StereoFrame& frame) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || copy_ != Copy::wanted || frame.right.empty()) return;
  copy(frame.left, left_);
  copy(frame.right, right_);
  copy_ = Copy::there;
}

std::string SwapWatch::look() {
  const std::lock_guard lock(mutex_);
  if (copy_ != Copy::there) return "";
  cameras_.add({left_.data(), width_, height_, width_}, {right_.data(), width_, height_, width_});
  copy_ = cameras_.verdict() == SwappedCameras::Verdict::open ? Copy::wanted : Copy::done;
  if (cameras_.verdict() != SwappedCameras::Verdict::swapped) return "";
  const int matches = cameras_.exchanged() + cameras_.as_stated();
  return "cameras: left and right are swapped: " + std::to_string(cameras_.exchanged()) + " of " +
         std::to_string(matches) + " features that both see would lie behind them";
}

}  // namespace ear::live
