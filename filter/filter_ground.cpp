// Filter: contact with the ground, wheels and lasers.
#include "filter/filter.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "filter/displacement_update.h"
#include "filter/displacements.h"
#include "filter/ground.h"

namespace ear {
namespace {

constexpr double kSpinUp = 0.1;                // [s] after a touchdown until the wheels roll
constexpr double kTakeoffVelocity = 0.05;      // [m/s] what the odometer was wrong by before a take-off was noticed
constexpr double kTakeoffPosition = 5e-3;      // [m] what came of it
constexpr double kDoubtTime = 0.5;             // [s] the contradiction of two wheels is one error so long
constexpr double kLevelOff = 0.05;             // [m] of a plane from the wheels that stand on it
constexpr double kLeanOff = 0.2;               // sine of the axle's angle to it
constexpr int kPatience = 25;                  // readings of the lasers
constexpr TimeNs kMissedReading = 50'000'000;  // [ns] without wheel readings: a displacement has a gap

}  // namespace

/// After a change of the ground under the wheels nothing is known of it. A take-off is noticed some centimetres above
/// the ground, and until then the odometer held the vehicle there.
void Filter::note_contact(ContactEvent event) {
  if (event == ContactEvent::none) return;
  ground_known_ = false;
  if (event != ContactEvent::takeoff || status_ != Status::tracking) return;
  doubt_motion(0.0, kTakeoffVelocity, kTakeoffPosition);
  bias_watch_.clear();  // it saw what the odometer did
}

/// Do the wheels tell how the vehicle moves? Not in the air, and not while they are spun up by the ground.
bool Filter::rolls_at(TimeNs t_ns) const {
  const std::optional<TimeNs> since_ns = contact_.since_ns();
  return on_ground() && (!since_ns || seconds_between(*since_ns, t_ns) > kSpinUp);
}

Displacement Filter::displacement_by_wheels(TimeNs until_ns) const {
  const bool terrain = config_.odometer.model == OdometerModel::terrain && beam_count_ > 0;
  if (!encoder_ || !rolls_at(state_.imu.t_ns) || (terrain && !ground_known_)) return {};
  const WheelSetting setting{wheel_model(state_.odometer), wheel_noise(config_.odometer, calibration_),
                             config_.odometer.speed_sigma, config_.odometer.side_slip_turn, terrain};
  return wheel_displacement(state_, covariance_, TurnsBetween(passed_turn_, turns_), imu_, until_ns, setting);
}

void Filter::update_with_wheels(const WheelIncrement& turn) {
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
      root_sum(WheelRows::yaw_rate, {odometer.yaw_rate_sigma, count_noise * 2.0 / state_.odometer.track_width});
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
bool Filter::choose_wheels(WheelRows& rows, Eigen::Vector4d& sigma, const WheelIncrement& turn) {
  const double half = 0.5 * state_.odometer.track_width;
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
  const double lever = 0.5 * state_.odometer.track_width;
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
  displacement_.emplace(wheel_model(state_.odometer), wheel_noise(config_.odometer, calibration_));
  displacement_->start(state_.imu.R_WB.transpose() * state_.ground.n_W, state_.imu.b_g);
  displacement_ns_ = state_.imu.t_ns;
}

/// Readings do not come when frames do: an interval is shared out in proportion, the last one goes on as it was.
void Filter::add_to_displacement(TimeNs until_ns) {
  while (displacement_ && displacement_ns_ < until_ns && !displacement_turns_.empty()) {
    const WheelIncrement& turn = displacement_turns_.front();
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
  auto H = rows_.topRows<3>().leftCols(clone + err::clone_size);
  H.setZero();
  H.leftCols<err::camera>() = rows.H;
  H.rightCols<err::clone_size>() = rows.H_clone;
  const double floor = config_.odometer.speed_sigma * z.duration;
  const Eigen::Matrix3d R = rows.covariance + floor * floor * Eigen::Matrix3d::Identity();
  const Eigen::LLT<Eigen::Matrix3d> llt(R);
  llt.matrixL().solveInPlace(H);
  Eigen::Vector3d r = llt.matrixL().solve(rows.residual);
  const auto P = covariance_.matrix().topLeftCorner(H.cols(), H.cols());
  auto HP = rows_.middleRows<3>(3).leftCols(H.cols());
  HP.noalias() = H * P;
  const Eigen::Matrix3d S = HP * H.transpose() + Eigen::Matrix3d::Identity();
  const bool passes = r.dot(S.ldlt().solve(r)) <= gate_(3);
  if (!agrees_again(agrees_since_ns_[WheelRows::speed], passes, state_.imu.t_ns)) {
    statistics_.wheel_rows_rejected += 3;
    return;
  }
  statistics_.wheel_rows_used += 3;
  const double weight = trust(MotionSensor::odometer);
  H *= weight;
  r *= weight;
  update(H, 0, r);
}

void Filter::update_with_beams(const BeamRanges& reading) {
  if (config_.odometer.model != OdometerModel::terrain || !on_ground()) return;
  const LaserCalibration& lasers = *calibration_.lasers;
  const Motion motion = motion_at(reading.t_ns);
  if (!ground_known_ && !restart_ground(reading, motion.R_WB)) return;
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
  const double axle_sigma = std::sqrt(2.0) * config_.odometer.unevenness / state_.odometer.track_width;
  auto h = H.row(count);
  h.setZero();
  h.segment<2>(ground_column(err::normal)) = axle.H_normal;
  if (axle.lean * axle.lean <= gate_(1) * (covariance_.variance(h, err::nu) + axle_sigma * axle_sigma)) {
    h /= axle_sigma;
    r(count++) = -axle.lean / axle_sigma;
    leaning_readings_ = 0;
  } else if (++leaning_readings_ > kPatience) {  // the axle stands on it: it is the plane that is wrong
    ground_known_ = false;
    leaning_readings_ = 0;
    return;
  }
  if (count > 0) update(H.topRows(count), err::nu, r.head(count));
}

/// Where nothing is known of the ground, the plane through the hits is where the linearization starts. The wheels stand
/// on it: a plane that is elsewhere is none, one of the beams hit something else. False: with this reading nothing can
/// be begun. If it does not get better, the ground is taken for level, and the gates have to find out.
bool Filter::restart_ground(const BeamRanges& reading, const Eigen::Matrix3d& R_WB) {
  const OdometerState& o = state_.odometer;
  const Eigen::Vector3d range(reading.range[0], reading.range[1], reading.range[2]);
  const std::optional<GroundPlane> plane = plane_through_hits(calibration_.lasers->beams, range, o.T_BO.p);
  if (!plane) return true;
  const bool carries = std::abs(plane->height - o.wheel_radius.mean()) < kLevelOff &&
                       std::abs(plane->n_B.dot(o.T_BO.R.col(1))) < kLeanOff;
  if (!carries && ++misplaced_grounds_ < kPatience) return false;
  misplaced_grounds_ = 0;
  state_.ground.n_W = carries ? Eigen::Vector3d((R_WB * plane->n_B).normalized()) : Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d sigma = Eigen::Vector2d::Constant(config_.odometer.normal_prior);
  covariance_.restart(err::normal, sigma);
  ground_known_ = true;
  return true;
}

}  // namespace ear
