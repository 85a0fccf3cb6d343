// What the simulator's tests share.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "tools/simulator/simulation.h"

namespace ear::simulator {

/// A simulation whose sensors make no errors, without feature tracks.
inline Options ideal(const std::string& sequence, std::uint64_t seed) {
  Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.sensor_noise = false;
  options.tracks = false;
  return options;
}

inline Eigen::Isometry3d pose_WC(const Trajectory& trajectory, double t, const ear::CameraCalibration& camera) {
  const Kinematics motion = trajectory.at(t);
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  T_WB.linear() = motion.R_WB;
  T_WB.translation() = motion.p_WB;
  return T_WB * camera.T_BC;
}

}  // namespace ear::simulator
