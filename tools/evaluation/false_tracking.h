// Does the health say "tracking" while the position is far off? A judge that knows only truth and covariance.
// Definitions: docs/evaluation.md, "False tracking".
#pragma once

#include <vector>

#include "tools/evaluation/association.h"
#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

/// The estimate's world E in the truth's world T, by the start alone.
struct StartAlignment {
  Eigen::Isometry3d T_TE = Eigen::Isometry3d::Identity();
  Eigen::Vector3d p_E = Eigen::Vector3d::Zero();  ///< the start, about which a wrong yaw would turn [m]
  double sigma_yaw = 0.0;                         ///< how far the attitudes scatter about that yaw [rad]
};

/// Position and yaw from the first two seconds of the matched poses. An alignment of all poses would share an error
/// out over the whole path, so that the start looks wrong and the end right, and one pose has the truth's noise at that
/// instant. The yaw is that of the attitudes; where the truth has none, that of the positions of the whole path, which
/// hides a part of a yaw that drifts. `association` is not empty.
[[nodiscard]] StartAlignment align_start(const Estimate& estimate, const Truth& truth, const Association& association);

/// A position error beyond its limit for a second or longer, without a gap.
struct FarOff {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  double tracking = 0.0;       ///< time in it in which the health says "tracking" [s]
  double largest_error = 0.0;  ///< [m]
  double travelled = 0.0;      ///< from the start to there [m]
  double most_sigmas = 0.0;    ///< largest error in standard deviations; 0: the estimate has no covariance
};

struct FalseTracking {
  double share = 0.0;    ///< of the truth's time: far off, and the health says "tracking"; in [0, 1]
  double far_off = 0.0;  ///< of the truth's time: far off, whatever the health says; in [0, 1]
  std::vector<FarOff> stretches;
};

/// `estimate` has a health; `association` is not empty. `distances`: along the truth, at each match [m].
[[nodiscard]] FalseTracking false_tracking(const Estimate& estimate, const Truth& truth, const Association& association,
                                           const std::vector<double>& distances);

}  // namespace ear::evaluation
