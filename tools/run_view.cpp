#include "tools/run_view.h"

#include <array>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "tools/estimator_view.h"
#include "tools/real_time.h"
#include "tools/view_truth.h"

namespace ear::tools {
namespace {

view::Description describe(const std::filesystem::path& recording, const Calibration& calibration, bool has_truth) {
  view::Description description;
  const std::filesystem::path folder = recording.has_filename() ? recording : recording.parent_path();
  description.title = folder.filename().string();
  description.calibration = calibration;
  description.has_truth = has_truth;
  return description;
}

}  // namespace

class RunView::Impl {
 public:
  Impl(const RunViewArguments& args, const std::filesystem::path& recording, const Recording& opened)
      : hold_(args.hold),
        truth_(recording),
        view_(args.server, describe(recording, opened.calibration(), truth_.known())) {
    if (args.real_time) clock_.emplace(opened.span().first_ns);
  }

  [[nodiscard]] MakeEstimator tapped(MakeEstimator make) const { return view_.tapped(std::move(make)); }

  void before_sample(const Sample& sample) {
    const auto* const imu = std::get_if<ImuSample>(&sample);
    if (clock_ && imu != nullptr) clock_->wait_until(imu->t_ns);  // the others come between these
    if (const auto* frame = std::get_if<RecordedFrame>(&sample)) frames_ = {frames_[1], *frame};
  }

  void after_frame(const ReplayedFrame& frame, const Odometry& odometry) {
    const std::optional<Eigen::Vector3d> truth = frame.estimate ? truth_.at(frame.estimate->state) : std::nullopt;
    if (!view_.due()) return;
    view::Moment moment = view_.moment(frame.t_ns, frame.estimate, odometry);
    moment.truth = truth;
    for (const RecordedFrame& recorded : frames_) {
      if (recorded.t_ns == frame.t_ns && !recorded.left.empty()) view_.add_images(recorded, recorded.pixels, moment);
    }
    view_.offer(std::move(moment));
  }

  [[nodiscard]] std::string finish() {
    view_.finish();
    std::this_thread::sleep_for(std::chrono::duration<double>(hold_));
    return view_.counts();
  }

 private:
  double hold_;
  ViewTruth truth_;
  EstimatorView view_;
  std::array<RecordedFrame, 2> frames_;  ///< the last ones: a frame is handed over after the next sample
  std::optional<RealTimeClock> clock_;
};

RunView::RunView(const RunViewArguments& args, const std::filesystem::path& recording, const Recording& opened)
    : impl_(std::make_unique<Impl>(args, recording, opened)) {}
RunView::~RunView() = default;
MakeEstimator RunView::tapped(MakeEstimator make) const { return impl_->tapped(std::move(make)); }
void RunView::before_sample(const Sample& sample) { impl_->before_sample(sample); }
void RunView::after_frame(const ReplayedFrame& frame, const Odometry& odometry) { impl_->after_frame(frame, odometry); }
std::string RunView::finish() { return impl_->finish(); }

}  // namespace ear::tools
