// How well an estimate knows the ground it drives on. Definitions: docs/evaluation.md, "Ground".
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

/// One estimated pose and the ground there.
struct TerrainComparison {
  TerrainTruth truth;
  std::optional<TerrainEstimate> estimate;  ///< where the estimate says something about the ground
  double z_error = 0.0;                     ///< true minus estimated height of the body, aligned [m]
};

/// Error of one angle of the slope, over the poses on the ground that have one.
struct SlopeError {
  std::size_t poses = 0;
  double rmse = 0.0;    ///< [rad]
  double inside = 0.0;  ///< share of the poses whose error is within three standard deviations
};

struct TerrainFigures {
  std::size_t ground_poses = 0;  ///< poses at which the truth is on the ground
  std::optional<double> z_rmse;  ///< of these [m]
  std::optional<double>
      mode_agreement;  ///< share of all poses at which estimate and truth agree on being on the ground
  std::optional<SlopeError> along, across;
};

/// The truth at a time that it covers: slope linear between its samples, mode that of the sample at or before.
/// `terrain` is in time order.
[[nodiscard]] std::optional<TerrainTruth> terrain_at(const std::vector<TerrainTruth>& terrain, TimeNs t_ns);

[[nodiscard]] TerrainFigures terrain_figures(const std::vector<TerrainComparison>& comparisons);

}  // namespace ear::evaluation
