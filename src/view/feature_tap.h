// An estimator that remembers for the view what it was given and what it made of it, and else is the one it wraps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "src/odometry_factory.h"
#include "src/view/moment.h"

namespace ear::view {

/// The features of the last frame, with their ages and with what the estimator made of them, and the last ranges. Used
/// on the estimator's thread alone.
class FeatureTap {
 public:
  /// `outcomes`: of the tracks that the estimator tested with this frame; some of them ended before it.
  void take(const FeatureFrame& frame, const std::vector<TrackOutcome>& outcomes);
  void take(const LaserSample& sample) { ranges_ = sample.range; }

  /// Those of the frame in the order of their ids; behind them those that ended with it, where they were seen last.
  [[nodiscard]] const std::vector<SeenFeature>& features() const { return features_; }
  [[nodiscard]] const std::vector<double>& ranges() const { return ranges_; }  ///< [m]

 private:
  std::vector<SeenFeature> features_;
  std::size_t visible_ = 0;  ///< so many of them are in the frame
  std::vector<SeenFeature> before_;
  std::vector<double> ranges_;
};

/// Makes what `make` makes, with `tap` before it. Estimates are the same, bit for bit.
[[nodiscard]] MakeEstimator tapped(MakeEstimator make, std::shared_ptr<FeatureTap> tap);

}  // namespace ear::view
