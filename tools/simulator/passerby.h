// Somebody who crosses the view: an upright picture that moves, nearer than all else that is to be seen.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "tools/simulator/faults.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/texture.h"
#include "tools/simulator/trajectory.h"

namespace ear::simulator {

/// Keeps up with the vehicle and goes from its left to its right, and back, once per 5 s or so. Stands on the ground;
/// no lasers see it.
class Passerby {
 public:
  /// `trajectory` must outlive it; the distance is the fault's parameter, or less where there is less room.
  Passerby(const Fault& fault, const Trajectory& trajectory, const Scene& scene);

  [[nodiscard]] const Fault& fault() const { return fault_; }
  [[nodiscard]] double distance() const { return distance_; }
  /// Where it is.
  [[nodiscard]] Panel panel(double t) const;

 private:
  Fault fault_;
  const Trajectory& trajectory_;
  Terrain terrain_;
  double distance_;
};

/// Whether it is before a point, as seen from `eye_W`.
[[nodiscard]] bool hides(const Panel& passerby, const Eigen::Vector3d& eye_W, const Eigen::Vector3d& p_W);

/// What it looks like.
[[nodiscard]] Texture paint_passerby(const Passerby& passerby, std::uint64_t seed);

}  // namespace ear::simulator
