// Did the bias of the accelerometer jump? What two stereo frames show of the velocity, less what the samples have added
// to it, stays the same while the bias is what the state says; else it grows, though a vehicle that hovers sees the
// same features all the time, and hardly a track ends and corrects anything. docs/filter.md, "Gaps and jumps".
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/types.h"
#include "filter/ekf/covariance.h"
#include "filter/ekf/state.h"

namespace ear {

class AccelExcess {
 public:
  /// From the state to a frame. Vectors are in W.
  struct Frame {
    TimeNs t_ns = 0;
    double duration = 0.0;                                      ///< [s], more than 0
    Eigen::Vector3d v_W = Eigen::Vector3d::Zero();              ///< the state's [m/s]
    Eigen::Vector3d gained_W = Eigen::Vector3d::Zero();         ///< velocity by the samples [m/s]
    Eigen::Vector3d gained_variance = Eigen::Vector3d::Zero();  ///< of that, by noise
    Eigen::Vector3d beyond_W = Eigen::Vector3d::Zero();         ///< by how much faster the images show it to be [m/s]
    Eigen::Vector3d beyond_variance = Eigen::Vector3d::Ones();  ///< by noise, which no other frame shares
  };

  /// `P`: of the state's error.
  void add(const Frame& frame, const Covariance& P);
  /// How fast the velocity seems to grow beyond the samples [m/s^2], each axis of W, and the variance of that if
  /// nothing jumped; nothing as long as too little was seen.
  struct Growth {
    Eigen::Array3d value, variance;
  };
  [[nodiscard]] std::optional<Growth> growth(const Covariance& P) const;

  /// By how much the samples seem to be off [m/s^2], along the axis of W where it is least likely; 0 where bias, tilt
  /// and what the errors of the cameras' calibration make look like an acceleration may explain it, or too little was
  /// seen. What was found is forgotten.
  double take(const Covariance& P);

 private:
  /// Of a line through the last moments: sums of 1, t and t^2, where t counts back from now [s]; the same of the
  /// values and of their variances.
  struct Sums {
    Eigen::Vector3d ones = Eigen::Vector3d::Zero(), times = ones, squares = ones;

    /// All becomes older.
    void age(double dt, double kept);
  };

  Sums weights_, values_, variances_, gains_;
  Eigen::Vector3d corrected_W_ = Eigen::Vector3d::Zero();  ///< velocity, by updates since the line begins [m/s]
  double apparent_ = 0.0;  ///< sum of the variances by the cameras' calibration [m^2/s^4]
  double span_ = 0.0;      ///< [s] of the line
  Frame last_;
};

}  // namespace ear
