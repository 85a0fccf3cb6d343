#include "filter/sources/cameras/image_noise.h"

#include <cmath>

#include "filter/ekf/noise_score.h"
#include "filter/ekf/so3.h"
#include "filter/ingest/capacity.h"
#include "filter/ingest/evidence.h"
#include "filter/ingest/median.h"

namespace ear {
namespace {

constexpr double kSigmasPerMedian = 1.4826;  // standard deviation over median absolute deviation of a normal variable

}  // namespace

ImageNoise::ImageNoise() { distances_.reserve(kFeatureCapacity); }

double ImageNoise::measure(const FeatureFrame& frame, const CameraState& cameras) {
  const Eigen::Matrix3d R_C1C0 = cameras.T_C0C1.R.transpose();
  const Eigen::Matrix3d E = skew(-(R_C1C0 * cameras.T_C0C1.p)) * R_C1C0;  // right^T E left = 0
  distances_.clear();
  for (const FeatureObservation& feature : frame.features) {
    if (!feature.has_right) continue;
    const Eigen::Vector3d left = feature.left.homogeneous();
    const Eigen::Vector3d right = feature.right.homogeneous();
    const Eigen::Vector3d line = E * left;
    const double gradient = line.head<2>().squaredNorm() + (E.transpose() * right).head<2>().squaredNorm();
    if (gradient > 0.0) distances_.push_back(right.dot(line) / std::sqrt(gradient));  // to first order, Sampson's
  }
  if (distances_.size() < kToKnow) return 0.0;
  const double common = upper_median(distances_);
  for (double& distance : distances_) distance = std::abs(distance - common);
  return kSigmasPerMedian * upper_median(distances_);
}

}  // namespace ear
