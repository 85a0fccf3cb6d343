// One estimate against the truth: all figures, and what a plot needs. Definitions: docs/evaluation.md.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tools/evaluation/alignment.h"
#include "tools/evaluation/association.h"
#include "tools/evaluation/false_tracking.h"
#include "tools/evaluation/terrain.h"
#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

/// 2.5 % and 97.5 % quantiles of chi-squared with 3 degrees of freedom: where a consistent NEES is 95 % of the time.
inline constexpr double kNeesLow = 0.21579528262389788;
inline constexpr double kNeesHigh = 9.348403604496148;

/// Drift over all stretches of one length, as KITTI does it.
struct RelativeError {
  double distance = 0.0;      ///< [m] along the truth
  std::size_t stretches = 0;  ///< how many, overlapping; at least one
  double translation = 0.0;   ///< mean error per metre travelled [1]
  double rotation = 0.0;      ///< mean error per metre travelled [rad/m]
};

struct StartToEnd {
  double error = 0.0;       ///< distance of the last estimate from the last truth, the first poses aligned [m]
  double estimated = 0.0;   ///< distance from the first to the last estimated position [m]
  double truth = 0.0;       ///< the same of the truth [m]
  double difference = 0.0;  ///< | estimated - truth | [m]
};

/// Normalized estimation error squared of 3 degrees of freedom, over all frames that have one.
struct Consistency {
  double mean = 0.0;    ///< 3 is consistent, more is overconfident
  double inside = 0.0;  ///< share of frames between kNeesLow and kNeesHigh
};

struct Nees {
  std::size_t frames = 0;   ///< that have a NEES
  std::size_t skipped = 0;  ///< whose covariance is not positive definite
  Consistency position;
  Consistency orientation;
};

/// One estimated pose beside the truth. Errors are true minus estimated, after the first poses were aligned, in the
/// axes of the estimate's world.
struct Frame {
  Match match;
  double distance = 0.0;                                     ///< travelled since the truth's first pose [m]
  Pose aligned;                                              ///< the estimate in the truth's world
  Eigen::Vector3d position_error = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d rotation_error = Eigen::Vector3d::Zero();  ///< e of R_true = Exp(e) R_est [rad]; NaN: not known
  std::optional<double> nees_position, nees_orientation;     ///< where the estimate has a usable covariance
};

struct Evaluation {
  std::string name;
  AlignmentKind kind = AlignmentKind::yaw;
  bool truth_has_attitude = true;       ///< without: no rotation error, no RPE, no NEES of the orientation
  bool rotation_from_attitude = false;  ///< see Alignment
  std::size_t poses = 0, matched = 0, outside = 0, in_gaps = 0;
  double duration = 0.0;                 ///< from the first to the last matched pose [s]
  double coverage = 0.0;                 ///< see coverage()
  double length = 0.0;                   ///< of the truth over that time [m]
  double position_rmse = 0.0;            ///< ATE [m]
  std::optional<double> position_ratio;  ///< ATE over length; nothing where the vehicle hardly moved
  double position_max = 0.0;             ///< [m]
  double z_rmse = 0.0;                   ///< [m]
  double rotation_rmse = 0.0;            ///< [rad]
  std::vector<RelativeError> relative;   ///< 1, 5, 10 and 20 m, as far as the length allows
  StartToEnd start_to_end;
  std::optional<Nees> nees;                     ///< where the estimate has covariances
  std::optional<FalseTracking> false_tracking;  ///< where the estimate has a health
  std::optional<TerrainFigures> terrain;        ///< where the truth knows the ground
  std::vector<Frame> frames;
};

/// Distance travelled along the truth since its first pose, at each pose of `at` (poses of the truth or between them,
/// in time order) [m]. Counted in steps of at least `shortest` [m], so that neither the truth's noise nor its rate add
/// to it.
[[nodiscard]] std::vector<double> distance_travelled(const Trajectory& truth, const Trajectory& at,
                                                     double shortest = 0.1);

/// Throws std::runtime_error if fewer than two estimated poses have a truth.
/// `terrain` is what the truth knows of the ground, in time order; it may be empty.
[[nodiscard]] Evaluation evaluate(const Estimate& estimate, const Truth& truth, AlignmentKind kind,
                                  const std::vector<TerrainTruth>& terrain = {});

/// The same with a truth whose errors are not known.
[[nodiscard]] Evaluation evaluate(const Estimate& estimate, const Trajectory& truth, AlignmentKind kind,
                                  const std::vector<TerrainTruth>& terrain = {});

}  // namespace ear::evaluation
