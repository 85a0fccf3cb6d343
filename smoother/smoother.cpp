// Smoother: samples and frames in, one frame after the other, start and restart.
#include "smoother/smoother.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "filter/ekf/initial_state.h"

namespace ear::smoother {
namespace {

constexpr std::size_t kImuCapacity = 4096;
constexpr std::size_t kWheelCapacity = 512;
constexpr std::size_t kMaxCompared = 512;  // features of a frame whose motion is compared with other sensors
constexpr double kHeldSample = 0.04;       // [s] so far the newest IMU sample may stand in for one that is missing
constexpr double kSpinUp = 0.1;            // [s] after a touchdown until the wheels roll
constexpr double kTakeoffUnseen = 0.1;     // [s] before a take-off is noticed the wheels are wrong
constexpr double kUnseenSpeed = 1.0;       // [m/s] that the vehicle may have gained since it was lost

const Calibration& supported(const FilterConfig& config, const Calibration& calibration) {
  if (checked(calibration).cameras.empty()) throw std::invalid_argument("smoother: calibration: cameras are needed");
  const OdometerModel model = config.odometer.model;
  if (calibration.encoder && model != OdometerModel::none && model != OdometerModel::terrain) {
    throw std::invalid_argument("smoother: filter.odometer.model: terrain or none");
  }
  return calibration;
}

}  // namespace

Smoother::Smoother(const FilterConfig& config, const Calibration& calibration)
    : config_(checked(config)),
      calibration_(supported(config, calibration)),
      focal_px_(focal_length(calibration)),
      gate_(config.gate_probability, 3),
      guard_(calibration, config.max_imu_gap),
      impact_guard_(config.impact, calibration.imu),
      imu_(kImuCapacity),
      turns_(kWheelCapacity),
      ranges_(kWheelCapacity),
      contact_(config.contact, calibration),
      standstill_(config.standstill, focal_px_),
      consistency_check_(config.anomaly),
      camera_displacement_(config.feature_sigma_px / focal_px_, kMaxCompared),
      normal_(config.odometer, calibration, config.gate_probability),
      starter_(std::make_unique<Filter>(config, calibration)),
      P_(err::clones) {
  const bool wheels = calibration.encoder && calibration.lasers && !calibration.lasers->beams.empty();
  if (wheels && config.odometer.model == OdometerModel::terrain) encoder_.emplace(*calibration.encoder);
}

TimeNs Smoother::imu_time(TimeNs camera_time_ns) const {
  return camera_time_ns + static_cast<TimeNs>(std::llround(1e9 * calibration().camera.time_offset));
}

TimeNs Smoother::camera_time(TimeNs imu_time_ns) const {
  return imu_time_ns - static_cast<TimeNs>(std::llround(1e9 * calibration().camera.time_offset));
}

CalibrationState Smoother::calibration() const {
  return window_ ? CalibrationState{window_->cameras(), window_->odometer()} : starter_->calibration();
}

std::optional<TimeNs> Smoother::state_time() const {
  return window_ ? std::optional(window_->newest().t_ns) : std::nullopt;
}

FrameStamp Smoother::check_stamp(TimeNs t_ns) const {
  if (any_frame_ && t_ns <= last_frame_ns_) return FrameStamp::not_later;
  const bool covered =
      is_time(t_ns) && !imu_.empty() && seconds_between(imu_.newest().t_ns, imu_time(t_ns)) < kHeldSample;
  return covered ? FrameStamp::usable : FrameStamp::no_samples;
}

Status Smoother::status() const {
  if (window_) return Status::tracking;
  return last_good_ ? Status::lost : starter_->status();
}

void Smoother::add_imu(const ImuSample& sample) {
  if (!window_) starter_->add_imu(sample);
  const ImuVerdict verdict = guard_.judge(sample);
  if (!verdict.accepted) return;
  if (verdict.begins_anew) {
    if (last_good_) last_good_->state.t_ns += verdict.clock_shift;
    lose(sample.t_ns);
    starter_->add_imu(sample);
    imu_.clear();
  }
  const ImuNoiseFactors noise = impact_guard_.add(sample);
  imu_.raise_newest_noise(static_cast<std::size_t>(impact_guard_.clipped_before()), noise);
  imu_.push(sample, noise);
  if (encoder_) note_contact(contact_.add_imu(sample));
}

void Smoother::add_encoder(const EncoderSample& sample) {
  if (!window_) starter_->add_encoder(sample);
  if (!encoder_ || guard_.judge(sample, state_time(), *encoder_) != Verdict::accepted) return;
  note_contact(contact_.add_encoder(sample));
  const std::optional<WheelIncrement> turn = encoder_->add(sample);
  if (!turn) return;
  wheel_rest_.add(*turn);
  if (turns_.full()) turns_.pop();
  turns_.push(*turn);
}

void Smoother::add_laser(const LaserSample& sample) {
  if (!window_) starter_->add_laser(sample);
  if (!encoder_ || guard_.judge(sample, state_time()) != Verdict::accepted) return;
  note_contact(contact_.add_laser(sample));
  if (ranges_.full()) ranges_.pop();
  ranges_.push(BeamRanges(sample));
}

/// After a change of the ground under the wheels nothing is known of it. A take-off is noticed a moment late.
void Smoother::note_contact(ContactEvent event) {
  if (event == ContactEvent::none) return;
  normal_.forget();
  if (event == ContactEvent::takeoff && window_) window_->forget_wheels(kTakeoffUnseen);
}

bool Smoother::rolls_at(TimeNs t_ns) const {
  const std::optional<TimeNs> since_ns = contact_.since_ns();
  return on_ground() && (!since_ns || seconds_between(*since_ns, t_ns) > kSpinUp);
}

std::optional<Estimate> Smoother::process(const FeatureFrame& given) {
  if (check_stamp(given.t_ns) != FrameStamp::usable) return std::nullopt;
  any_frame_ = true;
  last_frame_ns_ = given.t_ns;
  const FeatureFrame& frame = guard_.plausible(given);
  std::optional<Estimate> estimate = window_ ? step(frame) : start(frame);
  if (estimate && window_) {
    last_image_ns_ = frame.t_ns;
    const ImuState x = window_->newest();
    image_T_WB_ = Pose{x.R_WB, x.p_WB};
  }
  return estimate;
}

std::optional<Estimate> Smoother::process_without_image(TimeNs t_ns) {
  if (check_stamp(t_ns) != FrameStamp::usable || (window_ && !on_ground())) return std::nullopt;
  any_frame_ = true;
  last_frame_ns_ = t_ns;
  if (window_) return step(FeatureFrame{t_ns, {}});
  starter_->process_without_image(t_ns);  // which may start, but says where only at a frame
  return std::nullopt;
}

/// The filter starts: from there on the window has its state and covariance.
std::optional<Estimate> Smoother::start(const FeatureFrame& frame) {
  std::optional<Estimate> started = starter_->process(frame);
  if (!started) return std::nullopt;
  const State& x = starter_->ekf().state();
  const auto P = starter_->ekf().covariance().matrix();
  window_.emplace(config_, focal_px_, x, P.topLeftCorner<err::clones, err::clones>());
  covariance_ = NewestCovariance{started->covariance, P.block<6, 6>(err::wheel_radius, err::wheel_radius)};
  b_g_ = x.imu.b_g;
  forget_passed(x.imu.t_ns);
  while (!ranges_.empty() && ranges_.front().t_ns <= x.imu.t_ns) ranges_.pop();
  normal_.forget();
  camera_displacement_.clear();
  was_still_ = started->frame.standing;
  statistics_ = started->frame;
  consistency_ = started->consistency;
  if (last_good_) go_on_from(*last_good_);
  starter_.reset();
  return reported();
}

/// The window's world begins where the estimates ended, and as uncertain as the time between makes it.
void Smoother::go_on_from(const Estimate& last) {
  const NavState here = predict_here(window_->newest().t_ns);
  const double way = seconds_between(last.state.t_ns, here.t_ns) * (last.state.v_W.norm() + kUnseenSpeed);
  const double variance = last.covariance.diagonal().segment<3>(estimate_error::position).maxCoeff();
  alignment_ = MapAlignment::join(last.state, here, M_PI, std::sqrt(std::max(variance, 0.0) + way * way));
  ++health_.reset_counter;
}

void Smoother::begin_anew() {
  window_.reset();
  covariance_.reset();
  starter_ = std::make_unique<Filter>(config_, calibration_);
  turns_.clear();
  ranges_.clear();
  passed_turn_.reset();
  normal_.forget();
  image_T_WB_.reset();
  agrees_since_ns_.fill(0);
}

/// The window came to nothing: it is given up, and the filter's start begins anew.
void Smoother::lose(TimeNs t_ns) {
  begin_anew();
  guard_.restart();
  if (!last_good_) return;
  health_.status = HealthStatus::lost;
  health_.since_ns = t_ns;
  health_.aiding = Aiding::none;
  health_.quality = 0;
}

/// (1), one frame on.
std::optional<Estimate> Smoother::step(const FeatureFrame& frame) {
  const TimeNs t_ns = imu_time(frame.t_ns);
  const ImuState x = window_->newest();
  if (t_ns <= x.t_ns) return std::nullopt;
  begin_statistics(frame);
  b_g_ = x.b_g;
  contact_.set_gyro_bias(b_g_);
  compare_sensors(frame, x, t_ns);
  window_->add(moved_to(frame, x, t_ns), frame.features);
  covariance_ = window_->optimize() ? window_->covariance() : std::nullopt;
  forget_passed(t_ns);
  if (!covariance_) {
    lose(t_ns);
    return std::nullopt;
  }
  statistics_.features_used = window_->features_used();
  statistics_.features_rejected = window_->features_rejected();
  statistics_.clones = static_cast<int>(window_->size());
  window_->make_room();
  return reported();
}

void Smoother::begin_statistics(const FeatureFrame& frame) {
  statistics_ = FrameStatistics{};
  statistics_.tracks = static_cast<int>(frame.features.size());
  statistics_.stereo = static_cast<int>(std::count_if(frame.features.begin(), frame.features.end(),
                                                      [](const FeatureObservation& f) { return f.has_right; }));
  statistics_.on_ground = on_ground();
}

/// The newest state, unless it cannot be believed.
std::optional<Estimate> Smoother::reported() {
  Estimate estimate = make_estimate();
  judge(estimate);
  if (health_.status == HealthStatus::lost) {
    lose(estimate.state.t_ns);
    return std::nullopt;
  }
  estimate.health = health_;
  last_good_ = estimate;
  return estimate;
}

}  // namespace ear::smoother
