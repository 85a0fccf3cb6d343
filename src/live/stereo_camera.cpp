#include "src/live/stereo_camera.h"

#include <cmath>
#include <utility>

#include "src/recording/input_error.h"

namespace ear::live {
namespace {

constexpr int kPatienceMs = 100;

/// Columns of an image from `first` on.
ImageView columns(const ImageView& image, int first, int width) {
  return {image.data + first, width, image.height, image.stride};
}

}  // namespace

ImageView grey_view(const std::uint8_t* from, int width, int height, std::ptrdiff_t stride, PixelLayout layout,
                    std::vector<std::uint8_t>& grey) {
  if (layout == PixelLayout::grey) return {from, width, height, stride};
  const std::ptrdiff_t first = layout == PixelLayout::yuyv ? 0 : 1;  // of two bytes for each pixel
  grey.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::uint8_t* to = grey.data();
  for (std::ptrdiff_t row = 0; row < height; ++row) {
    for (std::ptrdiff_t column = 0; column < width; ++column) *to++ = from[row * stride + 2 * column + first];
  }
  return {grey.data(), width, height, width};
}

StereoCamera::StereoCamera(std::unique_ptr<VideoDevice> left, std::unique_ptr<VideoDevice> right, double delay,
                           Intake& intake)
    : left_(std::move(left)),
      right_(std::move(right)),
      delay_ns_(std::llround(1e9 * delay)),
      intake_(intake),
      thread_([this] { run(); }) {}

StereoCamera::~StereoCamera() {
  stop_ = true;
  thread_.join();
}

void StereoCamera::run() {
  try {
    while (!stop_) {
      if (const auto image = left_->wait(kPatienceMs)) take(*image);
    }
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    failure_ = error.what();
  }
}

void StereoCamera::take(const VideoImage& left) {
  const std::size_t cameras = intake_.calibration().cameras.size();
  if (!right_) {
    const int width = intake_.calibration().cameras.front().width;
    const bool side_by_side = cameras > 1 && left.view.width == 2 * width;
    const ImageView right = side_by_side ? columns(left.view, width, width) : ImageView{};
    hand_in(left.monotonic_ns, side_by_side ? columns(left.view, 0, width) : left.view, right);
    return;
  }
  while (!stop_) {  // the right image of the same instant
    if (!ahead_) ahead_ = right_->wait(kPatienceMs);
    if (!ahead_) break;
    const double later = seconds_between(left.monotonic_ns, ahead_->monotonic_ns);
    if (std::abs(later) <= kTogether) {
      hand_in(left.monotonic_ns, left.view, ahead_->view);
      ahead_.reset();
      return;
    }
    if (later > 0.0) break;
    ahead_.reset();
    ++alone_;
  }
  ++alone_;
  hand_in(left.monotonic_ns, left.view, {});
}

void StereoCamera::hand_in(TimeNs monotonic_ns, const ImageView& left, const ImageView& right) {
  intake_.add(StereoFrame{intake_.clock().from_monotonic(monotonic_ns) - delay_ns_, left, right});
}

std::vector<std::string> StereoCamera::look() {
  std::vector<std::string> words;
  if (alone_ > said_alone_) {
    words.push_back("cameras: " + std::to_string(alone_) +
                    " images have no partner within 3 ms: are both cameras triggered together?");
    said_alone_ = 10 * alone_;
  }
  const std::lock_guard lock(mutex_);
  if (!failure_.empty()) words.push_back("cameras: " + std::exchange(failure_, ""));
  return words;
}

std::unique_ptr<StereoCamera> open_cameras(const LiveSettings& settings, Intake& intake) {
  const CameraSettings& wanted = settings.cameras.value();
  const std::vector<CameraCalibration>& cameras = intake.calibration().cameras;
  if (cameras.empty()) throw InputError(located(settings.file, 0, "cameras", "the calibration has none"));
  if (!wanted.right.empty() && cameras.size() < 2) {
    throw InputError(located(settings.file, 0, "cameras.right", "the calibration has one camera"));
  }
  const bool side_by_side = wanted.right.empty() && cameras.size() > 1;
  const int width = (side_by_side ? 2 : 1) * cameras[0].width;
  auto left = open_v4l2(wanted.device, width, cameras[0].height, wanted.rate_hz);
  std::unique_ptr<VideoDevice> right;
  if (!wanted.right.empty()) right = open_v4l2(wanted.right, cameras[1].width, cameras[1].height, wanted.rate_hz);
  return std::make_unique<StereoCamera>(std::move(left), std::move(right), wanted.delay, intake);
}

}  // namespace ear::live
