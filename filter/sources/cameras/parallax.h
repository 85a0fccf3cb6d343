// How far features moved from one frame to another beyond what the rotation alone does: what makes keyframes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "filter/sources/cameras/tracks.h"

namespace ear {

/// A frame, and camera 0's rotation in it.
struct FrameRotation {
  std::uint64_t frame = 0;
  Eigen::Matrix3d R_WC0 = Eigen::Matrix3d::Identity();
};

/// Median over the common features, in normalized coordinates. Infinite where they are few: a frame that most of the
/// other's features never saw is no elder of theirs, however little the vehicle moved. `scratch` is used for the sum.
[[nodiscard]] double median_parallax(const TrackTable& tracks, const FrameRotation& from, const FrameRotation& to,
                                     std::vector<double>& scratch);

}  // namespace ear
