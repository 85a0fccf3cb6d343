// The terms of (1) but the prior, as factors around the present values: what ties the frames to each other, and the
// features that they see.
#pragma once

#include <ceres/loss_function.h>

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "ear/filter_config.h"
#include "filter/ekf/gate.h"
#include "filter/sources/cameras/tracks.h"
#include "filter/sources/cameras/triangulation.h"
#include "smoother/blocks.h"
#include "smoother/factor.h"
#include "smoother/unknowns.h"

namespace ear::smoother {

/// All observations of a feature, as factors.
struct PointTerm {
  std::uint64_t id = 0;
  PointBlock* block = nullptr;
  std::vector<Factor> factors;
};

class Terms {
 public:
  Terms(const FilterConfig& config, double focal_px);

  /// All, anew. The number of features whose place cannot be found.
  int collect(Unknowns& unknowns, const TrackTable& tracks);
  /// And those features that were too many to be unknowns, and lose their oldest frame, this one, now: with what they
  /// show where they lie by the present poses.
  void collect_seen_from(Unknowns& unknowns, const TrackTable& tracks, std::uint64_t frame);
  /// Features that do not fit are used no more. Their number.
  int drop_outliers(TrackTable& tracks);
  /// Frames have gone: nothing is collected.
  void clear();
  /// Of features that no frame sees any more, not even the place is kept.
  void forget_points_without(const TrackTable& tracks);

  [[nodiscard]] const std::vector<Factor>& between() const { return between_; }  ///< two frames
  [[nodiscard]] const std::vector<PointTerm>& points() const { return point_terms_; }

 private:
  /// A feature as an unknown.
  struct Point {
    InverseDepthPoint anchor;
    PointBlock block{};
  };

  void collect_between(Unknowns& unknowns);
  [[nodiscard]] bool add_point(Unknowns& unknowns, const Track& track);
  [[nodiscard]] bool fits(const PointTerm& term) const;

  StandstillConfig standstill_;
  double sigma_;  ///< of an observation, normalized
  Gate gate_;
  ceres::HuberLoss huber_;
  std::unordered_map<std::uint64_t, Point> points_;
  std::vector<Factor> between_;
  std::vector<PointTerm> point_terms_;
};

}  // namespace ear::smoother
