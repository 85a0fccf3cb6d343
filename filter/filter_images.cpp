// Filter: what is done with a frame: bridges, standing still, clones, features.
#include "filter/filter.h"

#include <algorithm>
#include <cmath>

#include "filter/parallax.h"
#include "filter/relative_motion.h"

namespace ear {
namespace {

constexpr double kBridgeRotation = 2e-3;    // [rad] standard deviations with which two images tell of the motion:
constexpr double kBridgePosition = 5e-3;    // [m] well above what the features will tell later
constexpr std::size_t kFewestRepeated = 8;  // features, for two images to be the same
constexpr double kFeigned = 3.0;            // standard deviations of the cameras' calibration that feign a turn
constexpr double kOldImage = 0.5;           // [s] after which frames have little in common
constexpr double kNoisy = 1.25;             // times the usual standard deviation of a feature: less may be chance
constexpr double kNegligible = 1e-4;  // see FeatureInformation: in all 2e-4 of what a frame tells, in 12 % of the rows
constexpr int kFeed = 10;             // features used, that tell enough of where the vehicle is
constexpr double kStarved = 0.6;      // [s] so long it may do without
constexpr std::size_t kMinObservations = 2;  // clones that must have seen a feature

}  // namespace

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

/// What the next image is compared with.
void Filter::note_image(const FeatureFrame& frame) {
  any_image_ = true;
  last_image_ns_ = frame.t_ns;
  last_features_ = frame;
  image_rate_B_ = rate_B_;
  image_T_WB_ = {state_.imu.R_WB, state_.imu.p_WB};
  image_clone_.reset();
  if (state_.clones.empty()) return;
  const Clone& clone = state_.clones.back();
  image_clone_ = clone.frame;
  image_in_clone_ = {clone.T_WB.R.transpose() * image_T_WB_.R,
                     clone.T_WB.R.transpose() * (image_T_WB_.p - clone.T_WB.p)};
}

/// Where the body was at the last image, by all that was measured since: what wheels and lasers measure on the way to
/// the next image corrects clone and state alike, and is no motion.
Pose Filter::image_pose() const {
  if (!image_clone_ || status_ != Status::tracking) return image_T_WB_;
  const auto at = static_cast<std::size_t>(clone_index(*image_clone_));
  if (at >= state_.clones.size() || state_.clones[at].frame != *image_clone_)
    return image_T_WB_;  // it was marginalised
  const Pose& T_WB = state_.clones[at].T_WB;
  return {T_WB.R * image_in_clone_.R, T_WB.R * image_in_clone_.p + T_WB.p};
}

/// The body now, in the body at the last image.
Pose Filter::motion_since_image() const {
  const Pose T_WB0 = image_pose();
  return {T_WB0.R.transpose() * state_.imu.R_WB, T_WB0.R.transpose() * (state_.imu.p_WB - T_WB0.p)};
}

/// Where the inertial samples since the last image may be wrong by more than noise (clipped, missing, stamps that
/// jumped), the two images tell how the body moved, roughly: later, the features of both will tell it in full, around a
/// state that is near enough to be linear. docs/filter.md, section 15.
void Filter::bridge(const FeatureFrame& frame) {
  const bool needed = doubtful_since_ns_.has_value();
  doubtful_since_ns_.reset();
  if (!needed || !any_image_ || calibration_.cameras.size() < 2 || state_.clones.empty()) return;
  const Pose moved = motion_since_image();
  StereoMotion start;
  start.R_B0B1 = moved.R;
  start.p_B0B1 = moved.p;
  const std::optional<StereoMotion> motion = stereo_motion(bridge_matches_.find(last_features_, frame), state_.camera,
                                                           start, config_.feature_sigma_px / focal_px_);
  if (!motion) return;
  const int newest = static_cast<int>(state_.clones.size()) - 1;
  const RelativeMotionRows rows = linearize_relative_motion(state_, newest, {motion->R_B0B1, motion->p_B0B1});
  const Eigen::Matrix3d R_WB0 = state_.clones.back().T_WB.R;
  const Eigen::Matrix3d covariance =
      R_WB0 * motion->covariance * R_WB0.transpose() + kBridgePosition * kBridgePosition * Eigen::Matrix3d::Identity();
  const Eigen::LLT<Eigen::Matrix3d> llt(covariance);
  const int clone = err::clone(newest);
  auto H = rows_.topLeftCorner(6, clone + err::clone_size);
  H.setZero();
  H.topLeftCorner<3, err::imu_size>() = rows.H.topRows<3>() / kBridgeRotation;
  H.topRightCorner<3, err::clone_size>() = rows.H_clone.topRows<3>() / kBridgeRotation;
  H.bottomLeftCorner<3, err::imu_size>() = llt.matrixL().solve(rows.H.bottomRows<3>());
  H.bottomRightCorner<3, err::clone_size>() = llt.matrixL().solve(rows.H_clone.bottomRows<3>());
  Eigen::Matrix<double, 6, 1> r;
  r << rows.residual.head<3>() / kBridgeRotation, llt.matrixL().solve(rows.residual.tail<3>());
  learn_calibration_ = false;
  update(H, 0, r, true);
  bridged_ns_ = state_.imu.t_ns;
}

/// By how much the features are less exact than they usually are: 1 if they are not.
double Filter::noise_of(const FeatureFrame& frame) {
  if (calibration_.cameras.size() < 2) return 1.0;
  const double ratio = image_noise_.measure(frame, state_.camera) * focal_px_ / config_.feature_sigma_px;
  return ratio > kNoisy ? ratio : 1.0;
}

/// How fast the errors of the cameras' mounting and of their time offset make the vehicle seem to turn otherwise than
/// the gyroscope says, with the last image `dt` ago [rad/s].
double Filter::feigned_turn(double dt) const {
  const double mounting = covariance_.matrix().diagonal().segment<3>(err::camera).cwiseMax(0.0).maxCoeff();
  const double offset = std::max(0.0, covariance_.matrix()(err::time_offset, err::time_offset));
  const double acceleration = (rate_B_ - image_rate_B_).norm() / dt;
  return kFeigned * std::sqrt(rate_B_.squaredNorm() * mounting + acceleration * acceleration * offset);
}

/// At the state's time, which is the frame's, before the frame changes it: does it show the motion since the last image
/// that the other sensors predict?
FrameAgreement Filter::check_frame(const FeatureFrame& frame) {
  FrameAgreement agreement;
  if (calibration_.cameras.size() < 2) return agreement;
  const double dt = seconds_between(last_image_ns_, frame.t_ns);
  if (any_image_ && dt <= kOldImage) {
    const Pose moved = motion_since_image();
    const double sigma_v = std::sqrt(covariance_.matrix().diagonal().segment<3>(err::nu).maxCoeff());
    const PredictedMotion motion{moved.R, moved.p, dt * sigma_v};
    agreement = frame_check_.compare(last_features_, frame, motion, state_.camera, feature_noise_);
    agreement.feigned_turn = feigned_turn(dt);
  }
  agreement.noise = feature_noise_;
  agreement.behind = frame_check_.share_behind(frame, state_.camera, feature_noise_);
  return agreement;
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
    while (state_.clones.size() > window_) make_room(0);  // the window has become smaller
  }
  statistics_.clones = static_cast<int>(state_.clones.size());
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

/// The vehicle is where it was at the newest clone, and its velocity is zero. docs/filter.md, section 4.
void Filter::hold_still() {
  fed_ns_ = state_.imu.t_ns;
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
  auto H = rows_.topLeftCorner(9, columns);
  H.setZero();
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
  state_.clones.push_back({next_frame_++, {x.R_WB, x.p_WB}, feature_noise_ / trust(MotionSensor::camera)});
  learn_calibration_ = !monitor_.health().faulty[index_of(Source::camera_left)];
  clone_is_here_ = true;
}

void Filter::make_room(std::optional<std::size_t> leaving) {
  if (!leaving) return;
  if (*leaving == 0) fed_ns_ = state_.imu.t_ns;  // with all that reached back to it
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
  note_features_used();
  log_features();
  information_.compress(kNegligible);
  if (information_.residual().size() > 0) update(information_.H(), err::camera, information_.residual(), true);

  // Features that ended, used or not, are forgotten.
  tracks_.keep_if([&](const Track& track) {
    return !track.observations.empty() && std::binary_search(frame_ids_.begin(), frame_ids_.end(), track.id);
  });
}

void Filter::note_features_used() {
  fed_features_ += statistics_.features_used;
  if (fed_features_ < kFeed) return;
  fed_features_ = 0;
  fed_ns_ = state_.imu.t_ns;
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
    const std::size_t observations_a = tracks_[a].observations.size();
    const std::size_t observations_b = tracks_[b].observations.size();
    return observations_a != observations_b ? observations_a > observations_b : a < b;
  };
  std::sort(selected_.begin(), selected_.end(), longer);
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
/// Neither may happen for long where a vehicle sways to and fro and sees the same all the time: then the oldest goes
/// too.
std::optional<std::size_t> Filter::clone_to_leave() const {
  const std::size_t n = state_.clones.size();
  if (n <= window_) return std::nullopt;
  const auto same_place = [&](const Clone& a, const Clone& b) {
    return median_parallax_px(a, b) < config_.keyframe_parallax_px;
  };
  const bool copy = same_place(state_.clones[n - 3], state_.clones[n - 2]);
  const bool starved = seconds_between(fed_ns_, state_.imu.t_ns) > kStarved;
  return copy && !starved && !same_place(state_.clones.front(), state_.clones.back()) ? n - 2 : 0;
}

double Filter::median_parallax_px(const Clone& from, const Clone& to) const {
  const Eigen::Matrix3d& R_BC0 = state_.camera.T_BC0.R;
  return focal_px_ *
         median_parallax(tracks_, {from.frame, from.T_WB.R * R_BC0}, {to.frame, to.T_WB.R * R_BC0}, parallax_);
}

int Filter::clone_index(std::uint64_t frame) const {
  const auto clone = std::lower_bound(state_.clones.begin(), state_.clones.end(), frame,
                                      [](const Clone& c, std::uint64_t f) { return c.frame < f; });
  return static_cast<int>(clone - state_.clones.begin());
}

}  // namespace ear
