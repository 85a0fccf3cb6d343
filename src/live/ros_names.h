// What `ear live` calls its topics and frames of ROS 2.
#pragma once

#include <string>

namespace ear::live {

struct RosNames {
  std::string odometry = "/ear/odometry";    ///< after each frame
  std::string predicted = "/ear/predicted";  ///< at the inertial samples' rate; empty: not published
  std::string path = "/ear/path";            ///< empty: not published
  std::string features;                      ///< the left image with its features; empty: not published
  std::string diagnostics = "/diagnostics";
  std::string odom_frame = "odom";  ///< the estimator's world: z up, origin and heading of the IMU's first pose
  std::string base_frame = "base_link";
  bool tf = true;         ///< odom_frame to base_frame, on /tf
  bool tf_static = true;  ///< base_frame to the sensors, on /tf_static, unless others say so there
};

}  // namespace ear::live
