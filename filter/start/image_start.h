// Where a filter may begin in a vehicle that moves and has cameras: velocity, gravity and biases that explain how the
// images move. Where there is one camera, nothing but the accelerometer shows a length. docs/filter.md, "Starts".
#pragma once

#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/health.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/start/start_fit.h"

namespace ear {

/// What the cameras saw at a time of the IMU's clock.
struct TimedFrame {
  TimeNs t_ns = 0;
  FeatureFrame features;
};

/// What is known of the sensors.
struct StartNoise {
  StartFit::Vector prior_sigma;  ///< start_sigma()
  ImuCalibration imu;
  double feature_sigma = 0.0;  ///< of one observation, normalized
};

/// A state at the first of the frames. Least squares (Gauss-Newton, Huber) over the velocity v and gravity g of that
/// moment, in the body as it then was (B), the biases, what the cameras' calibration is wrong by, the points seen, and
/// what the noise of the inertial samples adds up to, e, in each moment's turn and position:
///   p_k = v t_k + g t_k^2 / 2 + double integral of R f + e_k
/// That noise is measured, too, by how far e is from zero, as a factor on what is stated.
/// It is a point to linearize at, not an estimate: the frames may be used again. It lacks few_frames, or
/// cameras_contradict where the images do not fit, or moves_unseen where they do not show the length of the path.
[[nodiscard]] StartAttempt image_start(const std::vector<TimedFrame>& frames, const ImuBuffer& imu,
                                       const CameraState& cameras, const StartNoise& noise);

}  // namespace ear
