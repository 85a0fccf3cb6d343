// An estimator that remembers the features it was given, for the view, and else is the one it wraps.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "src/odometry_factory.h"
#include "src/view/moment.h"

namespace ear::view {

/// The features of the last frame, with their ages. Used on the estimator's thread alone.
class FeatureTap {
 public:
  void take(const FeatureFrame& frame);
  [[nodiscard]] const std::vector<SeenFeature>& features() const { return features_; }

 private:
  std::vector<SeenFeature> features_;  ///< in the order of their ids
  std::vector<SeenFeature> before_;
};

/// Makes what `make` makes, with `tap` before it. Estimates are the same, bit for bit.
[[nodiscard]] MakeEstimator tapped(MakeEstimator make, std::shared_ptr<FeatureTap> tap);

}  // namespace ear::view
