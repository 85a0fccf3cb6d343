// What an evaluation compares: timed poses of the body in a world, and an estimate with what it says about itself.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "ear/types.h"

namespace ear::evaluation {

/// Pose of the body at one instant: p_W = q_WB * p_B + p_WB.
struct Pose {
  TimeNs t_ns = 0;
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();  ///< [m]
};

/// Poses with strictly increasing times.
using Trajectory = std::vector<Pose>;

/// What an estimate is compared with.
struct Truth {
  Trajectory poses;
  bool has_attitude = true;  ///< false: positions alone, as by radio; the attitudes of `poses` say nothing
  double error = 0.1;        ///< errors of the position up to this may be the truth's own, or its stamps' [m]
};

/// 6 x 6 covariance of (position, rotation): p_true - p_est [m] and e [rad] of R_true = Exp(e) R_est, both in the axes
/// of the estimate's world.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

/// The ground below the vehicle: uphill along the heading, and to the left of it, is positive [rad].
struct Slope {
  double along = 0.0;
  double across = 0.0;
};

/// What a simulation knows of the ground at one instant; the slope also while the vehicle flies.
struct TerrainTruth {
  TimeNs t_ns = 0;
  bool on_ground = true;
  Slope slope;
};

/// What an estimate says of it.
struct TerrainEstimate {
  bool on_ground = false;
  std::optional<Slope> slope;  ///< nothing where it knows none, as in the air
  Slope sigma;                 ///< standard deviations of the slope
};

/// Weight of each of the sensors that measure motion: 1 full, 0 it measured nothing.
struct SensorWeights {
  double imu = 1.0;
  double odometer = 1.0;
  double camera = 1.0;
};

/// One estimated trajectory. All vectors but the poses are empty, or have one entry per pose.
struct Estimate {
  std::string name;
  Trajectory poses;
  std::vector<PoseCovariance> covariance;
  std::vector<TerrainEstimate> terrain;
  std::vector<std::string> mode;       ///< what the estimator says it does, as written in its file
  std::vector<std::string> health;     ///< how well it says it does it
  std::vector<std::string> anomalous;  ///< which sensor it takes for the one at fault; "" for none
  std::vector<SensorWeights> weights;
};

}  // namespace ear::evaluation
