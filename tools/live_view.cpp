#include "tools/live_view.h"

#include <array>
#include <atomic>
#include <limits>
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

/// A frame whose pixels the view may have.
struct Kept {
  QueuedFrame frame;
  std::atomic<bool> shown{false};  ///< the view has them
};

constexpr TimeNs kNoFrame = std::numeric_limits<TimeNs>::min();

}  // namespace

class LiveView::Impl {
 public:
  Impl(const ViewArguments& args, const std::string& title, const Calibration& calibration)
      : cameras_(calibration.cameras), view_(args, describe(title, calibration)) {
    for (Kept& kept : kept_) kept.frame = empty_frame(cameras_);
  }

  [[nodiscard]] live::Onlooker onlooker() {
    const MakeEstimator filter = [](const FilterConfig& config, const Calibration& calibration) {
      return std::make_unique<Filter>(config, calibration);
    };
    return {view_.tapped(filter), [this] { return keep(); },
            [this](const live::LiveFrame& frame, const Odometry& odometry) { take(frame, odometry); }};
  }

  [[nodiscard]] std::string finish() {
    view_.finish();
    return view_.counts();
  }

 private:
  /// Where the next frame is to go, if it is to be shown.
  QueuedFrame* keep() {
    next_ = nullptr;
    if (!view_.due()) return nullptr;
    for (Kept& kept : kept_) {
      if (kept.shown.load(std::memory_order_acquire)) continue;
      next_ = &kept;
      kept.frame.t_ns = kNoFrame;
      return &kept.frame;
    }
    return nullptr;
  }

  void take(const live::LiveFrame& frame, const Odometry& odometry) {
    Kept* const kept = std::exchange(next_, nullptr);
    if (!view_.due()) return;
    view::Moment moment = view_.moment(frame.t_ns, frame.estimate, odometry);
    if (kept != nullptr && kept->frame.t_ns != kNoFrame) {  // else this was a step without images
      kept->shown = true;
      const std::shared_ptr<const void> pixels(kept, [](Kept* k) { k->shown.store(false, std::memory_order_release); });
      view_.add_images(view_of(kept->frame, cameras_), pixels, moment);
    }
    view_.offer(std::move(moment));
  }

  std::vector<CameraCalibration> cameras_;
  std::array<Kept, 3> kept_;  ///< one at hand, one that waits in the feed, one that it works on
  Kept* next_ = nullptr;      ///< where the frame at hand goes
  EstimatorView view_;        ///< last: its feed's thread uses kept_
};

LiveView::LiveView(const ViewArguments& args, const std::string& title, const Calibration& calibration)
    : impl_(std::make_unique<Impl>(args, title, calibration)) {}
LiveView::~LiveView() = default;
live::Onlooker LiveView::onlooker() { return impl_->onlooker(); }
std::string LiveView::finish() { return impl_->finish(); }

}  // namespace ear::tools
