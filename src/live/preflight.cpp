#include "src/live/preflight.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/live/formatted.h"

namespace ear::live {
namespace {

constexpr double kGravity = 9.81;            // [m/s^2]
constexpr double kGravityTolerance = 0.5;    // [m/s^2] of a mean at rest
constexpr double kWindow = 0.5;              // [s] of a rest
constexpr double kRestGyro = 0.15;           // [rad/s] RMS: held in the hand, not laid down
constexpr double kRestAccel = 0.6;           // [m/s^2] standard deviation
constexpr double kRestSpeed = 0.08;          // [m/s]
constexpr double kLargestBias = 0.1;         // [rad/s]
constexpr double kUpright = 0.5;             // [rad] between the calibration's up and that of gravity
constexpr double kLift = 0.15, kPush = 0.3;  // [m]
constexpr double kTurn = 0.7, kRoll = 0.17;  // [rad]
constexpr double kStraight = 0.35;           // [rad] of a push
constexpr double kDegree = M_PI / 180.0;
constexpr double kTolerance = 0.15;     // of a scale, by hand
constexpr double kLargestDelay = 0.01;  // [s] of the camera, against the calibration

const char *const kStand = "stand", *const kLiftName = "lift", *const kPushName = "push", *const kTurnName = "turn",
                  *const kRollName = "roll", *const kDelay = "delay";

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

bool about_one(double ratio) { return std::abs(ratio - 1.0) < kTolerance; }

Eigen::Matrix3d turned(const Eigen::Vector3d& angle) {
  if (angle.norm() < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle.norm(), angle.normalized()).toRotationMatrix();
}

}  // namespace

Preflight::Preflight(const Calibration& calibration) : calibration_(calibration) {
  const auto want = [this](const char* name, const char* words) {
    items_.push_back({PreflightItem::Result::missing, name, words});
  };
  want(kStand, "let it stand level for two seconds");
  if (calibration.lasers && !calibration.cameras.empty()) want(kLiftName, "lift it by 20 cm, level, and hold it still");
  if (calibration.encoder && !calibration.cameras.empty())
    want(kPushName, "push it straight ahead by half a metre, and stop");
  if (calibration.encoder) want(kTurnName, "turn it to the left on its wheels by a quarter, and stop");
  want(kRollName, "roll it to one side by 20 degrees, and hold it still");
  if (!calibration.cameras.empty()) want(kDelay, "turn it to and fro before the cameras for ten seconds");
  changed_.assign(items_.size(), false);
  now_.range.fill(std::numeric_limits<double>::quiet_NaN());
}

void Preflight::add(const ImuSample& sample) {
  const std::lock_guard lock(mutex_);
  const double dt = last_ns_ ? seconds_between(*last_ns_, sample.t_ns) : 0.0;
  last_ns_ = sample.t_ns;
  if (dt <= 0.0 || dt > kWindow) {
    window_ = {};
    return;
  }
  const Eigen::Vector3d rate = sample.gyro_B - (rest_ ? rest_->gyro_B : Eigen::Vector3d::Zero());
  R_rest_ = R_rest_ * turned(dt * rate);
  if (window_.samples == 0) window_.begin_ns = sample.t_ns;
  ++window_.samples;
  window_.accel += sample.accel_B;
  window_.gyro += sample.gyro_B;
  window_.accel_squares += sample.accel_B.squaredNorm();
  window_.gyro_squares += sample.gyro_B.squaredNorm();
  if (seconds_between(window_.begin_ns, sample.t_ns) >= kWindow) close_window();
}

void Preflight::close_window() {
  const double n = window_.samples;
  Rest rest = now_;
  rest.accel_B = window_.accel / n;
  rest.gyro_B = window_.gyro / n;
  const double accel_variance = window_.accel_squares / n - rest.accel_B.squaredNorm();
  const bool still = window_.gyro_squares / n < kRestGyro * kRestGyro && accel_variance < kRestAccel * kRestAccel;
  window_ = {};
  const bool glides = rest.state && rest.state->v_W.norm() > kRestSpeed;  // which neither of the two feels
  if (!still || glides) return;
  judge_rest(rest);
  if (rest_) judge(*rest_, rest);
  R_rest_ = Eigen::Matrix3d::Identity();
  rest_ = rest;
}

void Preflight::add(const EncoderSample& sample) {
  const std::lock_guard lock(mutex_);
  const EncoderCalibration& encoder = *calibration_.encoder;
  if (!first_count_) first_count_ = sample;
  const auto rolled = [&](std::int64_t from, std::int64_t to, double radius) {
    std::int64_t counts = to - from;
    if (encoder.wraps) {  // the shorter turn
      counts %= encoder.resolution;
      if (2 * counts > encoder.resolution) counts -= encoder.resolution;
      if (2 * counts < -encoder.resolution) counts += encoder.resolution;
    }
    return 2.0 * M_PI * radius * static_cast<double>(counts) / static_cast<double>(encoder.resolution);
  };
  now_.wheel[0] += rolled(first_count_->left_count, sample.left_count, encoder.wheel_radius[0]);
  now_.wheel[1] += rolled(first_count_->right_count, sample.right_count, encoder.wheel_radius[1]);
  first_count_ = sample;
}

void Preflight::add(const QueuedOdometry::Ranges& ranges) {
  const std::lock_guard lock(mutex_);
  now_.range = ranges.range;
}

void Preflight::add(const LiveFrame& frame, const Calibration& learned) {
  const std::lock_guard lock(mutex_);
  now_.state = frame.estimate ? std::optional(frame.estimate->state) : std::nullopt;
  if (!frame.estimate || calibration_.cameras.empty()) return;
  const double shown = learned.camera_time_offset - calibration_.camera_time_offset;
  if (seconds_between(frame.health.since_ns, frame.t_ns) < 10.0) return;
  set(kDelay, std::abs(shown) < kLargestDelay,
      formatted("the images are %.1f ms %s than the calibration says", 1e3 * std::abs(shown),
                shown < 0 ? "older" : "younger"));
}

void Preflight::judge_rest(const Rest& rest) {
  if (rest_) return;
  const double norm = rest.accel_B.norm();
  const Eigen::Vector3d up_B =
      calibration_.encoder ? Eigen::Vector3d(calibration_.encoder->T_BO.linear().col(2)) : rest.accel_B;
  const double tilt = angle_between(up_B, rest.accel_B);
  const bool is_gravity = std::abs(norm - kGravity) < kGravityTolerance;
  std::string words = formatted("%.2f m/s^2, %.4f rad/s, up is %.0f degrees from where the calibration has it", norm,
                                rest.gyro_B.norm(), tilt / kDegree);
  if (!is_gravity) words += ": this is not gravity: another unit, or a broken sensor";
  if (tilt > kUpright) words += ": the IMU's axes are not those of the calibration";
  set(kStand, is_gravity && tilt < kUpright && rest.gyro_B.norm() < kLargestBias, words);
}

void Preflight::judge(const Rest& from, const Rest& to) {
  judge_roll(from, to);
  if (calibration_.encoder) judge_turn(from, to);
  if (!from.state || !to.state) return;
  if (calibration_.lasers) judge_lift(from, to);
  if (calibration_.encoder) judge_push(from, to);
}

void Preflight::judge_lift(const Rest& from, const Rest& to) {
  const double height = to.state->p_WB.z() - from.state->p_WB.z();
  if (std::abs(height) < kLift) return;
  std::string words = formatted("by %.2f m, says the camera;", height);
  bool right = true;
  for (std::size_t i = 0; i < calibration_.lasers->beams.size(); ++i) {
    const Eigen::Vector3d d_W = to.state->q_WB * calibration_.lasers->beams[i].d_B;
    const double longer = (to.range[i] - from.range[i]) * -d_W.z();
    words += formatted(" beam %zu %.2f m", i, longer);
    right = right && about_one(longer / height);
  }
  if (!right) words += ": order, sign or scale of the beams, or the scale of the cameras, is wrong";
  set(kLiftName, right, words);
}

void Preflight::judge_push(const Rest& from, const Rest& to) {
  const Eigen::Isometry3d& T_BO = calibration_.encoder->T_BO;
  const Eigen::Matrix3d R_from = from.state->q_WB.toRotationMatrix(), R_to = to.state->q_WB.toRotationMatrix();
  const Eigen::Vector3d path =
      (to.state->p_WB + R_to * T_BO.translation()) - (from.state->p_WB + R_from * T_BO.translation());
  const Eigen::Vector3d path_O = T_BO.linear().transpose() * R_from.transpose() * path;
  if (std::abs(path_O.x()) < kPush || Eigen::AngleAxisd(R_rest_).angle() > kStraight) return;
  const double left = (to.wheel[0] - from.wheel[0]) / path_O.x(), right = (to.wheel[1] - from.wheel[1]) / path_O.x();
  std::string words =
      formatted("by %.2f m ahead, say the cameras; wheels %.2f and %.2f times that", path_O.x(), left, right);
  const bool good = about_one(left) && about_one(right);
  if (left < 0.0 || right < 0.0)
    words += ": a wheel counts backward, or `forward` is wrong";
  else if (!good)
    words += ": radius, counts per turn or the cameras' scale is wrong";
  set(kPushName, good, words);
}

void Preflight::judge_turn(const Rest& from, const Rest& to) {
  const Eigen::AngleAxisd rotation(R_rest_);
  const double turn = rotation.angle() * rotation.axis().dot(calibration_.encoder->T_BO.linear().col(2));
  const double left = to.wheel[0] - from.wheel[0], right = to.wheel[1] - from.wheel[1];
  if (std::abs(turn) < kTurn || std::abs(left) + std::abs(right) < 0.05) return;
  const double ratio = (right - left) / calibration_.encoder->track_width / turn;
  std::string words =
      formatted("by %.0f degrees to the left, says the gyroscope; the wheels %.2f times that", turn / kDegree, ratio);
  if (ratio < 0.0)
    words += ": left and right are swapped, or the gyroscope's sign is wrong";
  else if (!about_one(ratio))
    words += ": track width, radius or the gyroscope's scale is wrong";
  set(kTurnName, about_one(ratio), words);
}

void Preflight::judge_roll(const Rest& from, const Rest& to) {
  const double tilt = angle_between(from.accel_B, to.accel_B);
  if (tilt < kRoll) return;
  const double error = angle_between(R_rest_.transpose() * from.accel_B, to.accel_B);
  const bool right = error < 2.0 * kTolerance * tilt;
  set(kRollName, right,
      formatted("by %.0f degrees, says gravity; the gyroscope is %.0f degrees off%s", tilt / kDegree, error / kDegree,
                right ? "" : ": an axis or the scale of one of the two is wrong"));
}

void Preflight::set(const std::string& name, bool right, const std::string& words) {
  for (std::size_t i = 0; i < items_.size(); ++i) {
    PreflightItem& item = items_[i];
    if (item.name != name) continue;
    const auto result = right ? PreflightItem::Result::right : PreflightItem::Result::wrong;
    if (item.result != result) changed_[i] = true;
    item.result = result;
    item.words = words;
  }
}

std::vector<PreflightItem> Preflight::items() const {
  const std::lock_guard lock(mutex_);
  return items_;
}

std::vector<PreflightItem> Preflight::news() {
  const std::lock_guard lock(mutex_);
  std::vector<PreflightItem> changed;
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (changed_[i]) changed.push_back(items_[i]);
    changed_[i] = false;
  }
  return changed;
}

}  // namespace ear::live
