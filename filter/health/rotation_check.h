// How the cameras turn against the gyroscope, over the last moments.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/types.h"
#include "filter/sources/cameras/frame_agreement.h"

namespace ear {

class RotationCheck {
 public:
  /// A frame at `t_ns`, `interval` [s] after the one before. `wheels_rejected`: the wheels did not fit, and a velocity
  /// that they led astray looks like a turn as well.
  void add(const FrameAgreement& seen, double interval, bool wheels_rejected, TimeNs t_ns);

  /// Do the cameras turn otherwise than the gyroscope?
  [[nodiscard]] bool differs() const { return differs_; }

 private:
  Eigen::Vector3d rate_ = Eigen::Vector3d::Zero();  ///< of the cameras less that of the gyroscope [rad/s], recent
  double scatter_ = 1e-4;                           ///< [rad^2/s^2] of the single ones
  double apparent_ = 0.0;                           ///< [rad/s] by errors of the calibration, recent
  std::optional<TimeNs> misled_ns_;                 ///< when wheels last did not fit
  bool differs_ = false;
};

}  // namespace ear
