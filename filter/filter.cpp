#include "filter/filter.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>

#include "filter/displacement_update.h"
#include "filter/displacements.h"
#include "filter/ground.h"
#include "filter/relative_motion.h"
#include "filter/rolling_start.h"

namespace ear {
namespace {

constexpr std::size_t kImuCapacity = 4096;   // 20 s at 200 Hz, 4 s at 1 kHz
constexpr std::size_t kWheelCapacity = 512;  // readings that wait for the state to pass them
constexpr double kSpinUp = 0.1;              // [s] after a touchdown until the wheels roll
constexpr double kTakeoffVelocity = 0.05;    // [m/s] what the odometer was wrong by before a take-off was noticed
constexpr double kTakeoffPosition = 5e-3;    // [m] what came of it
constexpr double kDoubtTime = 0.5;           // [s] the contradiction of two wheels is one error so long
constexpr double kSlipEnds = 0.15;           // [s] of agreement before a row that failed its gate is used again
constexpr double kRollingWindow = 2.0;       // [s] of samples kept for a start while rolling
constexpr double kRollingStart = 1.5;        // [s] of them that it takes
constexpr double kRollingVelocity = 0.5;     // [m/s] and share of the speed: before the samples of the window are used
constexpr TimeNs kMissedReading = 50'000'000;  // [ns] without wheel readings: a displacement has a hole
constexpr double kAccelSpike = 25.0;           // [m/s^2] of one sample from the mean of its neighbours
constexpr double kGyroSpike = 2.0;             // [rad/s] the same
constexpr double kSpikeRatio = 4.0;            // and so many times the difference of these
constexpr double kLongestPredict = 0.5;        // [s] beyond the newest sample
constexpr double kGravityTolerance = 1.5;      // [m/s^2] of the specific force at rest: more is a wrong unit
constexpr double kWheelAge = 0.1;              // [s] older readings do not tell whether the wheels rest
constexpr double kHeldSample = 0.04;           // [s] so far the newest IMU sample may stand in for one that is missing
constexpr double kGapNoiseFactor = 10.0;       // on the noise densities while a gap in the IMU data is bridged
constexpr double kHoleAccel = 1.0;             // [m/s^2] while nothing was measured
constexpr double kDoubtfulTurn = 5e-3;         // [rad] standard deviation of what one inertial sample adds
constexpr double kBridgeRotation = 2e-3;       // [rad] standard deviations with which two images tell of the motion:
constexpr double kBridgePosition = 5e-3;       // [m] well above what the features will tell later
constexpr double kImageSoon = 0.25;            // [s] after the last one
constexpr double kBiasDelay = 0.3;             // [s] until a bias that jumped is found out
constexpr double kFeigned = 3.0;               // standard deviations of the cameras' mounting that feign a turn
constexpr std::size_t kFewestRepeated = 8;     // features, for two images to be the same
constexpr double kStartGravityNoise = 0.02;    // [m/s^2] what idling rotors leave in the mean specific force
constexpr double kKnownSigma = 1e-6;           // [m, rad] of position and yaw at the start: by definition zero
constexpr double kKnownScale = 1e-6;           // of the wheels where nothing can tell it
constexpr double kUnknownTilt = 0.3;           // [rad] before gravity was measured
constexpr double kLeastStartSpeed = 0.2;       // [m/s] slower is as good as standing
constexpr double kUnseenSpeed = 1.0;           // [m/s] that the vehicle may have gained since it was lost
constexpr double kOldImage = 0.5;              // [s] after which frames have little in common
constexpr double kLifting = 0.3;               // [s] after wheels that leave the ground, or meet it, as it seems
constexpr double kCommonShare = 0.5;           // of its features, that the elder of a copy must have seen
constexpr std::size_t kMaxCompared = 512;      // features of a frame whose motion is compared with other sensors
constexpr std::size_t kMinObservations = 2;    // clones that must have seen a feature

int error_capacity(const FilterConfig& config) { return err::clone(config.window + 1); }

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(what);
}

const FilterConfig& checked(const FilterConfig& config) {
  require(config.window >= 3, "filter.window: at least 3 clones are needed");
  require(config.window <= 60, "filter.window: at most 60 clones");
  require(config.max_track_updates >= 1, "filter.max_track_updates: at least 1");
  require(config.max_track_updates <= 1000, "filter.max_track_updates: at most 1000");
  require(config.feature_sigma_px > 0.0, "filter.feature_sigma_px: must be positive");
  require(config.huber_px > 0.0, "filter.huber_px: must be positive");
  require(config.gate_probability > 0.0 && config.gate_probability < 1.0, "filter.gate_probability: between 0 and 1");
  const AnomalyConfig& anomaly = config.anomaly;
  require(anomaly.distance > 0.0, "filter.anomaly.distance: must be positive");
  require(anomaly.false_alarm > 0.0 && anomaly.false_alarm < 1.0, "filter.anomaly.false_alarm: between 0 and 1");
  require(anomaly.min_weight > 0.0 && anomaly.min_weight <= 1.0, "filter.anomaly.min_weight: above 0, at most 1");
  return config;
}

const Calibration& checked(const Calibration& calibration) {
  require(!calibration.cameras.empty() || calibration.encoder, "calibration: a camera or wheels are needed");
  require(calibration.cameras.size() <= 2, "calibration: at most two cameras");
  for (const CameraCalibration& camera : calibration.cameras) {
    require(camera.fu > 0.0 && camera.fv > 0.0, "calibration: a camera's focal lengths must be positive");
    const Eigen::Matrix3d R = camera.T_BC.linear();
    require((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 && R.determinant() > 0.0,
            "calibration: a camera's T_BS holds no rotation");
  }
  require(calibration.imu.gyro_noise > 0.0 && calibration.imu.accel_noise > 0.0,
          "calibration: imu noise must be positive");
  if (const auto& encoder = calibration.encoder) {
    require(encoder->wheel_radius[0] > 0.0 && encoder->wheel_radius[1] > 0.0,
            "calibration: wheel_radius must be positive");
    require(encoder->wheel_separation > 0.0, "calibration: wheel_separation must be positive");
    require(encoder->resolution > 0, "calibration: encoder resolution must be positive");
    const Eigen::Matrix3d R = encoder->T_BO.linear();
    require((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 && R.determinant() > 0.0,
            "calibration: the encoder's T_BS holds no rotation");
  }
  if (const auto& lasers = calibration.lasers) {
    require(lasers->beams.size() <= kMaxBeams, "calibration: at most three laser beams");
    for (const LaserBeam& beam : lasers->beams) {
      require(std::abs(beam.d_B.norm() - 1.0) < 1e-2, "calibration: a laser's direction must have length one");
    }
  }
  return calibration;
}

CameraState camera_state(const Calibration& calibration) {
  CameraState camera;
  camera.time_offset = calibration.camera_time_offset;
  if (calibration.cameras.empty()) return camera;
  const Eigen::Isometry3d& T_BC0 = calibration.cameras.front().T_BC;
  camera.T_BC0 = {renormalized(T_BC0.linear()), T_BC0.translation()};
  const Eigen::Isometry3d T_C0C1 = T_BC0.inverse() * calibration.cameras.back().T_BC;
  camera.T_C0C1 = {renormalized(T_C0C1.linear()), T_C0C1.translation()};
  return camera;
}

OdometerState odometer_state(const Calibration& calibration) {
  OdometerState odometer;
  if (const auto& encoder = calibration.encoder) {
    odometer.wheel_radius << encoder->wheel_radius[0], encoder->wheel_radius[1];
    odometer.wheel_separation = encoder->wheel_separation;
    odometer.T_BO = {renormalized(encoder->T_BO.linear()), encoder->T_BO.translation()};
  }
  if (const auto& lasers = calibration.lasers) {
    for (std::size_t i = 0; i < lasers->beams.size(); ++i) odometer.d_B[i] = lasers->beams[i].d_B.normalized();
  }
  return odometer;
}

/// Pixels per unit of normalized coordinates; 1 without a camera, where nothing is measured in pixels.
double focal_length(const Calibration& calibration) {
  if (calibration.cameras.empty()) return 1.0;
  return 0.5 * (calibration.cameras[0].fu + calibration.cameras[0].fv);
}

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
      consistency_check_(config.anomaly),
      camera_displacement_(config.feature_sigma_px / focal_px_, kMaxCompared),
      frame_check_(config.feature_sigma_px / focal_px_, gate_(2)),
      monitor_(calibration, calibration.encoder && config.odometer.model != OdometerModel::none,
               config.odometer.model == OdometerModel::terrain),
      moving_start_({config.prior.gyro_bias, config.prior.accel_bias, config.feature_sigma_px / focal_px_}),
      information_(config.window + 1, config.max_track_updates) {
  state_.camera = camera_state(calibration);
  state_.odometer = odometer_state(calibration);
  if (calibration.encoder && config.odometer.model != OdometerModel::none) encoder_.emplace(*calibration.encoder);
  state_.clones.reserve(static_cast<std::size_t>(config.window) + 1);
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
  const ImuVerdict verdict = guard_.judge(sample);
  if (!verdict.accepted) {
    monitor_.add_refused_imu();
    return;
  }
  if (verdict.begins_anew) restart(sample.t_ns, verdict.clock_shift);
  monitor_.add_imu(sample, config_.max_imu_gap);
  if (!imu_.empty() && verdict.unseen > config_.max_imu_gap) {
    imu_hole_ = ImuHole{imu_.newest().t_ns, sample.t_ns, verdict.unseen};
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

/// As after construction, but for the inertial clock, and where the vehicle was last known to be.
void Filter::restart(TimeNs t_ns, TimeNs clock_shift) {
  Filter fresh(config_, calibration_);
  fresh.guard_ = std::move(guard_);
  fresh.guard_.restart();
  fresh.monitor_.succeed(monitor_, t_ns);
  fresh.anchor_ = anchor_;
  fresh.last_good_ = std::move(last_good_);
  if (fresh.last_good_) fresh.last_good_->state.t_ns += clock_shift;
  if (status_ == Status::tracking || status_ == Status::lost) fresh.status_ = Status::lost;
  *this = std::move(fresh);
}

/// One sample that is far from both its neighbours, which agree with each other, is a fault of the sensor or its bus:
/// no strike lasts for one sample only. The mean of the neighbours takes its place.
void Filter::mend_spike(const ImuSample& next) {
  if (imu_.size() < 2) return;
  const ImuSample& before = imu_[imu_.size() - 2];
  const ImuSample& suspect = imu_.newest();
  if (seconds_between(before.t_ns, next.t_ns) > config_.max_imu_gap) return;
  const auto spike = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, double least) {
    const double off = (b - 0.5 * (a + c)).norm();
    return off > least && off > kSpikeRatio * (c - a).norm();
  };
  const bool gyro = spike(before.gyro_B, suspect.gyro_B, next.gyro_B, kGyroSpike);
  const bool accel = spike(before.accel_B, suspect.accel_B, next.accel_B, kAccelSpike);
  if (!gyro && !accel) return;
  monitor_.add_spike(gyro, accel, next.t_ns);
  imu_.correct_newest(0.5 * (before.gyro_B + next.gyro_B), 0.5 * (before.accel_B + next.accel_B));
  guard_.count_spike();
}

/// After a change of the ground under the wheels nothing is known of it. A take-off is noticed some centimetres above
/// the ground, and until then the odometer held the vehicle there.
void Filter::note_contact(ContactEvent event) {
  if (event == ContactEvent::none) return;
  ground_known_ = false;
  if (event != ContactEvent::takeoff || status_ != Status::tracking) return;
  doubt_motion(0.0, kTakeoffVelocity, kTakeoffPosition);
  bias_watch_.clear();  // it saw what the odometer did
}

/// The vehicle may be turned, faster and elsewhere by these standard deviations [rad, m/s, m], each way, whatever was
/// measured so far. A turn is about the body: by the invariant error, nu = dv + [v]x theta, rho = dp + [p]x theta.
void Filter::doubt_motion(double rotation, double velocity, double position) {
  Eigen::Matrix<double, 9, 3> J;
  J << Eigen::Matrix3d::Identity(), skew(state_.imu.v_W), skew(state_.imu.p_WB);
  Eigen::Matrix<double, 9, 9> Q = rotation * rotation * J * J.transpose();
  Q.diagonal().segment<3>(err::nu).array() += velocity * velocity;
  Q.diagonal().segment<3>(err::rho).array() += position * position;
  covariance_.widen(err::theta, Q);
}

/// Do the wheels tell how the vehicle moves? Not in the air, and not while they are spun up by the ground.
bool Filter::rolls_at(TimeNs t_ns) const {
  const std::optional<TimeNs> since_ns = contact_.since_ns();
  return on_ground() && (!since_ns || seconds_between(*since_ns, t_ns) > kSpinUp);
}

std::optional<TimeNs> Filter::state_time() const {
  return status_ == Status::tracking ? std::optional(state_.imu.t_ns) : std::nullopt;
}

void Filter::add_encoder(const EncoderSample& sample) {
  if (!encoder_) return;
  const Verdict verdict = guard_.judge(sample, state_time(), *encoder_);
  if (!imu_.empty()) monitor_.add_encoder(sample, verdict, imu_.newest().t_ns);
  if (verdict != Verdict::accepted) return;
  note_contact(contact_.add_encoder(sample));
  const std::optional<WheelTurn> turn = encoder_->add(sample);
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
  BeamRanges reading;
  reading.t_ns = sample.t_ns;
  std::copy(sample.range.begin(), sample.range.end(), reading.range.begin());
  ranges_.push(reading);
}

std::optional<RelativeMotion> Filter::motion_to(TimeNs t_ns) const {
  if (!is_time(t_ns) || !any_image_ || imu_.empty() || t_ns <= last_image_ns_) return std::nullopt;
  RelativeMotion motion;
  if (status_ != Status::tracking) {
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
  const NavState next = predict_here(imu_time(t_ns));
  motion.R_B1B0 = next.q_WB.toRotationMatrix().transpose() * image_T_WB_.R;
  motion.p_B0B1 = image_T_WB_.R.transpose() * (next.p_WB - image_T_WB_.p);
  motion.translation_known = true;
  return motion;
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
  }
  if (status_ == Status::tracking) watch_biases(seconds_between(watched_ns_, state_.imu.t_ns));
  watched_ns_ = state_.imu.t_ns;
  if (usable) {
    any_image_ = true;
    last_image_ns_ = frame.t_ns;
    last_features_ = frame;
    image_T_WB_ = {state_.imu.R_WB, state_.imu.p_WB};
  }
  return finish_frame(true, agreement);
}

/// No two exposures are exactly equal, unless they are of a simulator without noise, which shows before the start.
bool Filter::repeats_last_image(const FeatureFrame& frame) const {
  if (!any_image_ || frame.features.size() < kFewestRepeated) return false;
  const std::vector<FeatureObservation>& last = last_features_.features;
  std::size_t common = 0;
  std::size_t equal = 0;
  for (std::size_t i = 0; i < std::min(frame.features.size(), last.size()); ++i) {
    if (frame.features[i].id != last[i].id) continue;
    ++common;
    equal += frame.features[i].left == last[i].left ? 1 : 0;
  }
  return common >= kFewestRepeated && equal == common;
}

/// Where the inertial samples since the last image may be wrong by more than noise (clipped, missing, stamps that
/// jumped), the two images tell how the body moved, roughly: later, the features of both will tell it in full, around a
/// state that is near enough to be linear. docs/filter.md, section 15.
void Filter::bridge(const FeatureFrame& frame) {
  const bool needed = imu_doubtful_;
  imu_doubtful_ = false;
  if (!needed || !any_image_ || calibration_.cameras.size() < 2 || state_.clones.empty()) return;
  match_stereo(last_features_, frame, bridge_matches_);
  StereoMotion start;
  start.R_B0B1 = image_T_WB_.R.transpose() * state_.imu.R_WB;
  start.p_B0B1 = image_T_WB_.R.transpose() * (state_.imu.p_WB - image_T_WB_.p);
  const std::optional<StereoMotion> motion =
      stereo_motion(bridge_matches_, state_.camera, start, config_.feature_sigma_px / focal_px_);
  if (!motion) return;
  const int newest = static_cast<int>(state_.clones.size()) - 1;
  const RelativeMotionRows rows = linearize_relative_motion(state_, newest, {motion->R_B0B1, motion->p_B0B1});
  const Eigen::Matrix3d R_WB0 = state_.clones.back().T_WB.R;
  const Eigen::Matrix3d covariance =
      R_WB0 * motion->covariance * R_WB0.transpose() + kBridgePosition * kBridgePosition * Eigen::Matrix3d::Identity();
  const Eigen::LLT<Eigen::Matrix3d> llt(covariance);
  const int clone = err::clone(newest);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6, clone + err::clone_size);
  H.topLeftCorner<3, err::imu_size>() = rows.H.topRows<3>() / kBridgeRotation;
  H.topRightCorner<3, err::clone_size>() = rows.H_clone.topRows<3>() / kBridgeRotation;
  H.bottomLeftCorner<3, err::imu_size>() = llt.matrixL().solve(rows.H.bottomRows<3>());
  H.bottomRightCorner<3, err::clone_size>() = llt.matrixL().solve(rows.H_clone.bottomRows<3>());
  Eigen::Matrix<double, 6, 1> r;
  r << rows.residual.head<3>() / kBridgeRotation, llt.matrixL().solve(rows.residual.tail<3>());
  learn_calibration_ = false;
  update(H, 0, r);
}

/// At the state's time, which is the frame's, before the frame changes it: does it show the motion since the last image
/// that the other sensors predict?
FrameAgreement Filter::check_frame(const FeatureFrame& frame) {
  const double dt = seconds_between(last_image_ns_, frame.t_ns);
  if (!any_image_ || dt > kOldImage || calibration_.cameras.size() < 2) return FrameAgreement{};
  PredictedMotion motion;
  motion.R_B0B1 = image_T_WB_.R.transpose() * state_.imu.R_WB;
  motion.p_B0B1 = image_T_WB_.R.transpose() * (state_.imu.p_WB - image_T_WB_.p);
  const auto P = covariance_.matrix();
  motion.sigma_p = dt * std::sqrt(P.diagonal().segment<3>(err::nu).maxCoeff());
  return frame_check_.compare(last_features_, frame, motion, state_.camera);
}

/// The state is at the frame's time.
void Filter::use_image(const FeatureFrame& frame, bool still) {
  if (still && clone_is_here_) {
    hold_still();
  } else {
    update_with_displacement();
    append_clone();
    start_displacement();
    tracks_.add(state_.clones.back().frame, frame.features);
    const std::optional<std::size_t> leaving = clone_to_leave();
    update_with_features(frame, leaving);
    make_room(leaving);
  }
  statistics_.clones = static_cast<int>(state_.clones.size());
}

/// What is said of the state, and whether it is given away.
std::optional<Estimate> Filter::finish_frame(bool image, const FrameAgreement& agreement) {
  HealthMonitor::Frame frame;
  frame.t_ns = imu_time(last_frame_ns_);
  frame.image = image;
  frame.running = status_ == Status::tracking;
  frame.agreement = agreement;
  frame.statistics = statistics_;
  frame.lifted = lifted_ns_ && seconds_between(*lifted_ns_, frame.t_ns) < kLifting;
  std::optional<Estimate> estimate;
  if (frame.running) {
    estimate = make_estimate();
    const auto mounting = covariance_.matrix().diagonal().segment<3>(err::camera).cwiseMax(0.0);
    frame.feigned_turn = kFeigned * rate_B_.norm() * std::sqrt(mounting.maxCoeff());
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
                      o.wheel_radius.allFinite() && std::isfinite(o.wheel_separation) && o.T_BO.R.allFinite() &&
                      state_.ground.n_W.allFinite() && P.allFinite();
  return finite && P.diagonal().minCoeff() >= 0.0;
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
  if (status_ == Status::tracking && !calibration_.cameras.empty() && !on_ground()) return std::nullopt;
  FeatureFrame nothing;
  nothing.t_ns = t_ns;
  const bool still = begin_frame(nothing, false);
  if (status_ != Status::tracking) return finish_frame(false, FrameAgreement{});

  go_on_blind(still);
  return finish_frame(false, FrameAgreement{});
}

/// At a frame's time, from all but the images.
void Filter::go_on_blind(bool still) {
  if (still && clone_is_here_) {
    hold_still();
  } else if (still) {
    append_clone();
    make_room(clone_to_leave());
  } else {
    clone_is_here_ = false;
  }
  statistics_.clones = static_cast<int>(state_.clones.size());
}

/// What comes before anything is done with the features: start if possible, propagate. Does the vehicle stand?
bool Filter::begin_frame(const FeatureFrame& frame, bool frozen) {
  any_frame_ = true;
  last_frame_ns_ = frame.t_ns;
  statistics_ = FrameStatistics{};
  consistency_ = Consistency{};
  log_.start_frame();
  statistics_.tracks = static_cast<int>(frame.features.size());
  statistics_.stereo = static_cast<int>(std::count_if(frame.features.begin(), frame.features.end(),
                                                      [](const FeatureObservation& f) { return f.has_right; }));

  const TimeNs t_ns = imu_time(frame.t_ns);
  const bool started = status_ == Status::tracking;
  const ImuStatistics imu = imu_.statistics(t_ns - static_cast<TimeNs>(1e9 * config_.standstill.duration), t_ns);
  const bool still = standstill_.update(frozen ? FeatureFrame{frame.t_ns, {}} : frame, imu,
                                        started ? state_.imu.b_g : Eigen::Vector3d::Zero(),
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

/// While lost, the state goes on, and is good again if the cameras come to agree with it. Where they do not, but agree
/// with the inertial samples, it is the state that is wrong, and begins anew.
void Filter::start_again(const FeatureFrame& frame) {
  if (!monitor_.lost()) {
    moving_start_.clear();
    return;
  }
  if (frame.features.empty() || calibration_.cameras.size() < 2) return;
  const CameraState given = camera_state(calibration_);  // what was learned may be as wrong as the rest
  const auto offset_ns = static_cast<TimeNs>(std::llround(1e9 * given.time_offset));
  moving_start_.add(frame.t_ns + offset_ns, frame, imu_, given);
  if (!monitor_.contradicted() || !moving_start_.solve(imu_)) return;
  stop();
  if (begin_moving()) advance_measuring(imu_time(frame.t_ns));
}

/// Nothing of the state is used any more.
void Filter::stop() {
  status_ = Status::lost;
  state_.imu = ImuState{};
  state_.clones.clear();
  state_.camera = camera_state(calibration_);
  state_.odometer = odometer_state(calibration_);
  state_.ground = GroundState{};
  tracks_.clear();
  turns_.clear();
  ranges_.clear();
  displacement_.reset();
  displacement_turns_.clear();
  bias_watch_.clear();
  imu_hole_.reset();
  imu_doubtful_ = false;
  agrees_since_ns_.fill(0);
  ground_known_ = false;
  clone_is_here_ = false;
  camera_displacement_.clear();
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

Displacement Filter::displacement_by_wheels(TimeNs until_ns) const {
  const bool terrain = config_.odometer.model == OdometerModel::terrain && beam_count_ > 0;
  if (!encoder_ || !rolls_at(state_.imu.t_ns) || (terrain && !ground_known_)) return {};
  const WheelSetting setting{wheel_model(state_.odometer), wheel_noise(), config_.odometer.speed_sigma,
                             config_.odometer.side_slip_turn, terrain};
  return wheel_displacement(state_, covariance_, TurnsBetween(passed_turn_, turns_), imu_, until_ns, setting);
}

WheelNoise Filter::wheel_noise() const {
  const OdometerConfig& odometer = config_.odometer;
  const EncoderCalibration& encoder = *calibration_.encoder;
  WheelNoise noise;
  noise.gyro = calibration_.imu.gyro_noise;
  noise.reading = encoder.noise_counts * 2.0 * M_PI / static_cast<double>(encoder.resolution);
  noise.slip = odometer.slip;
  noise.side_slip = odometer.side_slip;
  noise.roughness = odometer.roughness;
  noise.normal_walk = odometer.normal_walk;
  return noise;
}

/// Factor on the inverse standard deviation of what the sensor says about the interval at hand.
double Filter::trust(MotionSensor sensor) const {
  if (!config_.anomaly.enabled || consistency_.anomalous != sensor) return 1.0;
  return std::max(consistency_.weight[index_of(sensor)], config_.anomaly.min_weight);
}

/// Standing: the mean specific force is gravity, the mean rate is the gyroscope's bias.
bool Filter::try_start(TimeNs t_ns, const ImuStatistics& imu, bool still) {
  if (status_ != Status::lost) status_ = imu.count < 2 ? Status::waiting_for_imu : Status::waiting_for_standstill;
  if (!still || imu.count < 2) return false;
  if (std::abs(imu.accel_mean.norm() - kGravity_W.norm()) > kGravityTolerance) return false;

  ImuState& x = state_.imu;
  x = ImuState{};
  x.t_ns = t_ns;
  x.R_WB = Eigen::Quaterniond::FromTwoVectors(imu.accel_mean, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  x.b_g = imu.gyro_mean;
  // What the force measures beyond gravity's known size can only be bias.
  const Eigen::Vector3d gravity_B = -(x.R_WB.transpose() * kGravity_W);

  reset_covariance(start_sigma());
  status_ = Status::tracking;
  turns_.clear();  // all before t_ns
  ranges_.clear();

  // force = R^T (-g) + b_a + n, rate = b_g + n; with the invariant error, R^T u = R^^T (u + [u]x theta).
  const double root_duration = std::sqrt(imu.duration);
  const double accel_sigma = std::hypot(calibration_.imu.accel_noise / root_duration, kStartGravityNoise);
  const double gyro_sigma = calibration_.imu.gyro_noise / root_duration;
  Eigen::Matrix<double, 6, err::imu_size> H = Eigen::Matrix<double, 6, err::imu_size>::Zero();
  Eigen::Matrix<double, 6, 1> r;
  H.block<3, 3>(0, err::theta) = x.R_WB.transpose() * skew(-kGravity_W) / accel_sigma;
  H.block<3, 3>(0, err::b_a) = Eigen::Matrix3d::Identity() / accel_sigma;
  r.head<3>() = (imu.accel_mean - gravity_B - x.b_a) / accel_sigma;
  H.block<3, 3>(3, err::b_g) = Eigen::Matrix3d::Identity() / gyro_sigma;
  r.tail<3>() = (imu.gyro_mean - x.b_g) / gyro_sigma;
  update(H, 0, r);
  join_worlds();
  return true;
}

/// Rolling: begin where the window of samples begins, near what explains them, and take them in from there.
bool Filter::try_rolling_start() {
  if (!on_ground()) return false;
  const RollingStartNoise noise{config_.prior.gyro_bias, config_.prior.accel_bias};
  const std::optional<ImuState> start = rolling_start(imu_, turns_, state_.odometer, noise, kRollingStart);
  if (!start) return false;
  state_.imu = *start;
  Eigen::VectorXd sigma = start_sigma();
  sigma.segment<3>(err::nu).setConstant(kRollingVelocity * (1.0 + start->v_W.norm()));
  reset_covariance(sigma);
  status_ = Status::tracking;
  join_worlds();
  return true;
}

/// Moving, with two cameras.
bool Filter::try_moving_start(const FeatureFrame& frame) {
  if (calibration_.cameras.size() < 2 || frame.features.empty()) return false;
  moving_start_.add(imu_time(frame.t_ns), frame, imu_, state_.camera);
  return begin_moving();
}

/// Begin where the window of frames begins, near what explains them, and take them in from there; all but the last,
/// which is the frame at hand.
bool Filter::begin_moving() {
  const std::optional<ImuState> start = moving_start_.solve(imu_);
  if (!start) return false;
  // A first start can wait for the vehicle to stand, which tells gravity and biases better, or to move.
  if (status_ != Status::lost && start->v_W.norm() < kLeastStartSpeed) return false;
  state_.imu = *start;
  Eigen::VectorXd sigma = start_sigma();
  sigma.segment<3>(err::nu).setConstant(kRollingVelocity * (1.0 + start->v_W.norm()));
  covariance_.reset(sigma);
  status_ = Status::tracking;
  while (!turns_.empty() && turns_.front().from_ns < start->t_ns) turns_.pop();
  while (!ranges_.empty() && ranges_.front().t_ns < start->t_ns) ranges_.pop();
  join_worlds();
  const FrameStatistics statistics = statistics_;
  const std::vector<MovingStart::TimedFrame>& frames = moving_start_.frames();
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    advance_measuring(frames[i].t_ns);
    use_image(frames[i].features, false);
  }
  statistics_ = statistics;
  moving_start_.clear();
  return true;
}

/// After a start that is not the first: the vehicle is where it was last known to be, less and less certainly; the
/// gyroscope tells how it turned since.
void Filter::join_worlds() {
  if (!last_good_) return;
  NavState last = last_good_->state;
  const auto variance = last_good_->covariance.diagonal().cwiseMax(0.0);
  const TimeNs from_ns = std::min(last.t_ns, state_.imu.t_ns);
  const TimeNs to_ns = std::max(last.t_ns, state_.imu.t_ns);
  const double since = seconds_between(from_ns, to_ns);
  double yaw_variance = variance(estimate_error::rotation + 2);
  if (imu_[0].t_ns <= from_ns) {
    Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
    imu_.for_each_piece(from_ns, to_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt) {
      turned *= exp_so3((gyro_B - last.b_g) * dt);
    });
    last.q_WB =
        last.q_WB * Eigen::Quaterniond(last.t_ns <= state_.imu.t_ns ? turned : Eigen::Matrix3d(turned.transpose()));
    yaw_variance += since * since * variance.segment<3>(estimate_error::gyro_bias).maxCoeff() +
                    since * calibration_.imu.gyro_noise * calibration_.imu.gyro_noise;
  } else {
    yaw_variance = M_PI * M_PI / 3.0;
  }
  const double way = since * (last.v_W.norm() + kUnseenSpeed);
  const double position_sigma = std::sqrt(variance.segment<3>(estimate_error::position).maxCoeff() + way * way);
  anchor_ = Anchor::join(last, predict_here(state_.imu.t_ns), std::sqrt(yaw_variance), position_sigma);
}

/// The accelerometer could tell the scale of the wheels, if its gain were known better than theirs. It is not: only
/// their difference is learned, and ordinary_covariance counts what the scale may be off.
void Filter::reset_covariance(const Eigen::VectorXd& sigma) {
  covariance_.reset(sigma);
  if (!scale_is_given()) return;
  const Eigen::RowVector2d mean_is_known(0.5 / kKnownScale, 0.5 / kKnownScale);
  covariance_.update(mean_is_known, err::wheel_radius, Eigen::Matrix<double, 1, 1>::Zero());
}

/// Standard deviations of the whole error vector before gravity and biases were measured.
Eigen::VectorXd Filter::start_sigma() const {
  const OnlineCalibrationConfig& online = config_.online_calibration;
  const PriorConfig& prior = config_.prior;
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<3>(err::theta) << kUnknownTilt, kUnknownTilt, kKnownSigma;
  sigma.segment<3>(err::nu).setConstant(config_.standstill.velocity_sigma);
  sigma.segment<3>(err::rho).setConstant(kKnownSigma);
  sigma.segment<3>(err::b_g).setConstant(prior.gyro_bias);
  sigma.segment<3>(err::b_a).setConstant(prior.accel_bias);
  if (online.camera_extrinsics && !calibration_.cameras.empty()) {
    sigma.segment<3>(err::camera).setConstant(prior.camera_rotation);
    sigma.segment<3>(err::camera + 3).setConstant(prior.camera_position);
    if (calibration_.cameras.size() == 2) {
      sigma.segment<3>(err::stereo).setConstant(prior.stereo_rotation);
      sigma.segment<3>(err::stereo + 3).setConstant(prior.stereo_position);
    }
  }
  if (online.time_offset && !calibration_.cameras.empty()) sigma(err::time_offset) = prior.time_offset;
  if (encoder_) {
    sigma.segment<2>(err::normal).setConstant(config_.odometer.normal_prior);
    if (online.wheels) sigma.segment<2>(err::wheel_radius).setConstant(prior.wheel_radius);
    if (online.wheels) sigma(err::wheel_separation) = prior.wheel_separation;
    if (online.odometer_rotation) {
      sigma.segment<3>(err::odometer).setConstant(sees_ground() ? prior.odometer_rotation : prior.odometer_unseen);
    }
    if (online.beam_tilt) sigma.segment(err::beams, beam_count_).setConstant(prior.beam_tilt);
  }
  return sigma;
}

void Filter::advance(TimeNs t_ns) {
  if (t_ns <= state_.imu.t_ns) return;
  ErrorTransition total;
  const double duration = seconds_between(state_.imu.t_ns, t_ns);
  imu_.for_each_piece(
      state_.imu.t_ns, t_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
        ImuCalibration noise = calibration_.imu;
        noise.gyro_noise *= factors.gyro;
        noise.accel_noise *= factors.accel / trust(MotionSensor::imu);
        imu_doubtful_ = imu_doubtful_ || noise.gyro_noise * std::sqrt(dt) > kDoubtfulTurn;
        if (imu_hole_ && state_.imu.t_ns >= imu_hole_->from_ns) {
          noise.gyro_noise *= kGapNoiseFactor;
          noise.accel_noise *= kGapNoiseFactor;
        }
        chain(total, error_transition(state_.imu, gyro_B, accel_B, dt, noise));
        state_.imu = integrate(state_.imu, gyro_B, accel_B, dt);
        rate_B_ = gyro_B - state_.imu.b_g;
      });
  state_.imu.t_ns = t_ns;
  const double walk = config_.odometer.normal_walk;
  const double distance = encoder_ ? state_.imu.v_W.norm() * duration : 0.0;
  covariance_.propagate(total, tangent_basis(state_.ground.n_W), walk * walk * distance);
  leave_imu_hole();
}

/// Where samples are missing, they may be lost, or the clock jumped: the vehicle went on meanwhile, or it did not.
void Filter::leave_imu_hole() {
  if (!imu_hole_ || state_.imu.t_ns < imu_hole_->to_ns) return;
  const double unseen = imu_hole_->unseen;
  imu_hole_.reset();
  imu_doubtful_ = true;
  doubt_motion(unseen * rate_B_.norm(), kHoleAccel * unseen, unseen * state_.imu.v_W.norm());
}

/// With an attitude that may be some degrees off, wheels and lasers would be linearized in the wrong place: the next
/// image comes first, if there is one soon.
bool Filter::waits_for_bridge() const {
  return imu_doubtful_ && any_image_ && calibration_.cameras.size() == 2 &&
         seconds_between(imu_time(last_image_ns_), state_.imu.t_ns) < kImageSoon;
}

/// Propagates to t_ns, taking in wheels and lasers on the way: each at its own time, or, if the state has passed that
/// already, where the state was then.
void Filter::advance_measuring(TimeNs t_ns) {
  while (!turns_.empty() || !ranges_.empty()) {
    const auto middle = [](const WheelTurn& turn) { return turn.from_ns + (turn.to_ns - turn.from_ns) / 2; };
    const bool wheels_next = !turns_.empty() && (ranges_.empty() || middle(turns_.front()) < ranges_.front().t_ns);
    const TimeNs next_ns = wheels_next ? middle(turns_.front()) : ranges_.front().t_ns;
    if (next_ns > t_ns) break;
    advance(next_ns);
    const bool used = !waits_for_bridge();
    if (wheels_next) {
      if (!used) {
        displacement_.reset();
      } else if (config_.odometer.update == OdometerUpdate::velocity) {
        update_with_wheels(turns_.front());
      } else if (rolls_at(turns_.front().from_ns)) {
        if (displacement_turns_.full()) displacement_turns_.pop();
        displacement_turns_.push(turns_.front());
      } else {
        displacement_.reset();
      }
      passed_turn_ = turns_.front();
      turns_.pop();
    } else {
      if (used) update_with_beams(ranges_.front());
      ranges_.pop();
    }
  }
  advance(t_ns);
}

Filter::Motion Filter::motion_at(TimeNs t_ns) const {
  const ImuState& x = state_.imu;
  Motion motion{x.R_WB, x.v_W};
  if (t_ns >= x.t_ns) return motion;
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();  // from the body then to the body now
  Eigen::Vector3d gained = Eigen::Vector3d::Zero();      // velocity, in the body then, without gravity
  imu_.for_each_piece(t_ns, x.t_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
    gained += turned * (accel_B - x.b_a) * dt;
    turned *= exp_so3((gyro_B - x.b_g) * dt);
  });
  motion.R_WB = x.R_WB * turned.transpose();
  motion.v_W = x.v_W - kGravity_W * seconds_between(t_ns, x.t_ns) - motion.R_WB * gained;
  return motion;
}

/// A wheel that slips comes back through the speeds that the gate lets pass: it must have agreed for a while.
bool Filter::agrees_again(TimeNs& since_ns, bool passes, TimeNs t_ns) {
  if (!passes) {
    since_ns = kDisagrees;
    return false;
  }
  if (since_ns == kDisagrees) since_ns = t_ns;
  return seconds_between(since_ns, t_ns) >= kSlipEnds;
}

void Filter::update_with_wheels(const WheelTurn& turn) {
  if (!rolls_at(turn.from_ns)) return;
  const OdometerConfig& odometer = config_.odometer;
  const double dt = turn.duration();
  const Motion motion = motion_at(turn.from_ns + (turn.to_ns - turn.from_ns) / 2);
  const MeanRate rate = imu_.mean_rate(turn.from_ns, turn.to_ns);
  WheelRows rows = linearize_wheels(state_, motion.R_WB, motion.v_W, turn, rate.gyro_B, odometer.model, sees_ground());

  const double per_root_metre = std::sqrt(std::abs(rows.wheel_speed) / dt);
  const double yaw_rate = (rate.gyro_B - state_.imu.b_g).norm();
  const double gyro_noise = rate.noise_factor * calibration_.imu.gyro_noise / std::sqrt(dt);
  const double count_noise = std::sqrt(2.0) * calibration_.encoder->noise_counts * 2.0 * M_PI /
                             static_cast<double>(calibration_.encoder->resolution) / dt *
                             state_.odometer.wheel_radius.mean() / std::sqrt(2.0);
  // On springs and tyres the body does not point along its path, and no laser tells by how much.
  const double sway = sees_ground() ? 0.0 : std::abs(rows.wheel_speed) / std::sqrt(dt);  // [m/s] per [rad sqrt(s)]
  const auto root_sum = [&](int row, std::initializer_list<double> sigmas) {
    double variance = 0.0;
    for (const double s : sigmas) variance += s * s;
    const double gyro = gyro_noise * rows.J_gyro.row(row).norm();
    return std::sqrt(variance + gyro * gyro);
  };
  const double floor = odometer.speed_sigma;
  Eigen::Vector4d sigma;
  sigma << root_sum(WheelRows::speed, {floor, odometer.slip * per_root_metre, count_noise}),
      root_sum(WheelRows::side, {floor, odometer.side_slip * per_root_metre, odometer.side_slip_turn * yaw_rate,
                                 odometer.body_yaw * sway}),
      root_sum(WheelRows::slope, {floor, odometer.roughness * per_root_metre, odometer.body_pitch * sway}),
      root_sum(WheelRows::yaw_rate, {odometer.yaw_rate_sigma, count_noise * 2.0 / state_.odometer.wheel_separation});
  log_wheels(rows, sigma, turn.to_ns);

  // Without lasers, roll and the gyroscope's bias are told apart by nothing else: both turn the path sideways.
  const bool terrain = odometer.model == OdometerModel::terrain;
  const bool use_yaw_rate =
      odometer.model == OdometerModel::differential || odometer.yaw_rate || (terrain && !sees_ground());
  const bool slope_known = !terrain || !sees_ground() || ground_known_;
  const bool speed_known = choose_wheels(rows, sigma, turn);
  std::array<bool, WheelRows::size> use = {speed_known, true, slope_known, use_yaw_rate && wheel_agreement_.agree()};
  Eigen::Matrix<double, WheelRows::size, kGroundColumns> H;
  Eigen::Matrix<double, WheelRows::size, 1> r;
  int count = 0;
  for (int row = 0; row < WheelRows::size; ++row) {
    if (!use[static_cast<std::size_t>(row)]) continue;
    const double variance = covariance_.variance(rows.H.row(row), err::nu) + sigma(row) * sigma(row);
    const bool passes = rows.residual(row) * rows.residual(row) <= gate_(1) * variance;
    if (row == WheelRows::slope && !passes) lifted_ns_ = turn.to_ns;
    if (!agrees_again(agrees_since_ns_[static_cast<std::size_t>(row)], passes, turn.to_ns)) {
      ++statistics_.wheel_rows_rejected;
      continue;
    }
    ++statistics_.wheel_rows_used;
    const double weight = trust(MotionSensor::odometer) / sigma(row);
    H.row(count) = weight * rows.H.row(row);
    r(count++) = weight * rows.residual(row);
  }
  if (count > 0) update(H.topRows(count), err::nu, r.head(count));
}

/// Where the wheels contradict each other by the gyroscope, the one that agrees with the state tells the speed. False
/// if none does. If both do, it lies somewhere between them. docs/filter.md, section 8.
bool Filter::choose_wheels(WheelRows& rows, Eigen::Vector4d& sigma, const WheelTurn& turn) {
  const double half = 0.5 * state_.odometer.wheel_separation;
  const bool agreed = wheel_agreement_.agree();
  wheel_agreement_.add(2.0 * half * rows.residual(WheelRows::yaw_rate),
                       2.0 * half * std::sqrt(covariance_.variance(rows.H.row(WheelRows::yaw_rate), err::nu)),
                       turn.to_ns);
  if (wheel_agreement_.agree()) return true;
  if (agreed) wheel_agrees_since_ns_.fill(kDisagrees);  // the state may have followed the wrong one a little

  const double sigma_one = std::hypot(sigma(WheelRows::speed), half * sigma(WheelRows::yaw_rate));
  std::array<WheelRows, 2> one = {rows, rows};
  std::array<bool, 2> believed{};
  for (std::size_t wheel = 0; wheel < 2; ++wheel) {
    one[wheel].take_one_wheel(wheel == 0 ? -half : half);
    const double residual = one[wheel].residual(WheelRows::speed);
    const double variance = covariance_.variance(one[wheel].H.row(WheelRows::speed), err::nu) + sigma_one * sigma_one;
    believed[wheel] =
        agrees_again(wheel_agrees_since_ns_[wheel], residual * residual <= gate_(1) * variance, turn.to_ns);
  }
  if (believed[0] && believed[1]) {
    const double doubt = 0.5 * wheel_agreement_.difference() * std::sqrt(kDoubtTime / turn.duration());
    sigma(WheelRows::speed) = std::hypot(sigma(WheelRows::speed), doubt);
    return true;
  }
  if (!believed[0] && !believed[1]) {
    ++statistics_.wheel_rows_rejected;
    return false;
  }
  rows = one[believed[0] ? 0 : 1];
  sigma(WheelRows::speed) = sigma_one;
  return true;
}

/// Each wheel by itself: the axle's speed and turn tell how fast it should roll.
void Filter::log_wheels(const WheelRows& rows, const Eigen::Matrix<double, WheelRows::size, 1>& sigma, TimeNs t_ns) {
  const double lever = 0.5 * state_.odometer.wheel_separation;
  for (const Source wheel : {Source::wheel_left, Source::wheel_right}) {
    const double side = wheel == Source::wheel_left ? -lever : lever;
    const Eigen::Matrix<double, 1, kGroundColumns> H =
        rows.H.row(WheelRows::speed) + side * rows.H.row(WheelRows::yaw_rate);
    const double noise = std::hypot(sigma(WheelRows::speed), side * sigma(WheelRows::yaw_rate));
    const double innovation = rows.residual(WheelRows::speed) + side * rows.residual(WheelRows::yaw_rate);
    log_.add(wheel, innovation, covariance_.variance(H, err::nu) + noise * noise, gate_(1), t_ns);
  }
}

/// From the newest clone, which is here and now.
void Filter::start_displacement() {
  displacement_.reset();
  if (!on_ground() || !ground_known_ || config_.odometer.update != OdometerUpdate::displacement) return;
  displacement_.emplace(wheel_model(state_.odometer), wheel_noise());
  displacement_->start(state_.imu.R_WB.transpose() * state_.ground.n_W, state_.imu.b_g);
  displacement_ns_ = state_.imu.t_ns;
}

/// Readings do not come when frames do: an interval is shared out in proportion, the last one goes on as it was.
void Filter::add_to_displacement(TimeNs until_ns) {
  while (displacement_ && displacement_ns_ < until_ns && !displacement_turns_.empty()) {
    const WheelTurn& turn = displacement_turns_.front();
    if (turn.to_ns <= displacement_ns_ && displacement_turns_.size() > 1) {
      displacement_turns_.pop();
      continue;
    }
    const bool last = displacement_turns_.size() == 1;
    if (turn.from_ns > displacement_ns_ + kMissedReading || (last && until_ns > turn.to_ns + kMissedReading)) {
      displacement_.reset();  // readings are missing
      return;
    }
    const TimeNs end_ns = last ? until_ns : std::min(until_ns, turn.to_ns);
    const double dt = seconds_between(displacement_ns_, end_ns);
    const MeanRate rate = imu_.mean_rate(displacement_ns_, end_ns);
    displacement_->add_interval(rate.gyro_B, dt, turn.angle * (dt / turn.duration()), rate.noise_factor);
    displacement_ns_ = end_ns;
  }
}

/// Before the clone of now: how the axle moved since the newest clone.
void Filter::update_with_displacement() {
  if (!displacement_ || state_.clones.empty() || !on_ground()) return;
  add_to_displacement(state_.imu.t_ns);
  if (!displacement_ || displacement_ns_ < state_.imu.t_ns) return;
  const WheelDisplacement z = displacement_->result();
  if (!z.usable) return;
  const int newest = static_cast<int>(state_.clones.size()) - 1;
  const DisplacementRows rows = linearize_displacement(state_, newest, z);
  const int clone = err::clone(newest);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3, clone + err::clone_size);
  H.leftCols<err::camera>() = rows.H;
  H.rightCols<err::clone_size>() = rows.H_clone;
  const double floor = config_.odometer.speed_sigma * z.duration;
  const Eigen::Matrix3d R = rows.covariance + floor * floor * Eigen::Matrix3d::Identity();
  const Eigen::LLT<Eigen::Matrix3d> llt(R);
  H = llt.matrixL().solve(H).eval();
  const Eigen::Vector3d r = llt.matrixL().solve(rows.residual);
  const auto P = covariance_.matrix().topLeftCorner(H.cols(), H.cols());
  const Eigen::Matrix3d S = H * P * H.transpose() + Eigen::Matrix3d::Identity();
  const bool passes = r.dot(S.ldlt().solve(r)) <= gate_(3);
  if (!agrees_again(agrees_since_ns_[WheelRows::speed], passes, state_.imu.t_ns)) {
    statistics_.wheel_rows_rejected += 3;
    return;
  }
  statistics_.wheel_rows_used += 3;
  const double weight = trust(MotionSensor::odometer);
  update(weight * H, 0, weight * r);
}

void Filter::update_with_beams(const BeamRanges& reading) {
  if (config_.odometer.model != OdometerModel::terrain || !on_ground()) return;
  const LaserCalibration& lasers = *calibration_.lasers;
  const Motion motion = motion_at(reading.t_ns);
  if (!ground_known_) restart_ground(reading, motion.R_WB);
  const double sigma = std::hypot(lasers.noise, config_.odometer.unevenness);
  Eigen::Matrix<double, kMaxBeams + 1, kGroundColumns> H;
  Eigen::Matrix<double, kMaxBeams + 1, 1> r;
  int count = 0;
  for (int i = 0; i < beam_count_; ++i) {
    const auto beam = static_cast<std::size_t>(i);
    const double range = reading.range[beam];
    if (!(range >= lasers.range_min && range <= lasers.range_max)) continue;
    const BeamPrediction z = predict_range(state_, motion.R_WB, beam, lasers.beams[beam].p_BL);
    auto h = H.row(count);
    h.setZero();
    h.segment<2>(ground_column(err::normal)) = z.H_normal;
    h(ground_column(err::beams) + i) = z.H_tilt;
    const double residual = range - z.range;
    const double variance = covariance_.variance(h, err::nu) + sigma * sigma;
    log_.add(beam_source(beam), residual, variance, gate_(1), reading.t_ns);
    if (!(residual * residual <= gate_(1) * variance)) {
      ++statistics_.beams_rejected;
      continue;
    }
    ++statistics_.beams_used;
    h /= sigma;
    r(count++) = residual / sigma;
  }
  const AxlePrediction axle = predict_axle(state_, motion.R_WB);
  const double axle_sigma = std::sqrt(2.0) * config_.odometer.unevenness / state_.odometer.wheel_separation;
  auto h = H.row(count);
  h.setZero();
  h.segment<2>(ground_column(err::normal)) = axle.H_normal;
  if (axle.lean * axle.lean <= gate_(1) * (covariance_.variance(h, err::nu) + axle_sigma * axle_sigma)) {
    h /= axle_sigma;
    r(count++) = -axle.lean / axle_sigma;
  }
  if (count > 0) update(H.topRows(count), err::nu, r.head(count));
}

/// Where nothing is known of the ground, the plane through the hits is where the linearization starts.
void Filter::restart_ground(const BeamRanges& reading, const Eigen::Matrix3d& R_WB) {
  const Eigen::Vector3d range(reading.range[0], reading.range[1], reading.range[2]);
  const std::optional<GroundPlane> plane =
      plane_through_hits(calibration_.lasers->beams, range, state_.odometer.T_BO.p);
  if (!plane) return;
  state_.ground.n_W = (R_WB * plane->n_B).normalized();
  covariance_.restart(err::normal, Eigen::Vector2d::Constant(config_.odometer.normal_prior));
  ground_known_ = true;
}

/// The vehicle is where it was at the newest clone, and its velocity is zero. docs/filter.md, section 4.
void Filter::hold_still() {
  statistics_.standing = true;
  const StandstillConfig& still = config_.standstill;
  const ImuState& x = state_.imu;
  const int newest = static_cast<int>(state_.clones.size()) - 1;
  const RelativeMotionRows rows = linearize_relative_motion(state_, newest, Pose{});
  const int columns = err::clone(newest) + err::clone_size;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 6, 1> weight;
  weight << Eigen::Vector3d::Constant(1.0 / still.rotation_sigma),
      Eigen::Vector3d::Constant(1.0 / still.position_sigma);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(9, columns);
  Eigen::Matrix<double, 9, 1> r;
  H.topLeftCorner<6, err::imu_size>() = weight.asDiagonal() * rows.H;
  H.topRightCorner<6, err::clone_size>() = weight.asDiagonal() * rows.H_clone;
  r.head<6>() = weight.asDiagonal() * rows.residual;
  H.block<3, 3>(6, err::theta) = -skew(x.v_W) / still.velocity_sigma;
  H.block<3, 3>(6, err::nu) = I / still.velocity_sigma;
  r.segment<3>(6) = -x.v_W / still.velocity_sigma;
  learn_calibration_ = false;
  update(H, 0, r);
}

void Filter::append_clone() {
  const ImuState& x = state_.imu;
  const Eigen::Vector3d rate_W = x.R_WB * rate_B_;
  Eigen::Matrix<double, 6, err::imu_size> J_imu = Eigen::Matrix<double, 6, err::imu_size>::Zero();
  J_imu.block<3, 3>(0, err::theta).setIdentity();
  J_imu.block<3, 3>(3, err::rho).setIdentity();
  Eigen::Matrix<double, 6, 1> J_offset;  // the frame was taken a moment later than thought: the vehicle moved on
  J_offset << rate_W, x.v_W + x.p_WB.cross(rate_W);
  covariance_.append_clone(J_imu, J_offset);
  state_.clones.push_back({next_frame_++, {x.R_WB, x.p_WB}, 1.0 / trust(MotionSensor::camera)});
  learn_calibration_ = !monitor_.health().untrusted[index_of(Source::camera_left)];
  clone_is_here_ = true;
}

void Filter::make_room(std::optional<std::size_t> leaving) {
  if (!leaving) return;
  tracks_.forget_frame(state_.clones[*leaving].frame);
  covariance_.remove(err::clone(static_cast<int>(*leaving)), err::clone_size);
  state_.clones.erase(state_.clones.begin() + static_cast<std::ptrdiff_t>(*leaving));
}

void Filter::update_with_features(const FeatureFrame& frame, std::optional<std::size_t> leaving) {
  const bool oldest_leaves = leaving && *leaving == 0;
  select_tracks(frame, oldest_leaves ? std::optional(state_.clones.front().frame) : std::nullopt);

  information_.start(state_.error_size());
  camera_squares_.fill(0.0);
  camera_observations_.fill(0);
  camera_poses(state_, cameras_);
  for (const std::size_t i : selected_) {
    ++(add_track(tracks_[i]) ? statistics_.features_used : statistics_.features_rejected);
    tracks_[i].observations.clear();  // each observation is used once
  }
  log_features();
  information_.compress();
  if (information_.residual().size() > 0) update(information_.H(), err::camera, information_.residual());

  // Features that ended, used or not, are forgotten.
  tracks_.keep_if([&](const Track& track) {
    return !track.observations.empty() && std::binary_search(frame_ids_.begin(), frame_ids_.end(), track.id);
  });
}

/// What both cameras saw of this frame's features, against where they were found to be.
void Filter::log_features() {
  for (std::size_t camera = 0; camera < calibration_.cameras.size(); ++camera) {
    if (camera_observations_[camera] == 0) continue;
    SourceLog::Features features;
    features.used = statistics_.features_used;
    features.rejected = statistics_.features_rejected;
    features.rms_px = std::sqrt(camera_squares_[camera] / camera_observations_[camera]);
    features.variance_px2 = config_.feature_sigma_px * config_.feature_sigma_px;
    log_.add(camera == 0 ? Source::camera_left : Source::camera_right, features, gate_(1), state_.imu.t_ns);
  }
}

/// Tracks that ended with this frame, and those that reach back to the clone that leaves; the longest first.
void Filter::select_tracks(const FeatureFrame& frame, std::optional<std::uint64_t> leaving) {
  frame_ids_.clear();
  for (const FeatureObservation& feature : frame.features) frame_ids_.push_back(feature.id);
  std::sort(frame_ids_.begin(), frame_ids_.end());
  selected_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Track& track = tracks_[i];
    if (track.observations.size() < kMinObservations) continue;
    const bool ended = !std::binary_search(frame_ids_.begin(), frame_ids_.end(), track.id);
    const bool fills_window = leaving && track.observations.front().frame == *leaving;
    if (ended || fills_window) selected_.push_back(i);
  }
  const auto longer = [&](std::size_t a, std::size_t b) {
    return tracks_[a].observations.size() > tracks_[b].observations.size();
  };
  std::stable_sort(selected_.begin(), selected_.end(), longer);
  const auto limit = static_cast<std::size_t>(config_.max_track_updates);
  if (selected_.size() > limit) selected_.resize(limit);
}

bool Filter::add_track(const Track& track) {
  sightings_.clear();
  const auto camera = [&](int clone, int which) { return cameras_[static_cast<std::size_t>(2 * clone + which)]; };
  for (const TrackObservation& o : track.observations) {
    const int clone = clone_index(o.frame);
    const CameraPose& left = camera(clone, 0);
    sightings_.push_back({left.R_CW, left.p_WC, o.left});
    if (!o.has_right) continue;
    const CameraPose& right = camera(clone, 1);
    sightings_.push_back({right.R_CW, right.p_WC, o.right});
  }
  const std::optional<InverseDepthPoint> point = triangulate(sightings_);
  if (!point) return false;
  observations_.clear();
  for (const TrackObservation& o : track.observations) {
    const int clone = clone_index(o.frame);
    add_observation(clone, 0, *point, o.left);
    if (o.has_right) add_observation(clone, 1, *point, o.right);
  }
  return information_.add(observations_, config_.feature_sigma_px / focal_px_,
                          config_.huber_px / config_.feature_sigma_px, covariance_.matrix(), gate_);
}

void Filter::add_observation(int clone, std::size_t camera, const InverseDepthPoint& point, const Eigen::Vector2d& uv) {
  observations_.push_back(linearize_observation(state_, clone, static_cast<int>(camera), point, uv));
  camera_squares_[camera] += focal_px_ * focal_px_ * observations_.back().residual.squaredNorm();
  camera_observations_[camera] += 2;
}

/// With a full window, the clone before the newest goes if it shows little that its elder does not; else the oldest.
/// Turning on the spot thus fills no window with copies. Where all of the window shows one place, as while a vehicle
/// shakes on its legs, there is nothing to keep, and the oldest goes: tracks are only used when they end or it leaves.
std::optional<std::size_t> Filter::clone_to_leave() const {
  const std::size_t n = state_.clones.size();
  if (n <= static_cast<std::size_t>(config_.window)) return std::nullopt;
  const auto same_place = [&](const Clone& a, const Clone& b) {
    return median_parallax_px(a, b) < config_.keyframe_parallax_px;
  };
  const bool copy = same_place(state_.clones[n - 3], state_.clones[n - 2]);
  return copy && !same_place(state_.clones.front(), state_.clones.back()) ? n - 2 : 0;
}

/// Median over the common features of how far they moved, the rotation taken out [px]. Infinite where they are few: a
/// clone that most of today's features never saw is no elder of theirs, however little the vehicle moved.
double Filter::median_parallax_px(const Clone& from, const Clone& to) const {
  const Eigen::Matrix3d R_C0B = state_.camera.T_BC0.R.transpose();
  const Eigen::Matrix3d R_to_from = R_C0B * to.T_WB.R.transpose() * from.T_WB.R * R_C0B.transpose();
  parallax_.clear();
  std::size_t seen = 0;  // features in `to`
  for (const Track& track : tracks_) {
    const TrackObservation* a = nullptr;
    const TrackObservation* b = nullptr;
    for (const TrackObservation& o : track.observations) {
      if (o.frame == from.frame) a = &o;
      if (o.frame == to.frame) b = &o;
    }
    seen += b != nullptr ? 1 : 0;
    if (a == nullptr || b == nullptr) continue;
    const Eigen::Vector3d turned = R_to_from * a->left.homogeneous();
    parallax_.push_back(focal_px_ * (b->left - turned.hnormalized()).norm());
  }
  if (static_cast<double>(parallax_.size()) < kCommonShare * static_cast<double>(seen) || parallax_.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  const auto middle = parallax_.begin() + static_cast<std::ptrdiff_t>(parallax_.size() / 2);
  std::nth_element(parallax_.begin(), middle, parallax_.end());
  return *middle;
}

void Filter::update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                    const Eigen::Ref<const Eigen::VectorXd>& r) {
  const int considered = learn_calibration_ ? 0 : err::calibration_size;
  const auto variance = [this] { return covariance_.matrix().diagonal().segment<6>(err::b_g); };
  const BiasWatch::Vector6 before = variance();
  const Eigen::Ref<const Eigen::VectorXd> correction = covariance_.update(H, first_column, r, err::camera, considered);
  if (!correction.allFinite()) return;  // the covariance shows it: possible()
  bias_watch_.add(correction.segment<6>(err::b_g), before - variance());
  boxplus_in_place(state_, correction);
}

/// A bias that jumped is as little known as at the start, and took the motion along until it was found out.
void Filter::watch_biases(double dt) {
  const BiasWatch::Verdict jumped = bias_watch_.judge(dt);
  if (!jumped.gyro && !jumped.accel) return;
  const double gyro = jumped.gyro ? config_.prior.gyro_bias : 0.0;
  const double accel = jumped.accel ? config_.prior.accel_bias : 0.0;
  doubt_motion(gyro * kBiasDelay, accel * kBiasDelay, 0.5 * accel * kBiasDelay * kBiasDelay);
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << Eigen::Vector3d::Constant(gyro), Eigen::Vector3d::Constant(accel);
  covariance_.widen(err::b_g, sigma.cwiseAbs2().asDiagonal().toDenseMatrix());
  monitor_.add_bias_jump(jumped.gyro, jumped.accel, state_.imu.t_ns);
}

int Filter::clone_index(std::uint64_t frame) const {
  const auto clone = std::lower_bound(state_.clones.begin(), state_.clones.end(), frame,
                                      [](const Clone& c, std::uint64_t f) { return c.frame < f; });
  return static_cast<int>(clone - state_.clones.begin());
}

std::optional<NavState> Filter::predict(TimeNs t_ns) const {
  if (!usable() || !is_time(t_ns) || seconds_between(imu_.newest().t_ns, t_ns) > kLongestPredict) return std::nullopt;
  return anchor_.to_world(predict_here(t_ns));
}

NavState Filter::predict_here(TimeNs t_ns) const {
  ImuState x = state_.imu;
  if (t_ns > x.t_ns) {
    imu_.for_each_piece(x.t_ns, t_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
      x = integrate(x, gyro_B, accel_B, dt);
    });
    x.t_ns = t_ns;
  }
  return NavState{x.t_ns, Eigen::Quaterniond(x.R_WB).normalized(), x.p_WB, x.v_W, x.b_g, x.b_a};
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
