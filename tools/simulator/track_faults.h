// Camera faults on feature tracks: what a front end would have followed in the faulty pictures.
#pragma once

#include <cstdint>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "tools/simulator/camera_faults.h"
#include "tools/simulator/passerby.h"
#include "tools/simulator/track_generator.h"
#include "tools/simulator/trajectory.h"

namespace ear::simulator {

/// How the clean tracks came about, and what differs.
struct TrackFaults {
  const std::vector<Fault>& faults;
  const std::vector<CameraCalibration>& cameras;  ///< the true ones
  const Trajectory& clean_motion;                 ///< without hard landings
  const Trajectory& motion;
  const std::vector<Passerby>& passersby;
  const TrackOptions& options;
  std::uint64_t seed;
};

/// The tracks of the frames that arrive, stamped as they are. Points are followed on the same pixels as without faults
/// wherever they are to be seen:
/// - covered: none; too little or too much light: fewer, noisier
/// - people: those behind them are lost, others are on them and move with them
/// - frozen: the same positions again, with the left image's marked as repeated; swapped: left as right and right as
/// left, each through the other's lens A track that is interrupted, or is not seen anew for 0.25 s, goes on under a new
/// id, as a front end would have it.
[[nodiscard]] std::vector<FeatureFrame> fault_tracks(const Tracks& clean, const std::vector<Frame>& frames,
                                                     const TrackFaults& setting);

}  // namespace ear::simulator
