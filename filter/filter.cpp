#include "filter/filter.h"

#include <algorithm>
#include <cmath>

#include "filter/capacity.h"
#include "filter/displacements.h"
#include "filter/ground.h"
#include "filter/initial_state.h"

namespace ear {
namespace {

constexpr std::size_t kImuCapacity = 4096;   // 20 s at 200 Hz, 4 s at 1 kHz
constexpr std::size_t kWheelCapacity = 512;  // readings that wait for the state to pass them
constexpr double kRollingWindow = 2.0;       // [s] of samples kept for a start while rolling
constexpr double kLongestPredict = 0.5;      // [s] beyond the newest sample
constexpr double kWheelAge = 0.1;            // [s] older readings do not tell whether the wheels rest
constexpr double kHeldSample = 0.04;         // [s] so far the newest IMU sample may stand in for one that is missing
constexpr double kLifting = 0.3;             // [s] after wheels that leave the ground, or meet it, as it seems
constexpr std::size_t kMaxCompared = 512;    // features of a frame whose motion is compared with other sensors

constexpr int kLeastWindow = 3;    // clones
constexpr int kClonePairRows = 9;  // that a measurement between the state and one clone has

int error_capacity(const FilterConfig& config) { return err::clone(config.window + 1); }

}  // namespace

Filter::Filter(const FilterConfig& config, const Calibration& calibration)
    : config_(checked(config)),
      calibration_(checked(calibration)),
      focal_px_(focal_length(calibration)),
      beam_count_(calibration.lasers ? static_cast<int>(calibration.lasers->beams.size()) : 0),
      gate_(config.gate_probability, 4 * (config.window + 1)),
      covariance_(error_capacity(config)),
      imu_(kImuCapacity),
      guard_(calibration, config.max_imu_gap),
      impact_guard_(config.impact, calibration.imu),
      turns_(kWheelCapacity),
      ranges_(kWheelCapacity),
      displacement_turns_(kWheelCapacity),
      contact_(config.contact, calibration),
      standstill_(config.standstill, focal_px_),
      tracks_(2 * kFeatureCapacity, static_cast<std::size_t>(config.window) + 1),
      consistency_check_(config.anomaly),
      camera_displacement_(config.feature_sigma_px / focal_px_, kMaxCompared),
      frame_check_(config.feature_sigma_px / focal_px_, gate_(2)),
      monitor_(calibration, calibration.encoder && config.odometer.model != OdometerModel::none,
               config.odometer.model == OdometerModel::terrain),
      moving_start_({config.prior.gyro_bias, config.prior.accel_bias, config.feature_sigma_px / focal_px_}),
      rows_(kClonePairRows, error_capacity(config)),
      information_(config.window + 1, config.max_track_updates) {
  state_.camera = camera_state(calibration);
  state_.odometer = odometer_state(calibration);
  if (calibration.encoder && config.odometer.model != OdometerModel::none) encoder_.emplace(*calibration.encoder);
  set_window(config.window);
  take_memory();
}

void Filter::set_window(int clones) {
  const int least = std::min(kLeastWindow, config_.window);
  window_ = static_cast<std::size_t>(std::clamp(clones, least, config_.window));
}

/// All that process() and the samples will need.
void Filter::take_memory() {
  const auto clones = static_cast<std::size_t>(config_.window) + 1;
  state_.clones.reserve(clones);
  last_features_.features.reserve(kFeatureCapacity);
  cameras_.reserve(2 * clones);
  sightings_.reserve(2 * clones);
  observations_.reserve(2 * clones);
  selected_.reserve(2 * kFeatureCapacity);
  frame_ids_.reserve(kFeatureCapacity);
  parallax_.reserve(2 * kFeatureCapacity);
}

TimeNs Filter::imu_time(TimeNs camera_time_ns) const {
  return camera_time_ns + static_cast<TimeNs>(std::llround(1e9 * state_.camera.time_offset));
}

TimeNs Filter::camera_time(TimeNs imu_time_ns) const {
  return imu_time_ns - static_cast<TimeNs>(std::llround(1e9 * state_.camera.time_offset));
}

bool Filter::is_next(TimeNs t_ns) const { return !any_frame_ || t_ns > last_frame_ns_; }

bool Filter::covers(TimeNs t_ns) const {
  return is_time(t_ns) && !imu_.empty() && seconds_between(imu_.newest().t_ns, imu_time(t_ns)) < kHeldSample;
}

void Filter::add_imu(const ImuSample& sample) {
  clocks_.imu.add(sample);
  take_waiting_imu();
}

void Filter::hear(ImuClock::Stream stream, TimeNs t_ns) {
  const int mended = clocks_.imu.jumps_corrected();
  clocks_.imu.hear(stream, t_ns);
  take_waiting_imu();
  if (clocks_.imu.jumps_corrected() != mended) monitor_.accuse_imu(true, true, imu_.newest().t_ns);
}

void Filter::take_waiting_imu() {
  while (const std::optional<ImuSample> sample = clocks_.imu.next()) take_imu(*sample);
}

/// The newest inertial sample, where that tells the time: not while its clock is in doubt.
std::optional<TimeNs> Filter::now() const {
  if (imu_.empty() || clocks_.imu.waiting() || guard_.refuses_imu()) return std::nullopt;
  return imu_.newest().t_ns;
}

void Filter::take_imu(const ImuSample& sample) {
  const ImuVerdict verdict = guard_.judge(sample);
  if (!verdict.accepted) {
    monitor_.add_refused_imu();
    return;
  }
  if (verdict.begins_anew) restart(sample.t_ns, verdict.clock_shift);
  monitor_.add_imu(sample, config_.max_imu_gap);
  if (!imu_.empty() && verdict.unseen > config_.max_imu_gap) {
    imu_gap_ = ImuGap{imu_.newest().t_ns, sample.t_ns, verdict.unseen};
  }
  // Without frames for long, the state moves on before its samples are overwritten.
  if (status_ == Status::tracking && imu_.size() == kImuCapacity && state_.imu.t_ns < imu_[kImuCapacity / 2].t_ns) {
    advance(imu_[kImuCapacity / 2].t_ns);
  }
  mend_spike(sample);
  const ImuNoiseFactors noise = impact_guard_.add(sample);
  imu_.doubt_newest(static_cast<std::size_t>(impact_guard_.clipped_before()), noise);
  imu_.push(sample, noise);
  if (encoder_) note_contact(contact_.add_imu(sample));
}

std::optional<TimeNs> Filter::state_time() const {
  return status_ == Status::tracking ? std::optional(state_.imu.t_ns) : std::nullopt;
}

void Filter::add_encoder(const EncoderSample& given) {
  if (!encoder_) return;
  hear(ImuClock::Stream::encoder, given.t_ns);
  EncoderSample sample = given;
  const std::optional<TimeNs> stamp = clocks_.encoder.correct(given.t_ns, now());
  if (stamp) sample.t_ns = *stamp;
  const Verdict verdict = stamp ? guard_.judge(sample, state_time(), *encoder_) : guard_.refuse_encoder();
  if (!imu_.empty()) monitor_.add_encoder(sample, verdict, imu_.newest().t_ns);
  if (verdict != Verdict::accepted) return;
  note_contact(contact_.add_encoder(sample));
  const std::optional<WheelIncrement> turn = encoder_->add(sample);
  if (!turn) return;
  wheel_rest_.add(*turn);
  if (status_ == Status::tracking) {
    if (turns_.full()) advance_measuring(turns_.front().to_ns);  // no frames for long
  } else {
    const auto too_old = [&] { return seconds_between(turns_.front().from_ns, turn->to_ns) > kRollingWindow; };
    while (!turns_.empty() && (turns_.full() || too_old())) turns_.pop();
  }
  turns_.push(*turn);
}

void Filter::add_laser(const LaserSample& sample) {
  if (!encoder_ || beam_count_ == 0) return;
  hear(ImuClock::Stream::laser, sample.t_ns);
  const Verdict verdict = guard_.judge(sample, state_time());
  if (!imu_.empty()) monitor_.add_laser(sample, verdict, *calibration_.lasers, imu_.newest().t_ns);
  if (verdict != Verdict::accepted) return;
  note_contact(contact_.add_laser(sample));
  if (status_ == Status::tracking) {
    if (ranges_.full()) advance_measuring(ranges_.front().t_ns);
  } else {
    const auto too_old = [&] { return seconds_between(ranges_.front().t_ns, sample.t_ns) > kRollingWindow; };
    while (!ranges_.empty() && (ranges_.full() || too_old())) ranges_.pop();
  }
  ranges_.push(BeamRanges(sample));
}

std::optional<TimeNs> Filter::common_stamp(TimeNs camera_stamp_ns) {
  hear(ImuClock::Stream::camera, camera_stamp_ns);
  if (!is_time(camera_stamp_ns)) return camera_stamp_ns;
  const std::optional<TimeNs> stamp = clocks_.camera.correct(camera_stamp_ns, now());
  if (!stamp) monitor_.accuse_cameras(imu_.newest().t_ns);
  return stamp;
}

std::optional<RelativeMotion> Filter::motion_to(TimeNs t_ns) const {
  if (!is_time(t_ns) || !any_image_ || imu_.empty() || t_ns <= last_image_ns_) return std::nullopt;
  if (status_ != Status::tracking) {
    RelativeMotion motion;
    if (const std::optional<Eigen::Vector3d> way = moving_start_.way_to(imu_time(t_ns))) {
      motion.p_B0B1 = *way;
      motion.translation_known = true;
    }
    Eigen::Matrix3d R_B0B1 = Eigen::Matrix3d::Identity();
    imu_.for_each_piece(
        imu_time(last_image_ns_), imu_time(t_ns),
        [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt) { R_B0B1 *= exp_so3(gyro_B * dt); });
    motion.R_B1B0 = R_B0B1.transpose();
    return motion;
  }
  return motion_between(image_pose(), predict_here(imu_time(t_ns)));
}

std::optional<Estimate> Filter::process(const FeatureFrame& given) {
  if (!is_next(given.t_ns)) return std::nullopt;
  if (!covers(given.t_ns)) {
    refuse_frame();
    return std::nullopt;
  }
  const FeatureFrame& frame = guard_.sound(given);
  const bool repeats = repeats_last_image(frame);
  if (repeats && status_ != Status::tracking) noiseless_camera_ = true;
  const bool frozen = repeats && !noiseless_camera_;
  const bool still = begin_frame(frame, frozen);
  FrameAgreement agreement;
  agreement.frozen = frozen;
  if (status_ == Status::tracking && !frozen) {
    bridge(frame);
    agreement = check_frame(frame);
  }
  const bool usable = monitor_.check_image(agreement, imu_time(frame.t_ns), imu_.newest().t_ns);
  if (status_ == Status::tracking) {
    if (usable) {
      use_image(frame, still);
    } else {
      go_on_blind(still);
    }
    watch_biases(seconds_between(watched_ns_, state_.imu.t_ns));
  }
  watched_ns_ = state_.imu.t_ns;
  if (usable) note_image(frame);
  return finish_frame(true, agreement);
}

/// What is said of the state, and whether it is given away.
std::optional<Estimate> Filter::finish_frame(bool image, const FrameAgreement& agreement) {
  HealthMonitor::Frame frame;
  frame.t_ns = imu_time(last_frame_ns_);
  frame.image = image;
  frame.right = !right_skipped_;
  frame.running = status_ == Status::tracking;
  frame.agreement = agreement;
  frame.statistics = statistics_;
  frame.lifted = lifted_ns_ && seconds_between(*lifted_ns_, frame.t_ns) < kLifting;
  std::optional<Estimate> estimate;
  if (frame.running) {
    estimate = make_estimate();
    frame.possible = possible();
  }
  if (frame.possible && estimate) {
    const auto variance = estimate->covariance.diagonal().cwiseMax(0.0);
    frame.speed = state_.imu.v_W.norm();
    // As the vehicle sees it, without that of the heading.
    frame.velocity_sigma = std::sqrt(covariance_.matrix().diagonal().segment<3>(err::nu).cwiseMax(0.0).maxCoeff());
    frame.horizontal_sigma = std::sqrt(variance.segment<2>(estimate_error::position).maxCoeff());
    frame.vertical_sigma = std::sqrt(variance(estimate_error::position + 2));
  }
  monitor_.add_frame(frame, log_.records());
  if (frame.running && !frame.possible) stop();
  if (!estimate || !usable()) return std::nullopt;
  estimate->health = monitor_.health();
  if (estimate->health.aiding != Aiding::none) last_good_ = estimate;
  return estimate;
}

/// Are the state and its covariance numbers, and no variance negative?
bool Filter::possible() const {
  const ImuState& x = state_.imu;
  const OdometerState& o = state_.odometer;
  const auto P = covariance_.matrix();
  const bool finite = x.R_WB.allFinite() && x.p_WB.allFinite() && x.v_W.allFinite() && x.b_g.allFinite() &&
                      x.b_a.allFinite() && state_.camera.T_BC0.R.allFinite() && state_.camera.T_BC0.p.allFinite() &&
                      o.wheel_radius.allFinite() && std::isfinite(o.track_width) && o.T_BO.R.allFinite() &&
                      state_.ground.n_W.allFinite() && std::isfinite(P.sum());  // one that is not makes the sum so
  return finite && P.diagonal().minCoeff() >= 0.0;
}

InputCounts Filter::input_counts() const {
  InputCounts counts = guard_.counts();
  counts.clock_jumps =
      static_cast<std::uint64_t>(clocks_.imu.jumps_corrected() + clocks_.encoder.jumps() + clocks_.camera.jumps());
  return counts;
}

void Filter::refuse_frame() {
  if (!imu_.empty()) monitor_.add_refused_frame(imu_.newest().t_ns);
}

/// May the state be given away?
bool Filter::usable() const {
  const HealthStatus status = monitor_.health().status;
  return status_ == Status::tracking && (status == HealthStatus::tracking || status == HealthStatus::degraded);
}

Status Filter::status() const { return status_ == Status::tracking && monitor_.lost() ? Status::lost : status_; }

std::optional<Estimate> Filter::process_without_image(TimeNs t_ns) {
  if (!covers(t_ns) || !is_next(t_ns)) return std::nullopt;
  if (!calibration_.cameras.empty() && !on_ground()) return std::nullopt;
  FeatureFrame nothing;
  nothing.t_ns = t_ns;
  const bool still = begin_frame(nothing, false);
  if (status_ == Status::tracking) {
    go_on_blind(still);
    if (calibration_.cameras.empty()) learn_calibration_ = !statistics_.standing;
    watch_biases(seconds_between(watched_ns_, state_.imu.t_ns));
  }
  watched_ns_ = state_.imu.t_ns;
  return finish_frame(false, FrameAgreement{});
}

/// What comes before anything is done with the features: start if possible, propagate. Does the vehicle stand?
bool Filter::begin_frame(const FeatureFrame& frame, bool frozen) {
  any_frame_ = true;
  last_frame_ns_ = frame.t_ns;
  right_skipped_ = frame.right_skipped;
  statistics_ = FrameStatistics{};
  feature_noise_ = noise_of(frame);
  consistency_ = Consistency{};
  log_.start_frame();
  statistics_.tracks = static_cast<int>(frame.features.size());
  statistics_.stereo = static_cast<int>(std::count_if(frame.features.begin(), frame.features.end(),
                                                      [](const FeatureObservation& f) { return f.has_right; }));

  const TimeNs t_ns = imu_time(frame.t_ns);
  const bool started = status_ == Status::tracking;
  const ImuStatistics imu = imu_.statistics(t_ns - static_cast<TimeNs>(1e9 * config_.standstill.duration), t_ns);
  const FeatureFrame nothing{frame.t_ns, {}};
  const bool still =
      standstill_.update(frozen ? nothing : frame, imu, started ? state_.imu.b_g : Eigen::Vector3d::Zero(),
                         started ? config_.standstill.max_gyro : config_.standstill.max_gyro_at_start,
                         on_ground() ? wheel_rest_.duration(t_ns, kWheelAge) : std::nullopt);
  contact_.set_gyro_bias(state_.imu.b_g);
  statistics_.on_ground = on_ground();
  if (started) {
    compare_sensors(frame, t_ns);
    advance_measuring(t_ns);
    start_again(frame);
  } else if (try_start(t_ns, imu, still) || try_rolling_start() || try_moving_start(frame)) {
    moving_start_.clear();
    advance_measuring(t_ns);
  }
  return still;
}

/// Before anything of the interval up to t_ns is used: how far the body goes in it, told by each sensor alone.
void Filter::compare_sensors(const FeatureFrame& frame, TimeNs t_ns) {
  const ImuMotion motion = imu_motion(state_.imu, imu_, t_ns, calibration_.imu);
  Displacements displacements;
  displacements[index_of(MotionSensor::imu)] = imu_displacement(motion, covariance_);
  displacements[index_of(MotionSensor::odometer)] = displacement_by_wheels(t_ns);
  if (state_.imu.t_ns != compared_ns_) camera_displacement_.clear();  // the frame before was not where the state is
  const double bias =
      motion.duration * motion.duration * covariance_.matrix().diagonal().segment<3>(err::b_g).maxCoeff();
  displacements[index_of(MotionSensor::camera)] =
      camera_displacement_.add(frame, state_.camera, motion.R_BiBj, motion.rotation_variance + bias);
  compared_ns_ = t_ns;
  consistency_ = consistency_check_(displacements);
}

/// Factor on the inverse standard deviation of what the sensor says about the interval at hand.
double Filter::trust(MotionSensor sensor) const {
  if (!config_.anomaly.enabled || consistency_.anomalous != sensor) return 1.0;
  return std::max(consistency_.weight[index_of(sensor)], config_.anomaly.min_weight);
}

std::optional<NavState> Filter::predict(TimeNs t_ns) const {
  if (!usable() || !is_time(t_ns) || seconds_between(imu_.newest().t_ns, t_ns) > kLongestPredict) return std::nullopt;
  return anchor_.to_world(predict_here(t_ns));
}

/// From the invariant error to the ordinary one: dv = nu - [v]x theta, dp = rho - [p]x theta. Where the scale is given,
/// with what it may be off: larger wheels make way and velocity longer alike.
ImuErrorMatrix Filter::ordinary_covariance() const {
  const ImuState& x = state_.imu;
  ImuErrorMatrix T = ImuErrorMatrix::Identity();
  T.block<3, 3>(estimate_error::velocity, err::theta) = -skew(x.v_W);
  T.block<3, 3>(estimate_error::position, err::theta) = -skew(x.p_WB);
  ImuErrorMatrix P = T * covariance_.matrix().topLeftCorner<err::imu_size, err::imu_size>() * T.transpose();
  if (!scale_is_given()) return P;
  Eigen::Matrix<double, err::imu_size, 1> J = Eigen::Matrix<double, err::imu_size, 1>::Zero();
  J.segment<3>(estimate_error::velocity) = x.v_W;
  J.segment<3>(estimate_error::position) = x.p_WB;
  return P + config_.prior.wheel_scale * config_.prior.wheel_scale * J * J.transpose();
}

Estimate Filter::make_estimate() const {
  const ImuState& x = state_.imu;
  Estimate estimate;
  const NavState here = predict_here(x.t_ns);
  estimate.state = anchor_.to_world(here);
  estimate.covariance = anchor_.to_world(ordinary_covariance(), here);
  estimate.frame = statistics_;
  estimate.consistency = consistency_;
  if (ground_known_) {
    const Slope ground = slope(x.R_WB * state_.odometer.T_BO.R.col(1), state_.ground.n_W);
    const std::array<int, 5> entries = {err::theta, err::theta + 1, err::theta + 2, err::normal, err::normal + 1};
    const Eigen::Matrix<double, 5, 5> P = covariance_.matrix()(entries, entries);
    const Eigen::Matrix2d P_slope = ground.J * P * ground.J.transpose();
    estimate.terrain = {true, ground.along, ground.across, std::sqrt(P_slope(0, 0)), std::sqrt(P_slope(1, 1))};
  }
  return estimate;
}

}  // namespace ear
