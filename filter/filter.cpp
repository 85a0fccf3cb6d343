#include "filter/filter.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/propagation.h"
#include "filter/health/consistency.h"
#include "filter/intake.h"
#include "filter/report.h"

namespace ear {
namespace {

constexpr double kJumpNoticed = 0.3;  // [s] chosen: until a bias that jumped is found out

/// A bias that jumped took the motion along until it was found out. Both are less well known by what was observed.
void watch_biases(BiasWatch& watch, Ekf& ekf, HealthMonitor& health) {
  const BiasJump jump = watch.judge(ekf.take_bias_changes(), ekf.state().imu.t_ns);
  if (!jump.any()) return;
  ekf.inflate_motion(jump.gyro * kJumpNoticed, jump.accel * kJumpNoticed,
                     0.5 * jump.accel * kJumpNoticed * kJumpNoticed);
  ekf.inflate_biases(jump.gyro, jump.accel);
  health.report_imu_fault(jump.fault.gyro, jump.fault.accel, ekf.state().imu.t_ns);
}

}  // namespace

Filter::Filter(const FilterConfig& config, const Calibration& calibration)
    : config_(settings_for(checked(config), checked(calibration))),
      calibration_(calibration),
      ingest_(config_, calibration),
      ekf_(config_, calibration),
      sources_(config_, calibration),
      start_(config_, calibration),
      consistency_check_(config.anomaly),
      health_(calibration, sources_.uses_wheels(), config.odometer.model == OdometerModel::terrain) {}

// ---- What happens to a frame

std::optional<Estimate> Filter::process(const FeatureFrame& given) {
  const FrameStamp stamp = check_stamp(given.t_ns);
  if (stamp == FrameStamp::no_samples) refuse_frame();
  if (stamp != FrameStamp::usable) return std::nullopt;
  const FeatureFrame& frame = ingest_.plausible(given);

  propagate_to(frame);  // start, or compare the sensors (13)-(15) and take in wheels (5)-(8) and lasers (2)-(4)

  FrameAgreement seen;
  if (ekf_.running()) {
    if (!frame.repeated) seen = sources_.check(frame, ingest_, ekf_);
    seen.frozen = frame.repeated;
  }
  seen.right_skipped = frame.right_skipped;
  const TimeNs t_ns = imu_time(frame.t_ns, ekf_.state().camera);
  const bool use_image = health_.check_image(seen, t_ns, ingest_.imu().newest().t_ns);
  if (ekf_.running()) {
    const Advice advice = advise(consistency_, health_.health(), config_.anomaly);
    if (use_image) {
      sources_.use_image(frame, sources_.standstill().stands(), advice, ekf_, records_);
    } else {
      sources_.go_without_image(advice, ekf_, records_);
    }
    watch_biases(bias_watch_, ekf_, health_);
  }
  if (use_image) sources_.cameras().remember(frame, ekf_);
  return report(true, seen);
}

std::optional<Estimate> Filter::process_without_image(TimeNs t_ns) {
  if (check_stamp(t_ns) != FrameStamp::usable) return std::nullopt;
  if (sources_.cameras().count() > 0 && !sources_.on_ground()) return std::nullopt;
  propagate_to(FeatureFrame{t_ns, {}});
  if (ekf_.running()) {
    sources_.go_without_image(advise(consistency_, health_.health(), config_.anomaly), ekf_, records_);
    watch_biases(bias_watch_, ekf_, health_);
  }
  return report(false, FrameAgreement{});
}

void Filter::propagate_to(const FeatureFrame& frame) {
  const TimeNs t_ns = imu_time(frame.t_ns, ekf_.state().camera);
  last_frame_ns_ = frame.t_ns;
  consistency_ = Consistency{};
  records_.outcomes = outcomes();
  records_ = records_for(frame, records_, sources_.on_ground());
  sources_.look_at(frame, t_ns, ingest_, ekf_);
  if (ekf_.running()) {
    consistency_ = consistency_check_(sources_.displacements(frame, t_ns, ingest_, ekf_, sources_.ground().known()));
    sources_.score_imu(frame, consistency_, ekf_);
    sources_.advance(t_ns, advise(consistency_, health_.health(), config_.anomaly), ingest_, ekf_, records_);
  }
  if (!ekf_.running() || health_.lost()) {
    start(frame);
  } else {
    start_.forget_frames();
  }
}

/// What is given away of the state, and whether it is.
std::optional<Estimate> Filter::report(bool image, const FrameAgreement& agreement) {
  std::optional<Estimate> estimate;
  const double scale_sigma = start_.scale_is_given() ? config_.prior.wheel_scale : 0.0;
  if (ekf_.running()) {
    estimate = make_estimate(ekf_, sources_.ground().known(), alignment_, scale_sigma, records_, consistency_);
  }
  const TimeNs t_ns = imu_time(*last_frame_ns_, ekf_.state().camera);
  HealthMonitor::Frame frame = health_frame(t_ns, ekf_, sources_, agreement, records_, estimate);
  frame.image = image;
  frame.waits_for = start_.waits_for();
  health_.add_frame(frame, records_.log.records());
  if (frame.running && !frame.possible) stop();
  if (!estimate || !ekf_.running() || !health_.usable()) return std::nullopt;
  estimate->health = health_.health();
  if (estimate->health.aiding != Aiding::none) last_good_ = estimate;
  return estimate;
}

// ---- Starts

void Filter::start_at(const GivenStart& start) {
  if (status() == Status::tracking) throw std::invalid_argument("start: there is an estimate already");
  start_.give(checked(start));
}

/// While lost, the state goes on, and is good again if the cameras come to agree with it. Where they do not, but agree
/// with the inertial samples, it is the state that is wrong, and begins anew.
void Filter::start(const FeatureFrame& frame) {
  const bool lost = ekf_.running();
  const CameraState given = camera_state(calibration_);  // what was learned may be as wrong as the rest
  const TimeNs t_ns = imu_time(frame.t_ns, given);
  const ImuStatistics recent = lost ? ImuStatistics{} : sources_.standstill().recent(ingest_.imu(), t_ns);
  const bool restarts = lost || without_state_ == Status::lost;
  if (!restarts) without_state_ = recent.count < 2 ? Status::waiting_for_imu : Status::waiting_for_standstill;
  const Start::Situation now{frame, t_ns, sources_.standstill().stands(), sources_.on_ground(), restarts, given};
  const std::optional<StartState> found =
      lost ? start_.find_in_motion(now, ingest_, health_.contradicted()) : start_.find(now, recent, ingest_);
  if (!found) return;
  if (lost) stop();
  const Advice advice = advise(consistency_, health_.health(), config_.anomaly);
  alignment_ = start_.begin(*found, last_good_, advice, ingest_, ekf_, sources_, records_);
  sources_.advance(imu_time(frame.t_ns, ekf_.state().camera), advice, ingest_, ekf_, records_);
}

/// Nothing of the state is used any more.
void Filter::stop() {
  without_state_ = Status::lost;
  ekf_.reset();
  sources_.reset();
  ingest_.drop_readings();
  ingest_.interruption() = ImuInterruption{};
  bias_watch_ = BiasWatch{};
}

/// As after construction, but for the clocks, and where the vehicle was last known to be.
void Filter::restart(TimeNs t_ns, TimeNs clock_shift) {
  Filter fresh(config_, calibration_);
  ingest_.restart();
  fresh.ingest_ = std::move(ingest_);
  fresh.start_.succeed(start_);
  fresh.health_.succeed(health_, t_ns);
  fresh.alignment_ = alignment_;
  fresh.last_good_ = std::move(last_good_);
  fresh.report_tracks(outcomes());
  if (fresh.last_good_) fresh.last_good_->state.t_ns += clock_shift;
  if (ekf_.running() || without_state_ == Status::lost) fresh.without_state_ = Status::lost;
  *this = std::move(fresh);
}

// ---- Samples in

void Filter::add_imu(const ImuSample& sample) {
  ingest_.imu_clock().add(sample);
  take_imu();
}

void Filter::take_imu() {
  ear::take_imu(
      {ingest_, health_, sources_, ekf_}, config_.max_imu_gap,
      [this](const ImuVerdict& verdict, TimeNs t_ns) { restart(t_ns, verdict.clock_shift); },
      [this](TimeNs t_ns) { sources_.propagate(t_ns, Advice{}, ingest_, ekf_); }, [](ContactEvent) {});
}

void Filter::add_encoder(const EncoderSample& sample) {
  if (!sources_.uses_wheels()) return;
  ingest_.imu_clock().observe(ImuClock::Stream::encoder, sample.t_ns);
  take_imu();
  take_encoder(
      {ingest_, health_, sources_, ekf_}, sample,
      [this](TimeNs t_ns) { sources_.advance(t_ns, Advice{}, ingest_, ekf_, records_); }, [](ContactEvent) {});
}

void Filter::add_laser(const LaserSample& sample) {
  if (!sources_.uses_wheels() || !calibration_.lasers || calibration_.lasers->beams.empty()) return;
  ingest_.imu_clock().observe(ImuClock::Stream::laser, sample.t_ns);
  take_imu();
  take_laser(
      {ingest_, health_, sources_, ekf_}, sample, *calibration_.lasers,
      [this](TimeNs t_ns) { sources_.advance(t_ns, Advice{}, ingest_, ekf_, records_); }, [](ContactEvent) {});
}

std::optional<TimeNs> Filter::common_stamp(TimeNs camera_stamp_ns) {
  ingest_.imu_clock().observe(ImuClock::Stream::camera, camera_stamp_ns);
  take_imu();
  return ear::common_stamp({ingest_, health_, sources_, ekf_}, camera_stamp_ns);
}

void Filter::refuse_frame() {
  if (!ingest_.imu().empty()) health_.add_refused_frame(ingest_.imu().newest().t_ns);
}

// ---- Questions

FrameStamp Filter::check_stamp(TimeNs t_ns) const {
  if (last_frame_ns_ && t_ns <= *last_frame_ns_) return FrameStamp::not_later;
  const bool covered = is_time(t_ns) && ingest_.covers(imu_time(t_ns, ekf_.state().camera));
  return covered ? FrameStamp::usable : FrameStamp::no_samples;
}

TimeNs Filter::camera_time(TimeNs imu_time_ns) const { return ear::camera_time(imu_time_ns, ekf_.state().camera); }

Status Filter::status() const {
  if (!ekf_.running()) return without_state_;
  return health_.lost() ? Status::lost : Status::tracking;
}

std::optional<RelativeMotion> Filter::motion_to(TimeNs t_ns) const {
  return motion_since_image(t_ns, ekf_, sources_, start_, ingest_);
}

std::optional<NavState> Filter::predict(TimeNs t_ns) const {
  if (!ekf_.running() || !health_.usable() || !is_time(t_ns)) return std::nullopt;
  if (seconds_between(ingest_.imu().newest().t_ns, t_ns) > kLongestPredict) return std::nullopt;
  return alignment_.to_world(nav_state(integrate_to(t_ns, ekf_.state().imu, ingest_.imu())));
}

}  // namespace ear
