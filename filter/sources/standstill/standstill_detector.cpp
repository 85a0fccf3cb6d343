#include "filter/sources/standstill/standstill_detector.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/capacity.h"
#include "filter/ingest/evidence.h"
#include "filter/ingest/median.h"
#include "filter/ingest/silence.h"

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

StandstillDetector::StandstillDetector(const StandstillConfig& config, double focal_px)
    : config_(config), focal_px_(focal_px) {
  reference_.reserve(kFeatureCapacity);
  renewed_.reserve(kFeatureCapacity);
  for (auto& component : flow_) component.reserve(kFeatureCapacity);
}

bool StandstillDetector::update(const FeatureFrame& frame, const ImuStatistics& imu, const Eigen::Vector3d& gyro_bias,
                                double max_gyro, std::optional<double> wheel_rest) {
  const bool imu_quiet = imu.gyro_spread < config_.max_gyro_spread && imu.accel_spread < config_.max_accel_spread &&
                         (imu.gyro_mean - gyro_bias).norm() < max_gyro;
  const double max_flow_px = standing_ ? config_.leave_flow_px : config_.max_flow_px;
  const std::optional<double> flow_px = common_flow_px(frame);
  const bool known = flow_px || wheel_rest;
  const bool moved = (flow_px && *flow_px > max_flow_px) || (wheel_rest && *wheel_rest < kNoRest);
  if (!imu_quiet || !since_ns_ || !known || moved) {
    restart(frame);
    return false;
  }
  const bool enough_imu = imu.duration > 0.8 * config_.duration;
  standing_ = enough_imu && seconds_between(*since_ns_, frame.t_ns) >= config_.duration;
  if (standing_ && !frame.features.empty()) renew_reference(frame);
  return standing_;
}

/// Features end also at rest. Those that are new take the place of the old ones, where they are seen now.
void StandstillDetector::renew_reference(const FeatureFrame& frame) {
  renewed_.clear();
  for (const FeatureObservation& feature : frame.features) {
    const FeatureObservation* const known = find_in_reference(feature.id);
    renewed_.push_back(known == nullptr ? feature : *known);
  }
  reference_.swap(renewed_);
  sort_reference();
}

const FeatureObservation* StandstillDetector::find_in_reference(std::uint64_t id) const {
  const auto match = std::lower_bound(reference_.begin(), reference_.end(), id,
                                      [](const FeatureObservation& o, std::uint64_t wanted) { return o.id < wanted; });
  return match == reference_.end() || match->id != id ? nullptr : &*match;
}

void StandstillDetector::sort_reference() {
  std::sort(reference_.begin(), reference_.end(),
            [](const FeatureObservation& a, const FeatureObservation& b) { return a.id < b.id; });
}

void StandstillDetector::restart(const FeatureFrame& frame) {
  standing_ = false;
  since_ns_ = frame.t_ns;
  reference_ = frame.features;
  sort_reference();
}

/// A shift, an expansion and a turn of the image each move the median of one component, which noise of single features
/// does not. The largest of the four medians; nothing if too few features are common.
std::optional<double> StandstillDetector::common_flow_px(const FeatureFrame& frame) {
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

}  // namespace ear
