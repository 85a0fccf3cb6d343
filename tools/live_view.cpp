#include "tools/live_view.h"

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "filter/filter.h"
#include "tools/estimator_view.h"

namespace ear::tools {
namespace {

view::Description describe(const std::string& title, const Calibration& calibration) {
  view::Description description;
  description.title = title;
  description.calibration = calibration;
  description.live = true;
  return description;
}

/// A frame that owns its pixels.
struct KeptFrame {
  StereoFrame frame;
  std::vector<std::uint8_t> left, right;
};

std::vector<std::uint8_t> copied(ImageView& view) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  for (std::ptrdiff_t row = 0; row < view.height; ++row) {
    const std::uint8_t* const begin = view.data + row * view.stride;
    pixels.insert(pixels.end(), begin, begin + view.width);
  }
  if (!view.empty()) view = {pixels.data(), view.width, view.height, view.width};
  return pixels;
}

std::shared_ptr<const KeptFrame> kept(const StereoFrame& frame) {
  auto copy = std::make_shared<KeptFrame>();
  copy->frame = frame;
  copy->left = copied(copy->frame.left);
  copy->right = copied(copy->frame.right);
  return copy;
}

}  // namespace

class LiveView::Impl {
 public:
  Impl(const ViewArguments& args, const std::string& title, const Calibration& calibration)
      : view_(args, describe(title, calibration)) {}

  [[nodiscard]] live::Onlooker onlooker() {
    const MakeEstimator filter = [](const FilterConfig& config, const Calibration& calibration) {
      return std::make_unique<Filter>(config, calibration);
    };
    return {view_.tapped(filter),
            [this](const StereoFrame& frame) {
              if (view_.due()) frame_ = kept(frame);
            },
            [this](const live::LiveFrame& frame, const Odometry& odometry) { take(frame, odometry); }};
  }

  [[nodiscard]] std::string finish() {
    view_.finish();
    return view_.counts();
  }

 private:
  void take(const live::LiveFrame& frame, const Odometry& odometry) {
    const std::shared_ptr<const KeptFrame> images = std::exchange(frame_, nullptr);  // none of a step without
    if (!view_.due()) return;
    view::Moment moment = view_.moment(frame.t_ns, frame.estimate, odometry);
    if (images) view_.add_images(images->frame, images, moment);
    view_.offer(std::move(moment));
  }

  EstimatorView view_;
  std::shared_ptr<const KeptFrame> frame_;  ///< at hand; null unless it is to be shown
};

LiveView::LiveView(const ViewArguments& args, const std::string& title, const Calibration& calibration)
    : impl_(std::make_unique<Impl>(args, title, calibration)) {}
LiveView::~LiveView() = default;
live::Onlooker LiveView::onlooker() { return impl_->onlooker(); }
std::string LiveView::finish() { return impl_->finish(); }

}  // namespace ear::tools
