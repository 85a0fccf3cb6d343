#include "filter/image_noise.h"

#include <algorithm>
#include <cmath>

#include "filter/capacity.h"
#include "filter/so3.h"

namespace ear {
namespace {

constexpr std::size_t kFewest = 20;          // stereo features
constexpr double kSigmasPerMedian = 1.4826;  // standard deviation over median absolute deviation of a normal variable

/// Changes the order of `values`, which must not be empty.
double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

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
  if (distances_.size() < kFewest) return 0.0;
  const double common = median(distances_);
  for (double& distance : distances_) distance = std::abs(distance - common);
  return kSigmasPerMedian * median(distances_);
}

}  // namespace ear
