#include "filter/filter.h"

#include <cmath>
#include <utility>

#include "filter/ekf/initial_state.h"
#include "filter/ingest/limits.h"

namespace ear {

Filter::Filter(const FilterConfig& config, const Calibration& calibration)
    : CommonEstimator(settings_for(checked(config), checked(calibration)), calibration),
      waiting_(static_cast<std::size_t>(config.window)) {}

// ---- What happens to a frame

std::optional<Estimate> Filter::process(const FeatureFrame& given) {
  if (sources_.shows_nothing(given, ekf_)) return process_without_image(given.t_ns);
  const FrameStamp stamp = check_stamp(given.t_ns);
  if (stamp == FrameStamp::no_samples) wait_for_imu(given);
  if (stamp != FrameStamp::usable) return std::nullopt;
  for (; !waiting_.empty(); waiting_.pop()) {
    const FeatureFrame& frame = waiting_.front();
    if (frame.t_ns < given.t_ns && check_stamp(frame.t_ns) == FrameStamp::usable) process_usable(frame);
  }
  return process_usable(given);
}

/// Until there are inertial samples again, or a later frame has some: where these are missing, the frames between show
/// how the vehicle moved. Of more than there is room for, the newest ones and every other one before.
void Filter::wait_for_imu(const FeatureFrame& frame) {
  refuse_frame();
  if (!ekf_.running()) return;
  if (waiting_.full()) waiting_.keep_every_other();
  waiting_.push(frame);
}

std::optional<Estimate> Filter::process_usable(const FeatureFrame& given) {
  const FeatureFrame& frame = ingest_.plausible(given);

  propagate_to(frame);  // start, or compare the sensors (13)-(15) and take in wheels (5)-(8) and lasers (2)-(4)

  const FrameAgreement seen = sources_.check(frame, ingest_, ekf_);
  const bool use_image = health_.check_image(seen, imu_time(frame.t_ns, ekf_.state().camera));
  if (ekf_.running()) {
    sources_.update(use_image ? &frame : nullptr, sources_.standstill().stands(), advice(), ekf_, records_);
    watch_biases();
  }
  if (use_image) sources_.cameras().remember(frame, ekf_);
  return report(true, seen);
}

std::optional<Estimate> Filter::process_without_image(TimeNs t_ns) {
  if (check_stamp(t_ns) != FrameStamp::usable) return std::nullopt;
  if (sources_.cameras().count() > 0 && !sources_.on_ground()) return std::nullopt;
  if (ingest_.waits_for_imu(time_of(ekf_))) return std::nullopt;
  propagate_to(FeatureFrame{t_ns, {}});
  if (ekf_.running()) {
    sources_.update(nullptr, sources_.standstill().stands(), advice(), ekf_, records_);
    watch_biases();
  }
  return report(false, FrameAgreement{});
}

void Filter::propagate_to(const FeatureFrame& frame) {
  const TimeNs t_ns = begin_frame(frame);
  if (ekf_.running()) {
    consistency_ = consistency_check_(sources_.displacements(frame, t_ns, ingest_, ekf_, sources_.ground().known()));
    take_in(sources_.score_imu(frame, ekf_, records_));
    sources_.advance(t_ns, advice(), ingest_, ekf_, records_);
  }
  if (!ekf_.running() || health_.lost()) {
    start(frame);
  } else {
    start_.forget_frames();
  }
}

/// By wheels alone a bias that jumped looks the same as a wheel that slips.
void Filter::watch_biases() {
  const bool by_wheels_alone = sources_.uses_wheels() && !sources_.cameras().show_motion(ekf_.state());
  const BiasChanges changes = ekf_.take_bias_changes();
  const TimeNs t_ns = ekf_.state().imu.t_ns;
  const BiasJump jump = bias_watch_.judge(by_wheels_alone ? BiasChanges::discarded() : changes, t_ns);
  if (jump.any()) take_in(jump, t_ns);
}

/// What is more than any bias has another cause: sensors that are mounted elsewhere, clocks that differ.
void Filter::take_in(const ImuExcess& excess) {
  BiasJump jump;
  jump.fault = {excess.gyro > 0.0, excess.accel > 0.0};
  const ImuLimits limits = imu_limits(config_.prior);
  if (excess.gyro < limits.gyro) jump.gyro = excess.gyro;
  if (excess.accel < limits.accel) jump.accel = excess.accel;
  if (jump.fault.any()) take_in(jump, ekf_.state().imu.t_ns);
  if (config_.online_calibration.time_offset && excess.clock > 0.0) ekf_.inflate_clock(excess.clock);
}

/// A bias that jumped took the motion along until it was found out, for as long as the watch remembers. Both are less
/// well known by what was observed.
void Filter::take_in(const BiasJump& jump, TimeNs t_ns) {
  ekf_.inflate_motion(jump.gyro * kStale, jump.accel * kStale, 0.0);
  ekf_.inflate(err::b_g, bias_sigma(jump.gyro, jump.accel));
  health_.report_imu_fault(jump.fault, t_ns);
}

std::optional<Estimate> Filter::report(bool image, const FrameAgreement& seen) {
  if (health_.contradicted() && last_good_) alignment_.doubt(last_good_->state, ekf_.state().imu.t_ns);
  UnseenScales scales;
  scales.length = start_.scale_is_given() ? config_.prior.wheel_scale : sources_.cameras().scale_sigma();
  if (calibration_.cameras.empty()) scales.turn = config_.prior.gyro_unseen;
  const std::optional<Estimate> estimate = make_estimate(sources_.ground().known(), scales);
  const HealthMonitor::Frame frame = health_frame(image, seen, estimate);
  health_.add_frame(frame, records_.log.records());
  if (frame.running && !health_.possible()) stop();
  return give(estimate);
}

// ---- Starts

/// While lost, the state goes on, and is good again if the cameras come to agree with it. Where they do not, but agree
/// with the inertial samples, it is the state that is wrong, and begins anew; so it is where there is no camera, and
/// the wheels do not agree with it.
void Filter::start(const FeatureFrame& frame) {
  const bool lost = ekf_.running();
  const TimeNs t_ns = imu_time(frame.t_ns, camera_state(calibration_));  // what was learned may be as wrong as the rest
  Start::Situation now{frame, t_ns, lost ? ImuStatistics{} : sources_.standstill().recent(ingest_.imu(), t_ns)};
  now.stands = sources_.standstill().stands();
  now.rolls = sources_.on_ground();
  if (sources_.wheels()) now.wheel_noise = sources_.wheels()->shown_noise();
  now.lost = lost;
  now.contradicted = health_.contradicted();
  if (!lost && without_state_ != Status::lost)
    without_state_ = now.recent.count < 2 ? Status::waiting_for_imu : Status::waiting_for_standstill;
  const std::optional<StartState> found = start_.find(now, ingest_);
  if (!found) return;
  if (lost) stop();
  const Advice advice = this->advice();
  alignment_ = start_.begin(*found, last_good_, advice, ingest_, ekf_, sources_, records_);
  sources_.advance(imu_time(frame.t_ns, ekf_.state().camera), advice, ingest_, ekf_, records_);
}

void Filter::stop() {
  without_state_ = Status::lost;
  forget_state();
  bias_watch_ = BiasWatch{};
}

void Filter::restart(TimeNs t_ns, TimeNs clock_shift) {
  Filter fresh(config_, calibration_);
  fresh.succeed(*this, t_ns, clock_shift);
  fresh.set_window(sources_.cameras().window());
  if (ekf_.running() || without_state_ == Status::lost) fresh.without_state_ = Status::lost;
  *this = std::move(fresh);
}

void Filter::make_room(TimeNs t_ns) { sources_.advance(t_ns, Advice{}, ingest_, ekf_, records_); }

// ---- Questions

FrameStamp Filter::check_stamp(TimeNs t_ns) const {
  if (last_frame_ns_ && t_ns <= *last_frame_ns_) return FrameStamp::not_later;
  const TimeNs at_ns = imu_time(t_ns, ekf_.state().camera);
  if (ekf_.running() && at_ns <= ekf_.state().imu.t_ns) return FrameStamp::not_later;  // it learned of another clock
  const bool covered = is_time(t_ns) && ingest_.covers(at_ns);
  return covered ? FrameStamp::usable : FrameStamp::no_samples;
}

Status Filter::status() const {
  if (!ekf_.running()) return without_state_;
  return health_.lost() ? Status::lost : Status::tracking;
}

}  // namespace ear
