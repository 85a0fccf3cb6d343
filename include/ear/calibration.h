// The sensors of a recording or a vehicle: geometry, lenses, noise. Frames: docs/design.md, section 1.
//
// A member whose name ends in _sigma says how well a value is known, as a standard deviation. Where it is empty, the
// setting in PriorConfig holds.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace ear {

/// How a lens bends rays; the coefficients are in OpenCV's order.
enum class LensModel {
  radial_tangential,  ///< k1, k2, p1, p2, k3 (Brown; ROS calls it plumb_bob)
  equidistant         ///< k1, k2, k3, k4 (Kannala-Brandt)
};

/// How well a pose is known, about and along each axis.
struct PoseSigma {
  double rotation = 0.0;  ///< [rad]
  double position = 0.0;  ///< [m]
};

/// How well a lens is known.
struct IntrinsicsSigma {
  double focal_length = 0.0;     ///< of fu, and of fv by the same share [px]
  double principal_point = 0.0;  ///< each axis [px]
};

struct CameraCalibration {
  Eigen::Isometry3d T_BC = Eigen::Isometry3d::Identity();  ///< camera (x right, y down, z forward) to body
  int width = 0;                                           ///< [px]
  int height = 0;                                          ///< [px]
  double fu = 0.0, fv = 0.0, cu = 0.0, cv = 0.0;           ///< [px]; the centre of the first pixel is (0, 0)
  LensModel lens = LensModel::radial_tangential;
  std::array<double, 5> distortion{};  ///< the fifth, k3, is 0 in a model of four
  double rate_hz = 0.0;
  /// Of the left camera in the body; of the right one in the left one, which is known better than either in the body.
  std::optional<PoseSigma> pose_sigma;
  std::optional<IntrinsicsSigma> intrinsics_sigma;
};

/// Continuous-time noise of the IMU, EuRoC's keys.
struct ImuCalibration {
  double rate_hz = 200.0;
  double gyro_noise = 1e-3;                 ///< [rad/s/sqrt(Hz)]
  double gyro_random_walk = 2e-5;           ///< [rad/s^2/sqrt(Hz)]
  double accel_noise = 1e-2;                ///< [m/s^2/sqrt(Hz)]
  double accel_random_walk = 3e-4;          ///< [m/s^3/sqrt(Hz)]
  std::optional<double> gyro_bias_sigma;    ///< [rad/s] of the bias at the start, about zero
  std::optional<double> accel_bias_sigma;   ///< [m/s^2]
  std::optional<double> gyro_scale_sigma;   ///< relative; also of one axis in turns about another
  std::optional<double> accel_scale_sigma;  ///< the same of the accelerometer, in forces along another axis
  /// M, where the axes are not perpendicular or of a wrong scale: rate = M measured. The filter learns what is left.
  Eigen::Matrix3d gyro_matrix = Eigen::Matrix3d::Identity();
};

/// Two wheels on one axle. O is the middle of the axle: x forward, y left along the axle, z up.
struct EncoderCalibration {
  Eigen::Isometry3d T_BO = Eigen::Isometry3d::Identity();
  double rate_hz = 100.0;
  std::int64_t resolution = 262144;                  ///< counts per revolution
  bool wraps = true;                                 ///< counts are an angle modulo the resolution, else cumulative
  std::array<double, 2> wheel_radius{0.075, 0.075};  ///< left, right [m]
  double track_width = 0.40;                         ///< [m]
  double noise_counts = 2.0;                         ///< one reading, 1-sigma [count]
  double stamp_sigma = 0.0;                 ///< one reading's stamp [s]: how far its counts may be of another time
  double time_offset = 0.0;                 ///< [s] add it to a stamp to get IMU time
  std::optional<double> time_offset_sigma;  ///< [s]
  std::optional<PoseSigma> T_BO_sigma;
  std::optional<double> wheel_radius_sigma;             ///< of the mean of both radii [m]
  std::optional<double> wheel_radius_difference_sigma;  ///< of the left radius less the right one [m]
  std::optional<double> track_width_sigma;              ///< [m]
};

struct LaserBeam {
  std::string name;
  Eigen::Vector3d p_BL = Eigen::Vector3d::Zero();   ///< where the beam starts [m]
  Eigen::Vector3d d_B = -Eigen::Vector3d::UnitZ();  ///< its unit direction
};

struct LaserCalibration {
  std::vector<LaserBeam> beams;
  double rate_hz = 50.0;
  double range_min = 0.02;   ///< [m]
  double range_max = 4.0;    ///< [m]
  double noise = 0.004;      ///< 1-sigma [m]
  double time_offset = 0.0;  ///< [s] add it to a stamp to get IMU time
  /// [s] what a calibration knows it to; the filter takes the offset as it is.
  std::optional<double> time_offset_sigma;
  std::optional<double> offset_sigma;  ///< of what each beam reads too much [m]
};

/// The largest offset [s] of a sensor's clock that an estimator takes.
inline constexpr double kLargestTimeOffset = 3600.0;

struct Calibration {
  std::vector<CameraCalibration> cameras;          ///< none, one, or two (left, right)
  double camera_time_offset = 0.0;                 ///< [s] add it to a camera stamp to get IMU time
  std::optional<double> camera_time_offset_sigma;  ///< [s]
  ImuCalibration imu;
  std::optional<EncoderCalibration> encoder;
  std::optional<LaserCalibration> lasers;
};

}  // namespace ear
