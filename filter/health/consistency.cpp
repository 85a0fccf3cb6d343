#include "filter/health/consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace ear {
namespace {

/// Distances between the displacements, each named by the sensor that it does not concern.
using Distances = std::array<double, kMotionSensors>;

double distance_between(const Displacement& x, const Displacement& y, AnomalyScore score) {
  const Eigen::Vector3d difference = x.p_BiBj - y.p_BiBj;
  if (score == AnomalyScore::distance) return difference.norm();
  const Eigen::Matrix3d S = x.covariance + y.covariance;
  return std::sqrt(std::max(0.0, difference.dot(S.ldlt().solve(difference))));
}

/// Of so many displacements against one that is common to all.
constexpr int degrees_of_freedom(int count) { return 3 * (count - 1); }

/// (13) [m^2], over the displacements there are.
double variance_of(const Displacements& displacements, int count) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Displacement& d : displacements) {
    if (d.available) mean += d.p_BiBj / count;
  }
  double variance = 0.0;
  for (const Displacement& d : displacements) {
    if (d.available) variance += (d.p_BiBj - mean).squaredNorm() / count;
  }
  return variance;
}

/// The least sum of squared normalized distances from one common displacement.
double chi_squared_of(const Displacements& displacements) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  double squares = 0.0;
  for (const Displacement& d : displacements) {
    if (!d.available) continue;
    const Eigen::Matrix3d inverse = d.covariance.ldlt().solve(Eigen::Matrix3d::Identity());
    const Eigen::Vector3d product = inverse * d.p_BiBj;
    information += inverse;
    weighted += product;
    squares += d.p_BiBj.dot(product);
  }
  return std::max(0.0, squares - weighted.dot(information.ldlt().solve(weighted)));
}

/// (15), before it is limited. Design note: what is printed gives each sensor a formula of its own.
double weight_of(std::size_t sensor, const Distances& between_others, AnomalyWeight form) {
  if (form == AnomalyWeight::printed) {
    const double IO = between_others[index_of(MotionSensor::camera)];
    const double IC = between_others[index_of(MotionSensor::odometer)];
    const double OC = between_others[index_of(MotionSensor::imu)];
    if (sensor == index_of(MotionSensor::imu)) return 0.5 * (OC / IO + IC / IC);
    if (sensor == index_of(MotionSensor::odometer)) return 0.5 * (IC / IO + IO / OC);
    return 0.5 * (OC / IC + IO / IC);
  }
  const double others = between_others[sensor];
  const double to_first = between_others[(sensor + 1) % kMotionSensors];
  const double to_second = between_others[(sensor + 2) % kMotionSensors];
  return 0.5 * others * (1.0 / to_first + 1.0 / to_second);
}

}  // namespace

ConsistencyCheck::ConsistencyCheck(const AnomalyConfig& config)
    : config_(config), gate_(1.0 - config.false_alarm, degrees_of_freedom(kMotionSensors)) {}

Consistency ConsistencyCheck::operator()(const Displacements& displacements) const {
  Consistency result;
  int count = 0;
  for (std::size_t i = 0; i < kMotionSensors; ++i) {
    result.available[i] = displacements[i].available;
    result.weight[i] = result.available[i] ? 1.0 : 0.0;
    count += result.available[i] ? 1 : 0;
    if (displacements[i].contradictory) result.anomalous = static_cast<MotionSensor>(i);
  }
  if (count < 2) return result;

  Distances between_others{};
  for (std::size_t x = 0; x < kMotionSensors; ++x) {
    const std::size_t y = (x + 1) % kMotionSensors;
    if (!displacements[x].available || !displacements[y].available) continue;
    const double distance = distance_between(displacements[x], displacements[y], config_.score);
    between_others[kMotionSensors - x - y] = distance;
    result.coefficient[x] += distance;  // (14)
    result.coefficient[y] += distance;
  }
  result.variance = variance_of(displacements, count);
  if (config_.score == AnomalyScore::distance) {
    result.score = std::sqrt(result.variance);
    result.threshold = config_.distance;
  } else {
    result.score = std::sqrt(chi_squared_of(displacements));
    result.threshold = std::sqrt(gate_.quantile(degrees_of_freedom(count)));
  }
  if (count < static_cast<int>(kMotionSensors) || !result.disagree()) return result;

  const auto worst = static_cast<std::size_t>(std::max_element(result.coefficient.begin(), result.coefficient.end()) -
                                              result.coefficient.begin());
  result.anomalous = static_cast<MotionSensor>(worst);
  const double weight = weight_of(worst, between_others, config_.weight);
  result.weight[worst] = std::isfinite(weight) ? std::clamp(weight, config_.min_weight, 1.0) : config_.min_weight;
  return result;
}

Advice advise(const Consistency& consistency, const Health& health, const AnomalyConfig& config) {
  Advice advice;
  advice.cameras_sound = !health.faulty[index_of(Source::camera_left)];
  if (config.enabled && consistency.anomalous) {
    const std::size_t sensor = index_of(*consistency.anomalous);
    advice.weight[sensor] = std::max(consistency.weight[sensor], config.min_weight);
  }
  return advice;
}

}  // namespace ear
