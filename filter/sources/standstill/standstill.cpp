#include "filter/sources/standstill/standstill.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/relative_motion.h"
#include "filter/ingest/limits.h"
#include "filter/ingest/median.h"

namespace ear {
namespace {

constexpr double kNoRest = 0.05;      // [s] chosen: wheels that turned so lately turn
constexpr double kWheelPlay = 0.005;  // [rad] chosen: that a wheel at rest may turn: 0.4 mm of its rim

}  // namespace

void WheelRest::add(const WheelIncrement& turn) {
  moved_ += turn.angle;
  if (!any_ || turn.from_ns != newest_ns_ || moved_.cwiseAbs().maxCoeff() > kWheelPlay) {
    since_ns_ = turn.to_ns;
    moved_.setZero();
  }
  any_ = true;
  newest_ns_ = turn.to_ns;
  interval_ = turn.duration();
}

std::optional<double> WheelRest::duration(TimeNs t_ns) const {
  if (!any_ || seconds_between(newest_ns_, t_ns) > longest_silence(interval_)) return std::nullopt;
  return seconds_between(since_ns_, newest_ns_);
}

Standstill::Standstill(const StandstillConfig& config, double focal_px, int window)
    : config_(config), focal_px_(focal_px), rows_(9, err::clone(window + 1)) {
  reference_.reserve(kFeatureCapacity);
  renewed_.reserve(kFeatureCapacity);
  for (auto& component : flow_) component.reserve(kFeatureCapacity);
}

bool Standstill::wheels_rest(TimeNs t_ns) const { return wheel_rest_.duration(t_ns).value_or(0.0) >= kNoRest; }

ImuStatistics Standstill::recent(const ImuBuffer& imu, TimeNs t_ns) const {
  return imu.statistics(t_ns - static_cast<TimeNs>(1e9 * config_.duration), t_ns);
}

void Standstill::update(const Evidence& evidence) {
  const FeatureFrame& frame = evidence.frame;
  const ImuStatistics& imu = evidence.recent;
  // Before the bias is known any rate may be bias, if it stays the same: wheels or images have to show the rest.
  const GyroBias bias = evidence.bias.value_or(GyroBias{imu.gyro_mean, 0.0});
  const double white = imu.count > 1 ? imu.gyro_density / std::sqrt(imu.duration) : 0.0;
  const bool imu_quiet = imu.gyro_spread < config_.max_gyro_spread && imu.accel_spread < config_.max_accel_spread &&
                         imu.gyro_error < std::hypot(config_.max_gyro / kClear, kClear * white) &&
                         (imu.gyro_mean - bias.mean).norm() < std::hypot(config_.max_gyro, kClear * bias.sigma);
  const double max_flow_px = stands_ ? config_.leave_flow_px : config_.max_flow_px;
  const std::optional<double> flow_px = common_flow_px(frame);
  const std::optional<double> wheel_rest = evidence.on_ground ? wheel_rest_.duration(evidence.t_ns) : std::nullopt;
  const bool known = flow_px || wheel_rest;
  const bool moved = (flow_px && *flow_px > max_flow_px) || (wheel_rest && *wheel_rest < kNoRest);
  if (!imu_quiet || !since_ns_ || !known || moved) {
    restart(frame);
    return;
  }
  const bool enough_imu = imu.duration > 0.8 * config_.duration;
  stands_ = enough_imu && seconds_between(*since_ns_, frame.t_ns) >= config_.duration;
  if (stands_ && !frame.features.empty()) renew_reference(frame);
}

/// Features end also at rest. Those that are new take the place of the old ones, where they are seen now.
void Standstill::renew_reference(const FeatureFrame& frame) {
  renewed_.clear();
  for (const FeatureObservation& feature : frame.features) {
    const FeatureObservation* const known = find_in_reference(feature.id);
    renewed_.push_back(known == nullptr ? feature : *known);
  }
  reference_.swap(renewed_);
  sort_reference();
}

const FeatureObservation* Standstill::find_in_reference(std::uint64_t id) const {
  const auto match = std::lower_bound(reference_.begin(), reference_.end(), id,
                                      [](const FeatureObservation& o, std::uint64_t wanted) { return o.id < wanted; });
  return match == reference_.end() || match->id != id ? nullptr : &*match;
}

void Standstill::sort_reference() {
  std::sort(reference_.begin(), reference_.end(),
            [](const FeatureObservation& a, const FeatureObservation& b) { return a.id < b.id; });
}

void Standstill::restart(const FeatureFrame& frame) {
  stands_ = false;
  since_ns_ = frame.t_ns;
  reference_ = frame.features;
  sort_reference();
}

/// A shift, an expansion and a turn of the image each move the median of one component, which noise of single features
/// does not. The largest of the four medians; nothing if too few features are common.
std::optional<double> Standstill::common_flow_px(const FeatureFrame& frame) {
  for (auto& component : flow_) component.clear();
  for (const FeatureObservation& feature : frame.features) {
    const FeatureObservation* const match = find_in_reference(feature.id);
    if (match == nullptr) continue;
    const Eigen::Vector2d flow = focal_px_ * (feature.left - match->left);
    const Eigen::Vector2d outward = match->left.stableNormalized();
    flow_[0].push_back(flow.x());
    flow_[1].push_back(flow.y());
    flow_[2].push_back(outward.dot(flow));
    flow_[3].push_back(outward.x() * flow.y() - outward.y() * flow.x());
  }
  if (flow_[0].size() < kFewFeatures) return std::nullopt;
  double largest = 0.0;
  for (auto& component : flow_) largest = std::max(largest, std::abs(upper_median(component)));
  return largest;
}

void Standstill::hold(Ekf& ekf) {
  const State& state = ekf.state();
  const Eigen::Vector3d& v_W = state.imu.v_W;
  auto H = rows_.topLeftCorner(9, state.error_size());
  Eigen::Matrix<double, 9, 1> r;
  linearize_relative_motion(state, Pose{}, H.topRows<6>(), r.head<6>());
  Eigen::Array<double, 6, 1> weight;
  weight << Eigen::Array3d::Constant(1.0 / config_.rotation_sigma),
      Eigen::Array3d::Constant(1.0 / config_.position_sigma);
  H.topRows<6>().array().colwise() *= weight;
  r.head<6>().array() *= weight;
  H.bottomRows<3>().setZero();
  // Of the velocity in the body: that in the world would show a heading by a velocity which rest is about to deny.
  H.block<3, 3>(6, err::nu) = Eigen::Matrix3d::Identity() / config_.velocity_sigma;
  r.tail<3>() = -v_W / config_.velocity_sigma;
  ekf.apply(H, 0, r, CameraUpdate::considered);
}

}  // namespace ear
