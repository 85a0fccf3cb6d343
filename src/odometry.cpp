// Samples -> ingest -> front end -> filter -> Estimate.
#include "ear/odometry.h"

#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

#include "filter/filter.h"
#include "filter/ingest/limits.h"
#include "frontend/frontend.h"
#include "src/event_log.h"
#include "src/load_governor.h"
#include "src/odometry_factory.h"

namespace ear {
namespace {

MotionPrediction to_prediction(const std::optional<RelativeMotion>& motion) {
  MotionPrediction prediction;
  if (!motion) return prediction;
  prediction.R_B1B0 = motion->R_B1B0;
  prediction.p_B0B1 = motion->p_B0B1;
  prediction.rotation_known = motion->rotation_known;
  prediction.translation_known = motion->translation_known;
  return prediction;
}

double machine_time() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

class Odometry::Impl {
 public:
  Impl(const Config& config, const Calibration& calibration, MakeEstimator make, Clock clock)
      : config_(config),
        calibration_(calibration),
        clock_(std::move(clock)),
        make_(std::move(make)),
        estimator_(make_(config.filter, calibration)),
        load_(1e-3 * config.performance.budget_ms, {config.frontend.max_features, config.filter.window, 1, 1}) {
    if (!(config.performance.budget_ms >= 0.0)) {
      throw std::invalid_argument("performance.budget_ms: a time, or 0 for no limit");
    }
    if (!calibration.cameras.empty()) frontend_.emplace(config.frontend, calibration.cameras);
  }

  void add_imu(const ImuSample& sample) { estimator_->add_imu(sample); }
  void add_encoder(const EncoderSample& sample) { estimator_->add_encoder(sample); }
  void add_laser(const LaserSample& sample) { estimator_->add_laser(sample); }

  void start_at(const GivenStart& start) { estimator_->start_at(start); }

  std::optional<Estimate> add_stereo(const StereoFrame& given) {
    std::optional<Estimate> estimate = process(given);
    events_.note(given.t_ns, health(), input_counts());
    return estimate;
  }

  std::optional<Estimate> step(TimeNs t_ns) {
    std::optional<Estimate> estimate = process_step(t_ns);
    events_.note(t_ns, health(), input_counts());
    return estimate;
  }

  [[nodiscard]] const Estimator& estimator() const { return *estimator_; }
  [[nodiscard]] const StageTimes& stage_times() const { return stage_times_; }
  [[nodiscard]] FeatureFrame features() const { return features_ == nullptr ? FeatureFrame{} : *features_; }

  [[nodiscard]] InputCounts input_counts() const {
    InputCounts counts = estimator_->input_counts();
    counts.camera = camera_;
    counts.steps_rejected = steps_.rejected();
    return counts;
  }

  [[nodiscard]] Calibration calibration() const {
    Calibration learned = calibration_;
    const auto [camera, odometer] = estimator_->calibration();
    const auto isometry = [](const Pose& T) {
      Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
      result.linear() = T.R;
      result.translation() = T.p;
      return result;
    };
    if (!learned.cameras.empty()) learned.cameras.front().T_BC = isometry(camera.T_BC0);
    if (learned.cameras.size() == 2) learned.cameras[1].T_BC = isometry(camera.T_BC0) * isometry(camera.T_C0C1);
    for (std::size_t i = 0; i < learned.cameras.size(); ++i) {
      CameraCalibration& intrinsics = learned.cameras[i];
      const LensError& error = camera.lens_error[i];
      intrinsics.cu += intrinsics.fu * error.principal_point.x();
      intrinsics.cv += intrinsics.fv * error.principal_point.y();
      intrinsics.fu *= 1.0 + error.focal_length;
      intrinsics.fv *= 1.0 + error.focal_length;
    }
    learned.camera_time_offset = camera.time_offset;
    if (learned.encoder) {
      learned.encoder->wheel_radius = {odometer.wheel_radius(0), odometer.wheel_radius(1)};
      learned.encoder->track_width = odometer.track_width;
      learned.encoder->time_offset += odometer.time_offset;
      learned.encoder->T_BO = isometry(odometer.T_BO);
    }
    if (learned.lasers) {
      for (std::size_t i = 0; i < learned.lasers->beams.size(); ++i) {
        LaserBeam& beam = learned.lasers->beams[i];
        beam.p_BL -= odometer.beam_offset(static_cast<Eigen::Index>(i)) * beam.d_B;
      }
    }
    return learned;
  }

  [[nodiscard]] Impl fresh() const { return Impl(config_, calibration_, make_, clock_); }

  [[nodiscard]] Health health() const {
    Health health = estimator_->health();
    health.load_step = load_.step();
    return health;
  }

 private:
  std::optional<Estimate> process(const StereoFrame& given) {
    stage_times_ = StageTimes{};
    const std::optional<TimeNs> stamp_ns = estimator_->common_stamp(given.t_ns);
    if (!stamp_ns) {
      ++camera_.far_ahead;
      return std::nullopt;
    }
    StereoFrame frame = given;
    frame.t_ns = *stamp_ns;
    const bool usable = accepts(frame.t_ns, camera_);
    if (!usable && !may_wait(frame.t_ns)) return std::nullopt;
    if (!takes_turn(frame.t_ns)) {
      if (usable) {
        note_frame(frame.t_ns);
      } else {
        estimator_->refuse_frame();
      }
      return std::nullopt;
    }
    const double start = clock_();
    const bool one_waits = features_ != nullptr && last_frame_ns_ && features_->t_ns > *last_frame_ns_;
    MotionPrediction prediction;  // from the image before: the estimator knows nothing of one that waits
    if (!one_waits && config_.frontend.motion_prediction) {
      prediction = to_prediction(estimator_->motion_to(frame.t_ns));
    }
    const FeatureFrame* const features = features_ = track(frame, prediction);
    if (features == nullptr) {
      if (usable) {
        ++camera_.implausible;
      } else {
        estimator_->refuse_frame();
      }
      return std::nullopt;
    }
    if (usable) note_frame(frame.t_ns);
    std::optional<Estimate> estimate = timed([&] { return estimator_->process(*features); });
    load_.add(clock_() - start, frame.t_ns);
    return estimate;
  }

  std::optional<Estimate> process_step(TimeNs t_ns) {
    stage_times_ = StageTimes{};
    if (!is_time(t_ns)) {
      ++steps_.implausible;
      return std::nullopt;
    }
    const TimeNs stamp_ns = estimator_->camera_time(t_ns);
    if (!accepts(stamp_ns, steps_)) return std::nullopt;
    return timed([&] { return estimator_->process_without_image(stamp_ns); });
  }

  /// Is a frame with this stamp later than the one before, and are its inertial samples there? Counts those that are
  /// not.
  bool accepts(TimeNs t_ns, StreamCounts& counts) const {
    if (!is_time(t_ns)) {
      ++counts.implausible;
      return false;
    }
    switch (estimator_->check_stamp(t_ns)) {
      case FrameStamp::usable:
        return true;
      case FrameStamp::not_later:
        ++counts.not_later;
        break;
      case FrameStamp::no_samples:
        ++counts.far_ahead;
        break;
    }
    return false;
  }

  /// For inertial samples. The first image after others were missing too does not: with the next one samples will show
  /// where its features are.
  bool may_wait(TimeNs t_ns) {
    if (!is_time(t_ns) || estimator_->check_stamp(t_ns) != FrameStamp::no_samples) return false;
    if (features_ != nullptr && seconds_between(features_->t_ns, t_ns) <= kStreamGap) return true;
    estimator_->refuse_frame();
    return false;
  }

  /// Whether this frame is used at all, and how much of it: as the budget allows.
  bool takes_turn(TimeNs t_ns) {
    const LoadLimits limits = load_.limits();
    if (++frames_left_out_ < limits.frame_every) {
      load_.add(0.0, t_ns);
      return false;
    }
    frames_left_out_ = 0;
    const bool use_right = ++frames_without_right_ >= limits.stereo_every;
    if (use_right) frames_without_right_ = 0;
    if (frontend_) frontend_->set_limits(limits.max_features, use_right);
    estimator_->set_window(limits.window);
    return true;
  }

  void note_frame(TimeNs t_ns) {
    if (last_frame_ns_ && seconds_between(*last_frame_ns_, t_ns) > kStreamGap) ++camera_.gaps;
    last_frame_ns_ = t_ns;
    ++camera_.accepted;
  }

  /// What the estimator's work comes to, and how long it takes.
  template <typename Work>
  std::optional<Estimate> timed(const Work& work) {
    const auto start = std::chrono::steady_clock::now();
    std::optional<Estimate> estimate = work();
    stage_times_.filter = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (estimate) estimate->health.load_step = load_.step();
    return estimate;
  }

  /// The frame's features; nothing if its images do not fit the calibration.
  const FeatureFrame* track(const StereoFrame& frame, const MotionPrediction& prediction) {
    if (!frontend_) return nullptr;
    try {
      const FeatureFrame& features = frontend_->process(frame, prediction);
      const FrontendTiming& timing = frontend_->timing();
      stage_times_.pyramid = timing.pyramid;
      stage_times_.track = timing.track;
      stage_times_.detect = timing.detect;
      stage_times_.stereo = timing.stereo;
      stage_times_.reject = timing.reject;
      return &features;
    } catch (const std::exception& error) {  // one bad image must not take the vehicle its estimator; it is counted
      events_.note_unusable(frame.t_ns, error.what());
      return nullptr;
    }
  }

  Config config_;
  Calibration calibration_;
  Clock clock_;
  MakeEstimator make_;
  std::unique_ptr<Estimator> estimator_;
  std::optional<Frontend> frontend_;  ///< with a camera
  LoadGovernor load_;
  int frames_left_out_ = 0;                 ///< in a row
  int frames_without_right_ = 0;            ///< frames used in a row whose right image was not
  const FeatureFrame* features_ = nullptr;  ///< the front end's, of the last image
  StageTimes stage_times_;
  StreamCounts camera_;
  StreamCounts steps_;
  std::optional<TimeNs> last_frame_ns_;
  EventLog events_;
};

Odometry::Odometry(const Config& config, const Calibration& calibration, Clock clock)
    : Odometry(OdometryFactory::make(
          config, calibration,
          [](const FilterConfig& filter, const Calibration& given) { return std::make_unique<Filter>(filter, given); },
          std::move(clock))) {}
Odometry::Odometry(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Odometry::~Odometry() = default;
Odometry::Odometry(Odometry&&) noexcept = default;
Odometry& Odometry::operator=(Odometry&&) noexcept = default;

void Odometry::start_at(const GivenStart& start) { impl_->start_at(start); }
void Odometry::add_imu(const ImuSample& sample) { impl_->add_imu(sample); }
void Odometry::add_encoder(const EncoderSample& sample) { impl_->add_encoder(sample); }
void Odometry::add_laser(const LaserSample& sample) { impl_->add_laser(sample); }
std::optional<Estimate> Odometry::step(TimeNs t_ns) { return impl_->step(t_ns); }
std::optional<Estimate> Odometry::add_stereo(const StereoFrame& frame) { return impl_->add_stereo(frame); }
std::optional<NavState> Odometry::predict(TimeNs t_ns) const { return impl_->estimator().predict(t_ns); }
TimeNs Odometry::frame_time(TimeNs stamp_ns) const { return impl_->estimator().frame_time(stamp_ns); }
Status Odometry::status() const { return impl_->estimator().status(); }
Health Odometry::health() const { return impl_->health(); }
InputCounts Odometry::input_counts() const { return impl_->input_counts(); }
StageTimes Odometry::stage_times() const { return impl_->stage_times(); }
FeatureFrame Odometry::features() const { return impl_->features(); }
Calibration Odometry::calibration() const { return impl_->calibration(); }
void Odometry::reset() { *impl_ = impl_->fresh(); }

Odometry OdometryFactory::make(const Config& config, const Calibration& calibration, MakeEstimator make, Clock clock) {
  if (!clock) clock = machine_time;
  return Odometry(std::make_unique<Odometry::Impl>(config, calibration, std::move(make), std::move(clock)));
}

}  // namespace ear
