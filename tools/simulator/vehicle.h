// The simulated vehicle's sensors: where they truly are, and where a slightly wrong calibration believes them.
#pragma once

#include "ear/calibration.h"
#include "tools/simulator/random.h"

namespace ear::simulator {

/// The true geometry and noise figures: D435i-class stereo camera and IMU, two 18-bit encoders, three lasers.
[[nodiscard]] Calibration make_vehicle(double camera_rate_hz, LensModel lens);

/// The same with the errors of a careful but real calibration: wheel radius 0.3 %, track width 0.3 %, odometer, beams
/// and cameras 0.2 degrees (the stereo pair within itself 0.02 degrees), camera-IMU time 1 ms. The sizes are fixed;
/// `rng` draws signs and axes.
[[nodiscard]] Calibration miscalibrate(Calibration calibration, Rng& rng);

}  // namespace ear::simulator
