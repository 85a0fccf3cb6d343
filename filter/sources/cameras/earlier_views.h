// What one camera has in place of a second one: itself, where it was at an earlier clone. Two such views show depths in
// units of the way between them, as far as that is known. docs/filter.md, "Gaps and jumps".
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ear/types.h"
#include "filter/ekf/covariance.h"
#include "filter/ekf/state.h"

namespace ear {

class EarlierViews {
 public:
  /// Takes the memory for the views of so many clones.
  explicit EarlierViews(std::size_t clones);

  /// What was seen from the newest clone, by the number of its frame. Ids within a frame are distinct.
  void add(std::uint64_t frame, const std::vector<FeatureObservation>& features);
  void forget(std::uint64_t frame);
  void clear();

  /// The newest clone's view with the earlier one that is best to see a motion of `distance` [m] by: as two cameras
  /// that see at once, the second one at the earlier clone. False if no earlier view has enough features of it.
  bool find(const State& x, const Covariance& P, double distance);
  /// What find() found. Features of the newest view, and as right observations where the earlier one saw them.
  [[nodiscard]] const FeatureFrame& features() const { return features_; }
  [[nodiscard]] const CameraState& cameras() const { return cameras_; }
  /// Variance of all lengths that they show, relative: that of the way between both.
  [[nodiscard]] double scale_variance() const { return scale_variance_; }

 private:
  struct Seen {
    std::uint64_t id = 0;
    Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< normalized
  };
  struct View {
    std::uint64_t frame = 0;  ///< Clone::frame
    std::vector<Seen> seen;   ///< by id
  };

  [[nodiscard]] const View* view_of(const Clone& clone) const;

  std::vector<View> views_;  ///< the first size_ are in use
  std::size_t size_ = 0;
  FeatureFrame features_;
  CameraState cameras_;
  double scale_variance_ = 0.0;
};

}  // namespace ear
