#include "smoother/smoother.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/propagation.h"
#include "filter/health/consistency.h"
#include "filter/intake.h"
#include "filter/report.h"

namespace ear::smoother {
namespace {

constexpr double kTakeoffUnseen = 0.1;  // [s] before a take-off is noticed the wheels are wrong
constexpr double kJump = 1.0;  // [m] since the last good frame, beyond twice what the velocity explains: impossible

/// Wheels need the ground's normal: without lasers they are not used.
FilterConfig supported(FilterConfig config, const Calibration& calibration) {
  if (checked(calibration).cameras.empty()) throw std::invalid_argument("smoother: calibration: cameras are needed");
  OdometerModel& model = config.odometer.model;
  if (calibration.encoder && model != OdometerModel::none && model != OdometerModel::terrain) {
    throw std::invalid_argument("smoother: filter.odometer.model: terrain or none");
  }
  if (!calibration.lasers || calibration.lasers->beams.empty()) model = OdometerModel::none;
  return config;
}

/// Does the velocity explain how far the vehicle went from one estimate to the next?
bool explained(const NavState& before, const NavState& now) {
  const double speed = std::max(before.v_W.norm(), now.v_W.norm());
  return (now.p_WB - before.p_WB).norm() < 2.0 * speed * seconds_between(before.t_ns, now.t_ns) + kJump;
}

/// After a change of the ground under the wheels nothing is known of it. A take-off is noticed a moment late.
void note(ContactEvent event, IntervalMeter& meter, Window* window) {
  if (event == ContactEvent::none) return;
  meter.forget_ground();
  if (event == ContactEvent::takeoff && window) window->forget_wheels(kTakeoffUnseen);
}

/// The newest state of the window. `P`: by the window, which does not know of the ground's normal. Its error is counted
/// from that of the attitude, in the world it turns along.
void assume_newest(const Window& window, const GroundNormal& normal, Eigen::MatrixXd P, Ekf& ekf) {
  State x = window.newest();
  const Eigen::Vector3d n_B = normal.known() ? normal.n_B() : Eigen::Vector3d(x.odometer.T_BO.R.col(2));
  x.ground.n_W = x.imu.R_WB * n_B;
  if (normal.known()) {
    const Eigen::Matrix2d turned = tangent_basis(x.ground.n_W).transpose() * x.imu.R_WB * tangent_basis(n_B);
    P.block<2, 2>(err::normal, err::normal) = turned * normal.covariance() * turned.transpose();
  }
  ekf.assume(x, P);
}

}  // namespace

Smoother::Smoother(const FilterConfig& config, const Calibration& calibration)
    : config_(supported(settings_for(checked(config), checked(calibration)), calibration)),
      calibration_(calibration),
      ingest_(config_, calibration),
      ekf_(config_, calibration),
      sources_(config_, calibration),
      start_(config_, calibration),
      consistency_check_(config_.anomaly),
      health_(calibration, sources_.uses_wheels(), sources_.uses_wheels()),
      meter_(config_, calibration) {}

// ---- What happens to a frame

std::optional<Estimate> Smoother::process(const FeatureFrame& given) {
  const FrameStamp stamp = check_stamp(given.t_ns);
  if (stamp == FrameStamp::no_samples) refuse_frame();
  if (stamp != FrameStamp::usable) return std::nullopt;
  const FrameAgreement seen = move_to(ingest_.plausible(given), true);
  return report(true, seen);
}

std::optional<Estimate> Smoother::process_without_image(TimeNs t_ns) {
  if (check_stamp(t_ns) != FrameStamp::usable || (window_ && !sources_.on_ground())) return std::nullopt;
  move_to(FeatureFrame{t_ns, {}}, false);
  return report(false, FrameAgreement{});
}

FrameAgreement Smoother::move_to(const FeatureFrame& frame, bool image) {
  const TimeNs t_ns = imu_time(frame.t_ns, ekf_.state().camera);
  last_frame_ns_ = frame.t_ns;
  consistency_ = Consistency{};
  records_ = records_for(frame, records_, sources_.on_ground());
  sources_.look_at(frame, t_ns, ingest_, ekf_);
  if (window_) return step(frame, t_ns, image);
  start(frame, t_ns);
  const FrameAgreement nothing;
  if (image && health_.check_image(nothing, t_ns, ingest_.imu().newest().t_ns)) {
    sources_.cameras().remember(frame, ekf_);
  }
  return nothing;
}

/// (1), one frame on.
FrameAgreement Smoother::step(const FeatureFrame& frame, TimeNs t_ns, bool image) {
  const State x = ekf_.state();
  if (t_ns <= x.imu.t_ns) {  // readings that come late, and no room for more
    ingest_.drop_before(t_ns + 1);
    return {};
  }
  const bool rolls = sources_.on_ground() && sources_.ground().rolls_at(x.imu.t_ns);
  const bool stands = sources_.standstill().stands();
  const Displacements displacements = sources_.displacements(frame, t_ns, ingest_, ekf_, meter_.normal().known());
  consistency_ = consistency_check_(displacements);
  const Advice advice = advise(consistency_, health_.health(), config_.anomaly);
  NewFrame next = meter_.measure({x, t_ns, displacements, advice, rolls, stands}, ingest_, records_);

  sources_.propagate(t_ns, advice, ingest_, ekf_);  // for the images to be compared with
  FrameAgreement seen;
  if (image && !frame.repeated) seen = sources_.check(frame, ingest_, ekf_);
  seen.frozen = frame.repeated;
  seen.right_skipped = frame.right_skipped;
  const bool use_image = image && health_.check_image(seen, t_ns, ingest_.imu().newest().t_ns);
  next.feature_noise = seen.noise / advice.of(MotionSensor::camera);

  window_->add(next, use_image ? frame.features : std::vector<FeatureObservation>{});
  std::optional<Eigen::MatrixXd> P;
  if (window_->optimize()) P = window_->covariance();
  if (!P) {
    stop();
    return seen;
  }
  assume_newest(*window_, meter_.normal(), std::move(*P), ekf_);
  if (use_image) sources_.cameras().remember(frame, ekf_);
  records_.statistics.standing = stands;
  records_.statistics.features_used = window_->features_used();
  records_.statistics.features_rejected = window_->features_rejected();
  records_.statistics.clones = static_cast<int>(window_->size());
  window_->make_room();
  return seen;
}

/// What is given away of the state, and whether it is.
std::optional<Estimate> Smoother::report(bool image, const FrameAgreement& agreement) {
  std::optional<Estimate> estimate;
  if (window_) {
    const bool ground_known = sources_.on_ground() && meter_.normal().known();
    estimate = make_estimate(ekf_, ground_known, alignment_, 0.0, records_, consistency_);
  }
  const TimeNs t_ns = imu_time(*last_frame_ns_, ekf_.state().camera);
  HealthMonitor::Frame frame = health_frame(t_ns, ekf_, sources_, agreement, records_, estimate);
  frame.image = image;
  frame.waits_for = start_.waits_for();
  if (estimate && last_good_ && health_.usable()) {
    frame.possible = frame.possible && explained(last_good_->state, estimate->state);
  }
  health_.add_frame(frame, records_.log.records());
  if (window_ && (!frame.possible || health_.contradicted())) stop();
  if (!window_ || !health_.usable()) return std::nullopt;
  estimate->health = health_.health();
  if (estimate->health.aiding != Aiding::none) last_good_ = estimate;
  return estimate;
}

// ---- Starts

void Smoother::start_at(const GivenStart& start) {
  if (status() == Status::tracking) throw std::invalid_argument("start: there is an estimate already");
  start_.give(checked(start));
}

/// As the filter does. From there on the window has its state and covariance.
void Smoother::start(const FeatureFrame& frame, TimeNs t_ns) {
  const bool stands = sources_.standstill().stands();
  const Start::Situation now{frame, t_ns, stands, sources_.on_ground(), last_good_.has_value(), ekf_.state().camera};
  const std::optional<StartState> found = start_.find(now, sources_.standstill().recent(ingest_.imu(), t_ns), ingest_);
  if (!found) return;
  alignment_ = start_.begin(*found, last_good_, Advice{}, ingest_, ekf_, sources_, records_);
  sources_.advance(t_ns, Advice{}, ingest_, ekf_, records_);
  sources_.reset();
  const Eigen::MatrixXd P = ekf_.covariance().matrix().topLeftCorner<err::clones, err::clones>();
  window_ = std::make_unique<Window>(config_, focal_length(calibration_), ekf_.state(), P);
  meter_.begin(stands);
  records_.statistics.standing = stands;
  assume_newest(*window_, meter_.normal(), P, ekf_);
}

/// The window came to nothing: it is given up.
void Smoother::stop() {
  window_.reset();
  ekf_.reset();
  sources_.reset();
  ingest_.drop_readings();
  ingest_.interruption() = ImuInterruption{};
}

/// As after construction, but for the clocks, and where the vehicle was last known to be.
void Smoother::restart(TimeNs t_ns, TimeNs clock_shift) {
  Smoother fresh(config_, calibration_);
  ingest_.restart();
  fresh.ingest_ = std::move(ingest_);
  fresh.start_.succeed(start_);
  fresh.health_.succeed(health_, t_ns);
  fresh.alignment_ = alignment_;
  fresh.last_good_ = std::move(last_good_);
  if (fresh.last_good_) fresh.last_good_->state.t_ns += clock_shift;
  *this = std::move(fresh);
}

// ---- Samples in

void Smoother::add_imu(const ImuSample& sample) {
  ingest_.imu_clock().add(sample);
  take_imu();
}

void Smoother::take_imu() {
  ear::take_imu(
      {ingest_, health_, sources_, ekf_}, config_.max_imu_gap,
      [this](const ImuVerdict& verdict, TimeNs t_ns) { restart(t_ns, verdict.clock_shift); },
      [this](TimeNs t_ns) {
        move_to(FeatureFrame{camera_time(t_ns), {}}, false);
      },
      [this](ContactEvent event) { note(event, meter_, window_.get()); });
}

void Smoother::add_encoder(const EncoderSample& sample) {
  if (!sources_.uses_wheels()) return;
  ingest_.imu_clock().observe(ImuClock::Stream::encoder, sample.t_ns);
  take_imu();
  take_encoder(
      {ingest_, health_, sources_, ekf_}, sample,
      [this](TimeNs t_ns) {
        move_to(FeatureFrame{camera_time(t_ns), {}}, false);
      },
      [this](ContactEvent event) { note(event, meter_, window_.get()); });
}

void Smoother::add_laser(const LaserSample& sample) {
  if (!sources_.uses_wheels()) return;
  ingest_.imu_clock().observe(ImuClock::Stream::laser, sample.t_ns);
  take_imu();
  take_laser(
      {ingest_, health_, sources_, ekf_}, sample, *calibration_.lasers,
      [this](TimeNs t_ns) {
        move_to(FeatureFrame{camera_time(t_ns), {}}, false);
      },
      [this](ContactEvent event) { note(event, meter_, window_.get()); });
}

std::optional<TimeNs> Smoother::common_stamp(TimeNs camera_stamp_ns) {
  ingest_.imu_clock().observe(ImuClock::Stream::camera, camera_stamp_ns);
  take_imu();
  return ear::common_stamp({ingest_, health_, sources_, ekf_}, camera_stamp_ns);
}

void Smoother::refuse_frame() {
  if (!ingest_.imu().empty()) health_.add_refused_frame(ingest_.imu().newest().t_ns);
}

// ---- Questions

/// A frame before the newest of the window comes too late, as after its time offset was learned.
FrameStamp Smoother::check_stamp(TimeNs t_ns) const {
  if (last_frame_ns_ && t_ns <= *last_frame_ns_) return FrameStamp::not_later;
  if (!is_time(t_ns)) return FrameStamp::no_samples;
  const TimeNs imu_ns = imu_time(t_ns, ekf_.state().camera);
  if (ekf_.running() && imu_ns <= ekf_.state().imu.t_ns) return FrameStamp::not_later;
  return ingest_.covers(imu_ns) ? FrameStamp::usable : FrameStamp::no_samples;
}

TimeNs Smoother::camera_time(TimeNs imu_time_ns) const { return ear::camera_time(imu_time_ns, ekf_.state().camera); }

Status Smoother::status() const {
  if (window_) return health_.lost() ? Status::lost : Status::tracking;
  if (last_good_) return Status::lost;
  return ingest_.imu().size() < 2 ? Status::waiting_for_imu : Status::waiting_for_standstill;
}

std::optional<RelativeMotion> Smoother::motion_to(TimeNs t_ns) const {
  return motion_since_image(t_ns, ekf_, sources_, start_, ingest_);
}

std::optional<NavState> Smoother::predict(TimeNs t_ns) const {
  if (!window_ || !health_.usable() || !is_time(t_ns)) return std::nullopt;
  if (seconds_between(ingest_.imu().newest().t_ns, t_ns) > kLongestPredict) return std::nullopt;
  return alignment_.to_world(nav_state(integrate_to(t_ns, ekf_.state().imu, ingest_.imu())));
}

}  // namespace ear::smoother
