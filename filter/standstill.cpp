#include "filter/standstill.h"

#include <algorithm>
#include <limits>

namespace ear {
namespace {
constexpr std::size_t kMinCommonFeatures = 8;  // fewer do not tell motion from mismatches
}

bool StandstillDetector::update(const FeatureFrame& frame, const ImuStatistics& imu, const Eigen::Vector3d& gyro_bias,
                                double max_gyro) {
  const bool imu_quiet = imu.duration > 0.8 * config_.duration && imu.gyro_spread < config_.max_gyro_spread &&
                         imu.accel_spread < config_.max_accel_spread && (imu.gyro_mean - gyro_bias).norm() < max_gyro;
  if (!imu_quiet || since_ns_ == kMoving || median_flow_px(frame) > config_.max_flow_px) {
    restart(frame);
    return false;
  }
  return seconds_between(since_ns_, frame.t_ns) >= config_.duration;
}

void StandstillDetector::restart(const FeatureFrame& frame) {
  since_ns_ = frame.t_ns;
  reference_ = frame.features;
  std::sort(reference_.begin(), reference_.end(),
            [](const FeatureObservation& a, const FeatureObservation& b) { return a.id < b.id; });
}

double StandstillDetector::median_flow_px(const FeatureFrame& frame) {
  flow_.clear();
  for (const FeatureObservation& feature : frame.features) {
    const auto match = std::lower_bound(reference_.begin(), reference_.end(), feature.id,
                                        [](const FeatureObservation& o, std::uint64_t id) { return o.id < id; });
    if (match == reference_.end() || match->id != feature.id) continue;
    flow_.push_back(focal_px_ * (feature.left - match->left).norm());
  }
  if (flow_.size() < kMinCommonFeatures) return std::numeric_limits<double>::infinity();
  const auto middle = flow_.begin() + static_cast<std::ptrdiff_t>(flow_.size() / 2);
  std::nth_element(flow_.begin(), middle, flow_.end());
  return *middle;
}

}  // namespace ear
