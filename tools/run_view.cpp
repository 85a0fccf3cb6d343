#include "tools/run_view.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>
#include <utility>

#include "src/view/feature_tap.h"
#include "src/view/feed.h"
#include "src/view/server.h"
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
        feed_(describe(recording, opened.calibration(), truth_.known())),
        server_({args.address, args.port, args.token}, feed_) {
    const std::string query = args.token.empty() ? "" : "?token=" + args.token;
    std::fprintf(stderr, "view: http://%s:%d/%s\n", args.address.c_str(), server_.port(), query.c_str());
    if (args.real_time) clock_.emplace(opened.span().first_ns);
  }

  [[nodiscard]] MakeEstimator tapped(MakeEstimator make) const { return view::tapped(std::move(make), tap_); }

  void before_sample(const Sample& sample) {
    if (clock_) clock_->wait_until(time_of(sample));
    if (const auto* frame = std::get_if<RecordedFrame>(&sample)) frames_ = {frames_[1], *frame};
    if (const auto* laser = std::get_if<LaserSample>(&sample)) ranges_ = laser->range;
  }

  void after_frame(const ReplayedFrame& frame, const Odometry& odometry) {
    const std::optional<Eigen::Vector3d> truth = frame.estimate ? truth_.at(frame.estimate->state) : std::nullopt;
    if (!feed_.due()) return;
    view::Moment moment;
    moment.t_ns = frame.t_ns;
    moment.estimate = frame.estimate;
    moment.health = odometry.health();
    moment.counts = odometry.input_counts();
    moment.stages = odometry.stage_times();
    moment.ranges = ranges_;
    moment.truth = truth;
    for (const RecordedFrame& recorded : frames_) {
      if (recorded.t_ns != frame.t_ns || recorded.left.empty()) continue;
      moment.left = recorded.left;
      moment.right = recorded.right;
      moment.pixels = recorded.pixels;
      moment.features = tap_->features();
    }
    feed_.offer(std::move(moment));
  }

  [[nodiscard]] std::string finish() {
    feed_.finish();
    std::this_thread::sleep_for(std::chrono::duration<double>(hold_));
    const view::ServerCounts counts = server_.counts();
    std::array<char, 200> line{};
    std::snprintf(
        line.data(), line.size(),
        "view: %llu requests answered, %llu refused, %llu connections too many, %llu cut off; %llu moments dropped",
        static_cast<unsigned long long>(counts.answered), static_cast<unsigned long long>(counts.refused),
        static_cast<unsigned long long>(counts.crowded), static_cast<unsigned long long>(counts.cut_off),
        static_cast<unsigned long long>(feed_.dropped()));
    return line.data();
  }

 private:
  double hold_;
  ViewTruth truth_;
  std::shared_ptr<view::FeatureTap> tap_ = std::make_shared<view::FeatureTap>();
  std::array<RecordedFrame, 2> frames_;  ///< the last ones: a frame is handed over after the next sample
  std::vector<double> ranges_;
  std::optional<RealTimeClock> clock_;
  view::Feed feed_;
  view::Server server_;  ///< last: its threads read the feed
};

RunView::RunView(const RunViewArguments& args, const std::filesystem::path& recording, const Recording& opened)
    : impl_(std::make_unique<Impl>(args, recording, opened)) {}
RunView::~RunView() = default;
MakeEstimator RunView::tapped(MakeEstimator make) const { return impl_->tapped(std::move(make)); }
void RunView::before_sample(const Sample& sample) { impl_->before_sample(sample); }
void RunView::after_frame(const ReplayedFrame& frame, const Odometry& odometry) { impl_->after_frame(frame, odometry); }
std::string RunView::finish() { return impl_->finish(); }

}  // namespace ear::tools
