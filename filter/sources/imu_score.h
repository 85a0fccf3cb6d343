// How noisy the inertial sensors are: at rest by their samples alone, in motion by what they measure between two images
// against what these show, and before that by the images of the start. Vibration, missing samples and wrong stamps make
// them noisier than their data sheet. And whether a bias jumped or a clock is off, by the same pairs of images.
// docs/filter.md, "Propagation" and "Gaps and jumps".
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "filter/ekf/covariance.h"
#include "filter/ekf/imu_displacement.h"
#include "filter/ekf/noise_score.h"
#include "filter/ekf/records.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/ingest/limits.h"
#include "filter/sources/accel_excess.h"
#include "filter/sources/cameras/stereo_motion.h"
#include "filter/sources/clock_excess.h"
#include "filter/sources/frame_noise.h"
#include "filter/sources/gyro_excess.h"

namespace ear {

/// By how much the samples differ from what the images show; 0: not by more than may be.
struct ImuExcess {
  double gyro = 0.0;   ///< the gyroscope, whose bias has jumped [rad/s]
  double accel = 0.0;  ///< the same of the accelerometer [m/s^2]
  double clock = 0.0;  ///< their clock from that of the images [s]
};

class ImuScore {
 public:
  /// `adapts`: false for the noise that the calibration states. `limits`: of what counts as noise in a single frame.
  ImuScore(bool adapts, const ImuLimits& limits) : adapts_(adapts), frame_(limits) {}

  /// Samples of a vehicle that stands, which show the white noise; `stated`: what the calibration says of it.
  void add_rest(const ImuStatistics& rest, const ImuCalibration& stated);
  /// The factors that a start in motion has measured.
  void set_start(const ImuNoiseFactors& factors) { at_rest_ = factors; }
  /// Where there is no camera: what the accelerometer's samples and the wheels show, as a factor. Images know better.
  /// Not the gyroscope's: wheels would turn the vehicle instead, whose track width is a guess.
  void set_unseen_accel(double factor) { unseen_accel_ = factor; }
  /// Another frame, before anything is known of it.
  void start_frame() { frame_.start_frame(); }
  /// The motion from the state `x` to a frame at `t_ns` by the inertial samples, and as the images show it. `P`: of the
  /// state's error. By how much the cameras turned faster than the gyroscope of late [rad/s], in the mean, about the
  /// axis where it is least likely; nothing if the images show too little.
  std::optional<Innovation> add(const ImuMotion& motion, const StereoMotion& images, const State& x,
                                const Covariance& P, TimeNs t_ns);
  /// What the same frames show.
  ImuExcess take_excess(const Covariance& P) {
    return {gyro_excess_.take(P), accel_excess_.take(P),
            clock_excess_.take(P.matrix()(err::time_offset, err::time_offset))};
  }

  /// Factors on the noise of all samples up to this frame, 1 or more.
  [[nodiscard]] ImuNoiseFactors noise() const;

 private:
  [[nodiscard]] ImuNoiseFactors learned() const {
    return {at_rest_.gyro / gyro_.weight(), std::max(at_rest_.accel / accel_.weight(), unseen_accel_)};
  }

  /// Means over the last moments, which forget in kStale.
  struct TurnExcess {
    double count = 0.0;
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();      ///< sum of the turns beyond the gyroscope's, over time [rad/s]
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();  ///< of this sum, by noise
    double apparent = 0.0;                               ///< sum of the variances by the cameras' calibration
    Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();    ///< the gyroscope's, the last one [rad/s]
    std::optional<TimeNs> last_ns;
  };
  /// `rate_B`: of the turn in `motion` [rad/s]. `apparent`: variance of what errors of the cameras' calibration make
  /// look like one [rad^2/s^2].
  std::optional<Innovation> add_excess(const Excess& turn, const ImuMotion& motion, const Eigen::Vector3d& rate_B,
                                       double apparent, const Covariance& P, TimeNs t_ns);
  /// For the noise of this frame. `turn` and `way`: beyond the samples.
  void add_frame_turn(const Excess& turn, const ImuMotion& motion, double apparent, const Covariance& P);
  void add_frame_way(const Excess& way, const ImuMotion& motion, const Eigen::Matrix3d& by_state, const Covariance& P,
                     TimeNs t_ns);
  /// For the gyroscope's bias. `p_covariance`: of the displacement in `motion`.
  void add_bias(const StereoMotion& seen, const ImuMotion& motion, const Eigen::Vector3d& rate_B,
                const Eigen::Matrix3d& p_covariance, const State& x, const Covariance& P, TimeNs t_ns);

  bool adapts_;
  ImuNoiseFactors at_rest_;  ///< on the stated noise, when it last stood or started
  double unseen_accel_ = 1.0;
  TurnExcess turn_excess_;
  AccelExcess accel_excess_;
  ClockExcess clock_excess_;
  GyroExcess gyro_excess_;
  FrameNoise frame_;
  NoiseScore gyro_{kStreamMemory, kFarthest}, accel_{kStreamMemory, kFarthest};
};

}  // namespace ear
