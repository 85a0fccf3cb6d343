// Feature tracks without images: points on the surfaces of the scene, as an ideal front end would follow them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "tools/simulator/obstruction.h"
#include "tools/simulator/random.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/trajectory.h"

namespace ear::simulator {

struct TrackOptions {
  int max_features = 150;  ///< at one time
  double sigma_px = 0.5;   ///< of each coordinate, independent in both cameras
  double mean_life = 4.0;  ///< [s] until a track is lost by chance; it also ends at the border, behind and under things
};

/// Feature tracks, and the points that they follow.
struct Tracks {
  std::vector<FeatureFrame> frames;
  std::vector<Eigen::Vector3d> points_W;  ///< of the feature with id i at i - 1
};

/// One frame per stamp. Features are in the left picture, spread over it by a grid, and `has_right` if the right camera
/// sees them; pixel noise is added, then the lens is removed with `cameras`, which must be the true ones.
/// A feature keeps its id while it lives; no id is used twice.
[[nodiscard]] Tracks generate_tracks(const Scene& scene, const Trajectory& trajectory,
                                     const std::vector<CameraCalibration>& cameras, const std::vector<TimeNs>& stamps,
                                     const Obstruction& obstruction, const TrackOptions& options, Rng& rng);

}  // namespace ear::simulator
