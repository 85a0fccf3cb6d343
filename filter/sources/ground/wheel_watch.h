// How far the wheels rolled, and whether the ground drives them.
#pragma once

#include <array>

#include "ear/calibration.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

class WheelWatch {
 public:
  explicit WheelWatch(const EncoderCalibration& axle) : axle_(axle) {}

  /// The body turned about the axle by `angle` [rad], nose-down positive. The encoders count that too.
  void turn_body(double angle) { body_angle_ += angle; }

  struct Motion {
    double dt = 0.0;        ///< [s]
    double distance = 0.0;  ///< that the faster wheel rolled in it, backwards too [m]
    /// A wheel turns faster than a moment ago, against the body and against the world. A free wheel never does: its
    /// bearing takes it along with the body, its inertia holds it.
    bool driven = false;
  };
  /// Increments in time order.
  Motion add(const WheelIncrement& turn);

 private:
  struct Wheel {
    double rate = 0.0;  ///< against the body, as it was a moment ago [rad/s]
    double spin = 0.0;  ///< the same against the world
  };

  EncoderCalibration axle_;
  double body_angle_ = 0.0;  ///< since the last increment
  std::array<Wheel, 2> wheels_;
};

}  // namespace ear
