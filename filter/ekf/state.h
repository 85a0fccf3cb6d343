// The state, and what an error of it means. Only boxplus knows the error's definition (docs/filter.md, "State and
// error"):
//   R = Exp(theta) R^, v = Exp(theta) v^ + nu, p = Exp(theta) p^ + rho; clones alike; n = Exp(theta) Exp(B delta) n^;
//   biases and calibration additive, wheels relative, rotations of the cameras R = Exp(phi) R^, of the odometer R = R^
//   Exp(phi), the matrices of gyroscope and accelerometer M = M^ (I + E).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "ear/types.h"
#include "filter/ekf/so3.h"
#include "filter/ingest/beam_ranges.h"

namespace ear {

inline const Eigen::Vector3d kGravity_W{0.0, 0.0, -9.81};  ///< [m/s^2]

/// Where each quantity's error stands in the error vector. What wheels and lasers measure lies together, before the
/// camera's part; that is last, so that its measurements touch one contiguous range too: the calibration of the
/// cameras, with the gyroscope's matrix, which cameras show, then the clones, oldest first.
namespace err {
inline constexpr int theta = 0, nu = 3, rho = 6, b_g = 9, b_a = 12;
inline constexpr int imu_size = 15;
inline constexpr int normal = imu_size;                 ///< delta, tilt of the ground's normal [rad]: 2
inline constexpr int wheel_radius = normal + 2;         ///< left, right, relative: 2
inline constexpr int track_width = normal + 4;          ///< relative: 1
inline constexpr int odometer = normal + 5;             ///< phi, turn of O about its own axes [rad]: 3
inline constexpr int axle = odometer + 3;               ///< position of O in the body [m]: 3
inline constexpr int encoder_offset = axle + 3;         ///< [s] of the encoders' clock: 1
inline constexpr int readings = encoder_offset + 1;     ///< what the last two of the encoders are off by [m]: 2
inline constexpr int beams = readings + 2;              ///< offset of each laser beam's range [m]
inline constexpr int accel_matrix = beams + kMaxBeams;  ///< E of the accelerometer, column by column: 9
inline constexpr int camera = accel_matrix + 9;         ///< phi, p of camera 0 in the body: 6
inline constexpr int stereo = camera + 6;               ///< phi, p of camera 1 in camera 0: 6
inline constexpr int baseline = stereo + 3;             ///< its p
inline constexpr int poses_size = 12;                   ///< of these two
inline constexpr int lenses = camera + poses_size;      ///< focal length, principal point of cameras 0 and 1: 3 each
inline constexpr int lens_size = 3;
[[nodiscard]] constexpr int lens(int index) { return lenses + lens_size * index; }
inline constexpr int time_offset = lenses + 2 * lens_size;  ///< [s]
inline constexpr int gyro_matrix = time_offset + 1;         ///< E of the gyroscope, column by column: 9
inline constexpr int calibration_size = 28;
inline constexpr int clones = camera + calibration_size;
inline constexpr int clone_size = 6;  ///< theta, rho
[[nodiscard]] constexpr int clone(int index) { return clones + clone_size * index; }
}  // namespace err

/// Columns of a wheel or laser row: from err::nu to the end of the beams.
inline constexpr int kGroundColumns = err::accel_matrix - err::nu;
/// Column of an entry of the error vector in such a row.
[[nodiscard]] constexpr int ground_column(int entry) { return entry - err::nu; }

struct Pose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  /// T_AC = T_AB * T_BC.
  [[nodiscard]] Pose operator*(const Pose& T) const { return {R * T.R, R * T.p + p}; }
  [[nodiscard]] Pose inverse() const {
    const Eigen::Matrix3d R_inverse = R.transpose();
    return {R_inverse, -(R_inverse * p)};
  }
};

/// The inertial part: what IMU samples propagate.
struct ImuState {
  TimeNs t_ns = 0;
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();
  /// M, true = M measured rate: scales of the axes, and where they point.
  Eigen::Matrix3d gyro_matrix = Eigen::Matrix3d::Identity();
  /// A, true = A measured specific force, likewise.
  Eigen::Matrix3d accel_matrix = Eigen::Matrix3d::Identity();

  [[nodiscard]] Pose T_WB() const { return {R_WB, p_WB}; }
  /// The body's rate where the gyroscope measures `gyro_B` [rad/s].
  [[nodiscard]] Eigen::Vector3d rate_B(const Eigen::Vector3d& gyro_B) const { return gyro_matrix * (gyro_B - b_g); }
  /// The body's specific force where the accelerometer measures `accel_B` [m/s^2].
  [[nodiscard]] Eigen::Vector3d force_B(const Eigen::Vector3d& accel_B) const { return accel_matrix * (accel_B - b_a); }
  /// That of a body at rest: what bears it against gravity.
  [[nodiscard]] Eigen::Vector3d rest_force_B() const { return -(R_WB.transpose() * kGravity_W); }
};

/// The plane that the wheels stand on.
struct GroundState {
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();  ///< its unit normal, upwards
};

/// Wheels and lasers as the filter knows them.
struct OdometerState {
  Eigen::Vector2d wheel_radius = Eigen::Vector2d::Ones();  ///< left, right [m]
  double track_width = 1.0;                                ///< [m]
  Pose T_BO;                                               ///< middle of the axle to body
  double time_offset = 0.0;                                ///< [s] add to an encoder's stamp to get IMU time
  /// By how much the last two readings are ahead of the path that the wheels have gone, the mean of both [m].
  Eigen::Vector2d reading_error = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, kMaxBeams, 1> beam_offset =
      Eigen::Matrix<double, kMaxBeams, 1>::Zero();  ///< of the laser beams: measured less true range [m]
};

/// What the intrinsics with which features were normalized are wrong by: what is at x is measured at
/// (1 + focal_length) x + principal_point.
struct LensError {
  double focal_length = 0.0;                                  ///< true less given, relative
  Eigen::Vector2d principal_point = Eigen::Vector2d::Zero();  ///< true less given, over the focal length

  [[nodiscard]] Eigen::Vector2d measured(const Eigen::Vector2d& uv) const {
    return (1.0 + focal_length) * uv + principal_point;
  }
  [[nodiscard]] Eigen::Vector2d corrected(const Eigen::Vector2d& measured) const {
    return (measured - principal_point) / (1.0 + focal_length);
  }
};

/// The cameras as the filter knows them.
struct CameraState {
  Pose T_BC0;                ///< camera 0 to body
  Pose T_C0C1;               ///< camera 1 to camera 0
  double time_offset = 0.0;  ///< [s] add to a camera stamp to get IMU time
  std::array<LensError, 2> lens_error;
};

/// A camera's stamp by the clock of the IMU, and the reverse.
[[nodiscard]] inline TimeNs imu_time(TimeNs camera_time_ns, const CameraState& camera) {
  return later_by(camera.time_offset, camera_time_ns);
}
[[nodiscard]] inline TimeNs camera_time(TimeNs imu_time_ns, const CameraState& camera) {
  return later_by(-camera.time_offset, imu_time_ns);
}

/// The body's pose at a past frame.
struct Clone {
  std::uint64_t frame = 0;  ///< number of the frame, never used again
  Pose T_WB;
  double feature_noise = 1.0;  ///< standard deviation of what was seen from it, times the usual
  double weight = 1.0;         ///< (15) of what was seen from it: the noise of a feature that fits is divided by it
  TimeNs t_ns = 0;
};

struct State {
  ImuState imu;
  GroundState ground;
  OdometerState odometer;
  CameraState camera;
  std::vector<Clone> clones;  ///< oldest first

  [[nodiscard]] int error_size() const { return err::clone(static_cast<int>(clones.size())); }
};

/// Standard deviations of the errors from err::b_g on: gyroscope [rad/s], accelerometer [m/s^2], each axis.
[[nodiscard]] inline Eigen::Matrix<double, 6, 1> bias_sigma(double gyro, double accel) {
  return (Eigen::Matrix<double, 6, 1>() << Eigen::Vector3d::Constant(gyro), Eigen::Vector3d::Constant(accel))
      .finished();
}

/// Two unit vectors, as columns, that span the plane perpendicular to the unit vector n; smooth except at n = -z.
[[nodiscard]] Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& n);

/// Applies the error d, which has x.error_size() entries.
void boxplus(State& x, const Eigen::Ref<const Eigen::VectorXd>& d);

}  // namespace ear
