// What the simulated sensors read. Times are those of the stamps; the recording starts at kStart.
#pragma once

#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "tools/simulator/random.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/terrain.h"
#include "tools/simulator/trajectory.h"
#include "tools/simulator/wheel_motion.h"

namespace ear::simulator {

/// The stamp of the motion's time zero: some day in 2020, so that a float of a stamp shows.
inline constexpr TimeNs kStart = 1'600'000'000'000'000'000;

[[nodiscard]] inline double motion_time(TimeNs t_ns) { return seconds_between(kStart, t_ns); }

/// Regular stamps: first at `phase` after the start, none later than `duration` [s].
[[nodiscard]] std::vector<TimeNs> regular_stamps(double rate_hz, double phase, double duration);

/// Biases of the IMU at one of its stamps, gyroscope [rad/s] and accelerometer [m/s^2].
struct ImuBias {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();
};

/// One sigma of the accelerometer's initial bias [m/s^2], per axis.
inline constexpr double kInitialAccelBias = 0.03;

/// Random walks from random initial values (about 5e-3 rad/s and 0.05 m/s^2), one bias per stamp.
[[nodiscard]] std::vector<ImuBias> draw_imu_biases(const ImuCalibration& imu, std::size_t count, Rng& rng);

/// What an IMU without errors reads: the mean of angular rate and specific force over the interval centred on each
/// stamp.
[[nodiscard]] std::vector<ImuSample> ideal_imu(const Trajectory& trajectory, const std::vector<TimeNs>& stamps,
                                               double rate_hz);

/// By axes of the gyroscope that are off, with biases and white noise.
void corrupt_imu(std::vector<ImuSample>& samples, const ImuCalibration& imu, const std::vector<ImuBias>& biases,
                 Rng& rng);

/// Counts of the wheels' angles, with noise (noise_counts; 0 is none) and wrapped.
[[nodiscard]] std::vector<EncoderSample> read_encoders(const WheelMotion& wheels, const EncoderCalibration& encoder,
                                                       const std::vector<TimeNs>& stamps, Rng& rng);

/// Ranges along each beam to the ground, with noise (0 is none); NaN out of range.
[[nodiscard]] std::vector<LaserSample> read_lasers(const Trajectory& trajectory, const Terrain& terrain,
                                                   const LaserCalibration& lasers, const std::vector<TimeNs>& stamps,
                                                   Rng& rng);

/// Readings that are lost or wrong; does nothing, and draws nothing, without faults.
void corrupt_lasers(std::vector<LaserSample>& samples, const LaserCalibration& lasers, const LaserFaults& faults,
                    Rng& rng);

}  // namespace ear::simulator
