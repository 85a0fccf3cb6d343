#include "filter/filter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace ear {
namespace {

constexpr std::size_t kImuCapacity = 4096;   // 20 s at 200 Hz, 4 s at 1 kHz
constexpr double kHeldSample = 0.02;         // [s] so far the newest IMU sample may stand in for one that is missing
constexpr double kGapNoiseFactor = 10.0;     // on the noise densities while a gap in the IMU data is bridged
constexpr double kStartGravityNoise = 0.02;  // [m/s^2] what idling rotors leave in the mean specific force
constexpr double kKnownSigma = 1e-6;         // [m, rad] of position and yaw at the start: by definition zero
constexpr double kUnknownTilt = 0.3;         // [rad] before gravity was measured
constexpr std::size_t kMinObservations = 2;  // clones that must have seen a feature

int error_capacity(const FilterConfig& config) { return err::clone(config.window + 1); }

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(what);
}

const FilterConfig& checked(const FilterConfig& config) {
  require(config.window >= 3, "filter.window: at least 3 clones are needed");
  require(config.window <= 60, "filter.window: at most 60 clones");
  require(config.max_track_updates >= 1, "filter.max_track_updates: at least 1");
  require(config.feature_sigma_px > 0.0, "filter.feature_sigma_px: must be positive");
  require(config.huber_px > 0.0, "filter.huber_px: must be positive");
  require(config.gate_probability > 0.0 && config.gate_probability < 1.0, "filter.gate_probability: between 0 and 1");
  return config;
}

const Calibration& checked(const Calibration& calibration) {
  require(!calibration.cameras.empty(), "calibration: a camera is needed");
  require(calibration.cameras.size() <= 2, "calibration: at most two cameras");
  for (const CameraCalibration& camera : calibration.cameras) {
    require(camera.fu > 0.0 && camera.fv > 0.0, "calibration: a camera's focal lengths must be positive");
    const Eigen::Matrix3d R = camera.T_BC.linear();
    require((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 && R.determinant() > 0.0,
            "calibration: a camera's T_BS holds no rotation");
  }
  require(calibration.imu.gyro_noise > 0.0 && calibration.imu.accel_noise > 0.0,
          "calibration: imu noise must be positive");
  return calibration;
}

CameraState camera_state(const Calibration& calibration) {
  CameraState camera;
  const Eigen::Isometry3d& T_BC0 = calibration.cameras.front().T_BC;
  camera.T_BC0 = {renormalized(T_BC0.linear()), T_BC0.translation()};
  const Eigen::Isometry3d T_C0C1 = T_BC0.inverse() * calibration.cameras.back().T_BC;
  camera.T_C0C1 = {renormalized(T_C0C1.linear()), T_C0C1.translation()};
  camera.time_offset = calibration.camera_time_offset;
  return camera;
}

}  // namespace

Filter::Filter(const FilterConfig& config, const Calibration& calibration)
    : config_(checked(config)),
      calibration_(checked(calibration)),
      focal_px_(0.5 * (calibration.cameras[0].fu + calibration.cameras[0].fv)),
      gate_(config.gate_probability, 4 * (config.window + 1)),
      covariance_(error_capacity(config)),
      imu_(kImuCapacity),
      standstill_(config.standstill, focal_px_),
      information_(config.window + 1, config.max_track_updates) {
  state_.camera = camera_state(calibration);
  state_.clones.reserve(static_cast<std::size_t>(config.window) + 1);
}

TimeNs Filter::imu_time(TimeNs camera_time_ns) const {
  return camera_time_ns + static_cast<TimeNs>(std::llround(1e9 * state_.camera.time_offset));
}

bool Filter::covers(TimeNs t_ns) const {
  return !imu_.empty() && seconds_between(imu_.newest().t_ns, imu_time(t_ns)) < kHeldSample;
}

void Filter::add_imu(const ImuSample& sample) {
  const bool finite = sample.gyro_B.allFinite() && sample.accel_B.allFinite();
  if (!finite || (!imu_.empty() && sample.t_ns <= imu_.newest().t_ns)) {
    ++imu_counts_.rejected;
    return;
  }
  if (!imu_.empty() && seconds_between(imu_.newest().t_ns, sample.t_ns) > config_.max_imu_gap) ++imu_counts_.gaps;
  // Without frames for long, the state moves on before its samples are overwritten.
  if (status_ == Status::tracking && imu_.size() == kImuCapacity && state_.imu.t_ns < imu_[kImuCapacity / 2].t_ns) {
    advance(imu_[kImuCapacity / 2].t_ns);
  }
  imu_.push(sample);
}

std::optional<RelativeMotion> Filter::motion_to(TimeNs t_ns) const {
  if (!any_frame_ || imu_.empty() || t_ns <= last_frame_ns_) return std::nullopt;
  RelativeMotion motion;
  if (status_ != Status::tracking) {
    Eigen::Matrix3d R_B0B1 = Eigen::Matrix3d::Identity();
    imu_.for_each_piece(
        imu_time(last_frame_ns_), imu_time(t_ns),
        [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt) { R_B0B1 *= exp_so3(gyro_B * dt); });
    motion.R_B1B0 = R_B0B1.transpose();
    return motion;
  }
  const std::optional<NavState> next = predict(imu_time(t_ns));
  const Eigen::Matrix3d R_B0W = state_.imu.R_WB.transpose();
  motion.R_B1B0 = next->q_WB.toRotationMatrix().transpose() * state_.imu.R_WB;
  motion.p_B0B1 = R_B0W * (next->p_WB - state_.imu.p_WB);
  motion.translation_known = true;
  return motion;
}

std::optional<Estimate> Filter::process(const FeatureFrame& frame) {
  if (!covers(frame.t_ns) || (any_frame_ && frame.t_ns <= last_frame_ns_)) return std::nullopt;
  any_frame_ = true;
  last_frame_ns_ = frame.t_ns;
  statistics_ = FrameStatistics{};
  statistics_.tracks = static_cast<int>(frame.features.size());
  statistics_.stereo = static_cast<int>(std::count_if(frame.features.begin(), frame.features.end(),
                                                      [](const FeatureObservation& f) { return f.has_right; }));

  const TimeNs t_ns = imu_time(frame.t_ns);
  const bool started = status_ == Status::tracking;
  const ImuStatistics imu = imu_.statistics(t_ns - static_cast<TimeNs>(1e9 * config_.standstill.duration), t_ns);
  const bool still = standstill_.update(frame, imu, started ? state_.imu.b_g : Eigen::Vector3d::Zero(),
                                        started ? config_.standstill.max_gyro : config_.standstill.max_gyro_at_start);
  if (!started && !try_start(frame, imu, still)) return std::nullopt;

  advance(t_ns);
  if (still && !state_.clones.empty()) {
    hold_still();
  } else {
    append_clone();
    tracks_.add(state_.clones.back().frame, frame.features);
    update_with_features(frame);
  }
  statistics_.clones = static_cast<int>(state_.clones.size());
  return make_estimate();
}

/// Standing: the mean specific force is gravity, the mean rate is the gyroscope's bias.
bool Filter::try_start(const FeatureFrame& frame, const ImuStatistics& imu, bool still) {
  status_ = imu.count < 2 ? Status::waiting_for_imu : Status::waiting_for_standstill;
  if (!still) return false;

  ImuState& x = state_.imu;
  x = ImuState{};
  x.t_ns = imu_time(frame.t_ns);
  x.R_WB = Eigen::Quaterniond::FromTwoVectors(imu.accel_mean, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  x.b_g = imu.gyro_mean;
  // What the force measures beyond gravity's known size can only be bias.
  const Eigen::Vector3d gravity_B = -(x.R_WB.transpose() * kGravity_W);

  const OnlineCalibrationConfig& online = config_.online_calibration;
  const PriorConfig& prior = config_.prior;
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<3>(err::theta) << kUnknownTilt, kUnknownTilt, kKnownSigma;
  sigma.segment<3>(err::nu).setConstant(config_.standstill.velocity_sigma);
  sigma.segment<3>(err::rho).setConstant(kKnownSigma);
  sigma.segment<3>(err::b_g).setConstant(prior.gyro_bias);
  sigma.segment<3>(err::b_a).setConstant(prior.accel_bias);
  if (online.camera_extrinsics) {
    sigma.segment<3>(err::camera).setConstant(prior.camera_rotation);
    sigma.segment<3>(err::camera + 3).setConstant(prior.camera_position);
    if (calibration_.cameras.size() == 2) {
      sigma.segment<3>(err::stereo).setConstant(prior.stereo_rotation);
      sigma.segment<3>(err::stereo + 3).setConstant(prior.stereo_position);
    }
  }
  if (online.time_offset) sigma(err::time_offset) = prior.time_offset;
  covariance_.reset(sigma);
  status_ = Status::tracking;

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
  return true;
}

void Filter::advance(TimeNs t_ns) {
  if (t_ns <= state_.imu.t_ns) return;
  ErrorTransition total;
  imu_.for_each_piece(state_.imu.t_ns, t_ns,
                      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
                        ImuCalibration noise = calibration_.imu;
                        if (dt > config_.max_imu_gap) {
                          noise.gyro_noise *= kGapNoiseFactor;
                          noise.accel_noise *= kGapNoiseFactor;
                        }
                        chain(total, error_transition(state_.imu, gyro_B, accel_B, dt, noise));
                        state_.imu = integrate(state_.imu, gyro_B, accel_B, dt);
                        rate_B_ = gyro_B - state_.imu.b_g;
                      });
  state_.imu.t_ns = t_ns;
  covariance_.propagate(total);
}

/// The vehicle is where it was at the newest clone, and its velocity is zero. docs/filter.md, section 4.
void Filter::hold_still() {
  statistics_.standing = true;
  const StandstillConfig& still = config_.standstill;
  const ImuState& x = state_.imu;
  const Pose& held = state_.clones.back().T_WB;
  const int clone = err::clone(static_cast<int>(state_.clones.size()) - 1);
  const int columns = clone + err::clone_size;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(9, columns);
  Eigen::Matrix<double, 9, 1> r;
  H.block<3, 3>(0, err::theta) = I / still.rotation_sigma;
  H.block<3, 3>(0, clone) = -I / still.rotation_sigma;
  r.segment<3>(0) = -log_so3(x.R_WB * held.R.transpose()) / still.rotation_sigma;
  H.block<3, 3>(3, err::theta) = -skew(x.p_WB) / still.position_sigma;
  H.block<3, 3>(3, err::rho) = I / still.position_sigma;
  H.block<3, 3>(3, clone) = skew(held.p) / still.position_sigma;
  H.block<3, 3>(3, clone + 3) = -I / still.position_sigma;
  r.segment<3>(3) = (held.p - x.p_WB) / still.position_sigma;
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
  state_.clones.push_back({next_frame_++, {x.R_WB, x.p_WB}});
  learn_calibration_ = true;
}

void Filter::update_with_features(const FeatureFrame& frame) {
  const std::optional<std::size_t> leaving = clone_to_leave();
  const bool oldest_leaves = leaving && *leaving == 0;
  select_tracks(frame, oldest_leaves ? std::optional(state_.clones.front().frame) : std::nullopt);

  information_.start(state_.error_size());
  camera_poses(state_, cameras_);
  for (const std::size_t i : selected_) {
    ++(add_track(tracks_[i]) ? statistics_.features_used : statistics_.features_rejected);
    tracks_[i].observations.clear();  // each observation is used once
  }
  information_.compress();
  if (information_.residual().size() > 0) update(information_.H(), err::camera, information_.residual());

  // Features that ended, used or not, are forgotten; so is the clone that makes room.
  tracks_.keep_if([&](const Track& track) {
    return !track.observations.empty() && std::binary_search(frame_ids_.begin(), frame_ids_.end(), track.id);
  });
  if (leaving) {
    tracks_.forget_frame(state_.clones[*leaving].frame);
    covariance_.remove(err::clone(static_cast<int>(*leaving)), err::clone_size);
    state_.clones.erase(state_.clones.begin() + static_cast<std::ptrdiff_t>(*leaving));
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
    observations_.push_back(linearize_observation(state_, clone, 0, *point, o.left));
    if (o.has_right) observations_.push_back(linearize_observation(state_, clone, 1, *point, o.right));
  }
  return information_.add(observations_, config_.feature_sigma_px / focal_px_,
                          config_.huber_px / config_.feature_sigma_px, covariance_.matrix(), gate_);
}

/// With a full window, the clone before the newest goes if it shows little that its elder does not; else the oldest.
/// Standing still or turning on the spot thus fills no window with copies.
std::optional<std::size_t> Filter::clone_to_leave() const {
  const std::size_t n = state_.clones.size();
  if (n <= static_cast<std::size_t>(config_.window)) return std::nullopt;
  const bool copy = median_parallax_px(state_.clones[n - 3], state_.clones[n - 2]) < config_.keyframe_parallax_px;
  return copy ? n - 2 : 0;
}

/// Median over the common features of how far they moved, the rotation taken out [px]; infinite without any.
double Filter::median_parallax_px(const Clone& from, const Clone& to) const {
  const Eigen::Matrix3d R_C0B = state_.camera.T_BC0.R.transpose();
  const Eigen::Matrix3d R_to_from = R_C0B * to.T_WB.R.transpose() * from.T_WB.R * R_C0B.transpose();
  parallax_.clear();
  for (const Track& track : tracks_) {
    const TrackObservation* a = nullptr;
    const TrackObservation* b = nullptr;
    for (const TrackObservation& o : track.observations) {
      if (o.frame == from.frame) a = &o;
      if (o.frame == to.frame) b = &o;
    }
    if (a == nullptr || b == nullptr) continue;
    const Eigen::Vector3d turned = R_to_from * a->left.homogeneous();
    parallax_.push_back(focal_px_ * (b->left - turned.hnormalized()).norm());
  }
  if (parallax_.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = parallax_.begin() + static_cast<std::ptrdiff_t>(parallax_.size() / 2);
  std::nth_element(parallax_.begin(), middle, parallax_.end());
  return *middle;
}

void Filter::update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                    const Eigen::Ref<const Eigen::VectorXd>& r) {
  const int considered = learn_calibration_ ? 0 : err::calibration_size;
  boxplus_in_place(state_, covariance_.update(H, first_column, r, err::camera, considered));
}

int Filter::clone_index(std::uint64_t frame) const {
  const auto clone = std::lower_bound(state_.clones.begin(), state_.clones.end(), frame,
                                      [](const Clone& c, std::uint64_t f) { return c.frame < f; });
  return static_cast<int>(clone - state_.clones.begin());
}

std::optional<NavState> Filter::predict(TimeNs t_ns) const {
  if (status_ != Status::tracking) return std::nullopt;
  ImuState x = state_.imu;
  if (t_ns > x.t_ns) {
    imu_.for_each_piece(x.t_ns, t_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
      x = integrate(x, gyro_B, accel_B, dt);
    });
    x.t_ns = t_ns;
  }
  return NavState{x.t_ns, Eigen::Quaterniond(x.R_WB).normalized(), x.p_WB, x.v_W, x.b_g, x.b_a};
}

/// From the invariant error to the ordinary one: dv = nu - [v]x theta, dp = rho - [p]x theta.
Estimate Filter::make_estimate() const {
  const ImuState& x = state_.imu;
  Estimate estimate;
  estimate.state = *predict(x.t_ns);
  ImuErrorMatrix T = ImuErrorMatrix::Identity();
  T.block<3, 3>(estimate_error::velocity, err::theta) = -skew(x.v_W);
  T.block<3, 3>(estimate_error::position, err::theta) = -skew(x.p_WB);
  estimate.covariance = T * covariance_.matrix().topLeftCorner<err::imu_size, err::imu_size>() * T.transpose();
  estimate.frame = statistics_;
  return estimate;
}

}  // namespace ear
