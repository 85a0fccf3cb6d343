#include "smoother/smoother.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "filter/ekf/initial_state.h"

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
  if (!has_beams(calibration)) model = OdometerModel::none;
  return config;
}

/// Does the velocity explain how far the vehicle went from one estimate to the next?
bool explained(const NavState& before, const NavState& now) {
  const double speed = std::max(before.v_W.norm(), now.v_W.norm());
  return (now.p_WB - before.p_WB).norm() < 2.0 * speed * seconds_between(before.t_ns, now.t_ns) + kJump;
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
    : CommonEstimator(supported(settings_for(checked(config), checked(calibration)), calibration), calibration),
      meter_(config_, calibration) {}

// ---- What happens to a frame

std::optional<Estimate> Smoother::process(const FeatureFrame& given) {
  if (sources_.shows_nothing(given, ekf_)) return process_without_image(given.t_ns);
  const FrameStamp stamp = check_stamp(given.t_ns);
  if (stamp == FrameStamp::no_samples) refuse_frame();
  if (stamp != FrameStamp::usable) return std::nullopt;
  const FrameAgreement seen = move_to(ingest_.plausible(given), true);
  return report(true, seen);
}

std::optional<Estimate> Smoother::process_without_image(TimeNs t_ns) {
  if (check_stamp(t_ns) != FrameStamp::usable || (window_ && !sources_.on_ground())) return std::nullopt;
  if (ingest_.waits_for_imu(time_of(ekf_))) return std::nullopt;
  move_to(FeatureFrame{t_ns, {}}, false);
  return report(false, FrameAgreement{});
}

FrameAgreement Smoother::move_to(const FeatureFrame& frame, bool image) {
  const TimeNs t_ns = begin_frame(frame);
  if (window_) return step(frame, t_ns, image);
  start(frame, t_ns);
  const FrameAgreement nothing;
  if (image && health_.check_image(nothing, imu_time(frame.t_ns, ekf_.state().camera)))
    sources_.cameras().remember(frame, ekf_);
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
  const Advice advice = this->advice();
  NewFrame next = meter_.measure({x, t_ns, displacements, advice, rolls, stands}, ingest_, records_);

  sources_.propagate(t_ns, advice, ingest_, ekf_);  // for the images to be compared with
  const FrameAgreement seen = image ? sources_.check(frame, ingest_, ekf_) : FrameAgreement{};
  const bool use_image = image && health_.check_image(seen, t_ns);
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

std::optional<Estimate> Smoother::report(bool image, const FrameAgreement& seen) {
  const std::optional<Estimate> estimate = make_estimate(sources_.on_ground() && meter_.normal().known(), {});
  HealthMonitor::Frame frame = health_frame(image, seen, estimate);
  if (estimate && last_good_ && health_.usable()) {
    frame.possible = frame.possible && explained(last_good_->state, estimate->state);
  }
  health_.add_frame(frame, records_.log.records());
  if (window_ && (!health_.possible() || health_.contradicted())) stop();
  return give(estimate);
}

// ---- Starts

/// As the filter does. From there on the window has its state and covariance.
void Smoother::start(const FeatureFrame& frame, TimeNs t_ns) {
  Start::Situation now{frame, t_ns, sources_.standstill().recent(ingest_.imu(), t_ns)};
  now.stands = sources_.standstill().stands();
  now.rolls = sources_.on_ground();
  const std::optional<StartState> found = start_.find(now, ingest_);
  if (!found) return;
  alignment_ = start_.begin(*found, last_good_, Advice{}, ingest_, ekf_, sources_, records_);
  sources_.advance(t_ns, Advice{}, ingest_, ekf_, records_);
  sources_.reset();
  const Eigen::MatrixXd P = ekf_.covariance().matrix().topLeftCorner<err::clones, err::clones>();
  window_ = std::make_unique<Window>(config_, focal_length(calibration_), ekf_.state(), P);
  meter_.begin(now.stands);
  records_.statistics.standing = now.stands;
  assume_newest(*window_, meter_.normal(), P, ekf_);
}

/// The window came to nothing: it is given up.
void Smoother::stop() {
  window_.reset();
  forget_state();
}

void Smoother::restart(TimeNs t_ns, TimeNs clock_shift) {
  Smoother fresh(config_, calibration_);
  fresh.succeed(*this, t_ns, clock_shift);
  *this = std::move(fresh);
}

void Smoother::make_room(TimeNs t_ns) { move_to(FeatureFrame{camera_time(t_ns), {}}, false); }

/// After a change of the ground under the wheels nothing is known of it. A take-off is noticed a moment late.
void Smoother::note(ContactEvent event) {
  if (event == ContactEvent::none) return;
  meter_.forget_ground();
  if (event == ContactEvent::takeoff && window_) window_->forget_wheels(kTakeoffUnseen);
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

Status Smoother::status() const {
  if (window_) return health_.lost() ? Status::lost : Status::tracking;
  if (last_good_) return Status::lost;
  return ingest_.imu().size() < 2 ? Status::waiting_for_imu : Status::waiting_for_standstill;
}

}  // namespace ear::smoother
