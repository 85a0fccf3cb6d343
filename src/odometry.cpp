// Samples -> sensor buffer -> front end -> filter -> Estimate.
#include "ear/odometry.h"

#include <chrono>
#include <stdexcept>

#include "filter/filter.h"
#include "frontend/frontend.h"

namespace ear {
namespace {

MotionPrediction to_prediction(const std::optional<RelativeMotion>& motion) {
  MotionPrediction prediction;
  if (!motion) return prediction;
  prediction.R_B1B0 = motion->R_B1B0;
  prediction.p_B0B1 = motion->p_B0B1;
  prediction.rotation_known = true;
  prediction.translation_known = motion->translation_known;
  return prediction;
}

}  // namespace

class Odometry::Impl {
 public:
  Impl(const Config& config, const Calibration& calibration)
      : config_(config),
        calibration_(calibration),
        filter_(config.filter, calibration),
        frontend_(config.frontend, calibration.cameras) {}

  void add_imu(const ImuSample& sample) { filter_.add_imu(sample); }

  std::optional<Estimate> add_stereo(const StereoFrame& frame) {
    stage_times_ = StageTimes{};
    if (any_frame_ && frame.t_ns <= last_frame_ns_) {
      ++frames_rejected_;
      return std::nullopt;
    }
    if (!filter_.covers(frame.t_ns)) {
      ++frames_without_imu_;
      return std::nullopt;
    }
    const FeatureFrame* const features = track(frame);
    if (features == nullptr) {
      ++frames_rejected_;
      return std::nullopt;
    }
    any_frame_ = true;
    last_frame_ns_ = frame.t_ns;

    const auto start = std::chrono::steady_clock::now();
    std::optional<Estimate> estimate = filter_.process(*features);
    stage_times_.filter = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return estimate;
  }

  [[nodiscard]] const Filter& filter() const { return filter_; }
  [[nodiscard]] const StageTimes& stage_times() const { return stage_times_; }

  [[nodiscard]] InputCounts input_counts() const {
    return {filter_.imu_counts().rejected, filter_.imu_counts().gaps, frames_rejected_, frames_without_imu_};
  }

  [[nodiscard]] Calibration calibration() const {
    Calibration learned = calibration_;
    const CameraState& camera = filter_.state().camera;
    const auto isometry = [](const Pose& T) {
      Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
      result.linear() = T.R;
      result.translation() = T.p;
      return result;
    };
    learned.cameras.front().T_BC = isometry(camera.T_BC0);
    if (learned.cameras.size() == 2) learned.cameras[1].T_BC = isometry(camera.T_BC0) * isometry(camera.T_C0C1);
    learned.camera_time_offset = camera.time_offset;
    return learned;
  }

  [[nodiscard]] Impl fresh() const { return Impl(config_, calibration_); }

 private:
  /// The frame's features; nothing if its images do not fit the calibration.
  const FeatureFrame* track(const StereoFrame& frame) {
    const MotionPrediction prediction = to_prediction(filter_.motion_to(frame.t_ns));
    try {
      const FeatureFrame& features = frontend_.process(frame, prediction);
      const FrontendTiming& timing = frontend_.timing();
      stage_times_.pyramid = timing.pyramid;
      stage_times_.track = timing.track;
      stage_times_.detect = timing.detect;
      stage_times_.stereo = timing.stereo;
      stage_times_.reject = timing.reject;
      return &features;
    } catch (const std::invalid_argument&) {  // one bad image must not take the vehicle its estimator; it is counted
      return nullptr;
    }
  }

  Config config_;
  Calibration calibration_;
  Filter filter_;
  Frontend frontend_;
  StageTimes stage_times_;
  bool any_frame_ = false;
  TimeNs last_frame_ns_ = 0;
  std::uint64_t frames_rejected_ = 0;
  std::uint64_t frames_without_imu_ = 0;
};

Odometry::Odometry(const Config& config, const Calibration& calibration)
    : impl_(std::make_unique<Impl>(config, calibration)) {}
Odometry::~Odometry() = default;
Odometry::Odometry(Odometry&&) noexcept = default;
Odometry& Odometry::operator=(Odometry&&) noexcept = default;

void Odometry::add_imu(const ImuSample& sample) { impl_->add_imu(sample); }
std::optional<Estimate> Odometry::add_stereo(const StereoFrame& frame) { return impl_->add_stereo(frame); }
std::optional<NavState> Odometry::predict(TimeNs t_ns) const { return impl_->filter().predict(t_ns); }
Status Odometry::status() const { return impl_->filter().status(); }
InputCounts Odometry::input_counts() const { return impl_->input_counts(); }
StageTimes Odometry::stage_times() const { return impl_->stage_times(); }
Calibration Odometry::calibration() const { return impl_->calibration(); }
void Odometry::reset() { *impl_ = impl_->fresh(); }

}  // namespace ear
