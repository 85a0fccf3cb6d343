#include "tools/simulator/calibration_error.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>

#include "tools/simulator/constants.h"
#include "tools/simulator/sensors.h"

namespace ear::simulator {
namespace {

// One sigma at factor 1.
constexpr double kRigRotation = 0.2 * kDegree;
constexpr double kRigPosition = 1e-3;  // [m]
constexpr double kStereoRotation = 0.02 * kDegree;
constexpr double kStereoPosition = 5e-5;  // [m]
constexpr double kFocalLength = 1e-3;
constexpr double kPrincipalPoint = 0.5;  // [px]
constexpr double kWheelRadius = 4e-3;
constexpr double kRadiusDifference = 1e-3;
constexpr double kTrackWidth = 5e-3;
constexpr double kOdometerRotation = 0.3 * kDegree;
constexpr double kOdometerPosition = 3e-3;  // [m]
constexpr double kBeamRotation = 0.3 * kDegree;
constexpr double kBeamOrigin = 2e-3;  // [m]
constexpr double kTimeOffset = 2e-3;  // [s]
constexpr double kAccelBias = 0.08;   // [m/s^2] with that of every IMU
constexpr double kGyroMatrix = 3e-3;  // each entry

// Sizes of with_fixed_errors().
constexpr double kFixedMounting = 0.2 * kDegree;
constexpr double kFixedStereo = 0.02 * kDegree;
constexpr double kFixedScale = 0.003;
constexpr double kFixedRadiusDifference = 0.0003;  // of left and right, in the same unit
constexpr double kFixedTime = 0.001;               // [s]

Eigen::Vector2d normal2(Rng& rng, double sigma) {
  const double x = normal(rng, sigma);
  const double y = normal(rng, sigma);
  return {x, y};
}

Eigen::Matrix3d rotation(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Eigen::Matrix3d random_rotation(Rng& rng, double angle) {
  return Eigen::AngleAxisd(angle, random_direction(rng)).toRotationMatrix();
}

double random_sign(Rng& rng) { return uniform(rng, -1.0, 1.0) < 0.0 ? -1.0 : 1.0; }

}  // namespace

CalibrationErrors draw_calibration_errors(std::uint64_t seed, double factor) {
  // The order is part of every recording: only append.
  Rng rng = make_rng(seed, Stream::calibration_errors);
  CalibrationErrors errors;
  errors.rig_rotation_B = normal3(rng, factor * kRigRotation);
  errors.rig_position_B = normal3(rng, factor * kRigPosition);
  errors.stereo_rotation_C0 = normal3(rng, factor * kStereoRotation);
  errors.stereo_position_C0 = normal3(rng, factor * kStereoPosition);
  for (CalibrationErrors::Camera& camera : errors.cameras) {
    camera.focal_length = normal(rng, factor * kFocalLength);
    camera.principal_point = normal2(rng, factor * kPrincipalPoint);
  }
  errors.wheel_radius = normal(rng, factor * kWheelRadius);
  errors.radius_difference = normal(rng, factor * kRadiusDifference);
  errors.track_width = normal(rng, factor * kTrackWidth);
  errors.odometer_rotation_B = normal3(rng, factor * kOdometerRotation);
  errors.odometer_position_B = normal3(rng, factor * kOdometerPosition);
  for (CalibrationErrors::Beam& beam : errors.beams) {
    beam.rotation_B = normal3(rng, factor * kBeamRotation);
    beam.origin_B = normal3(rng, factor * kBeamOrigin);
  }
  errors.camera_time_offset = normal(rng, factor * kTimeOffset);
  const double more_bias = std::sqrt(kAccelBias * kAccelBias - kInitialAccelBias * kInitialAccelBias);
  errors.accel_bias = normal3(rng, factor * more_bias);
  errors.encoder_time_offset = normal(rng, factor * kTimeOffset);
  errors.laser_time_offset = normal(rng, factor * kTimeOffset);
  for (double& entry : errors.gyro_matrix.reshaped()) entry = normal(rng, factor * kGyroMatrix);
  return errors;
}

Calibration with_errors(Calibration given, const CalibrationErrors& errors) {
  const Eigen::Matrix3d R_stereo = rotation(errors.stereo_rotation_C0);
  Eigen::Isometry3d T_C0C1 = given.cameras[0].T_BC.inverse() * given.cameras[1].T_BC;
  T_C0C1.linear() = R_stereo * T_C0C1.linear();
  T_C0C1.translation() += errors.stereo_position_C0;
  Eigen::Isometry3d& T_BC0 = given.cameras[0].T_BC;
  T_BC0.linear() = rotation(errors.rig_rotation_B) * T_BC0.linear();
  T_BC0.translation() += errors.rig_position_B;
  given.cameras[1].T_BC = T_BC0 * T_C0C1;
  for (std::size_t i = 0; i < errors.cameras.size(); ++i) {
    CameraCalibration& camera = given.cameras[i];
    camera.fu *= 1.0 + errors.cameras[i].focal_length;
    camera.fv *= 1.0 + errors.cameras[i].focal_length;
    camera.cu += errors.cameras[i].principal_point.x();
    camera.cv += errors.cameras[i].principal_point.y();
  }

  EncoderCalibration& encoder = *given.encoder;
  encoder.wheel_radius[0] *= 1.0 + errors.wheel_radius + 0.5 * errors.radius_difference;
  encoder.wheel_radius[1] *= 1.0 + errors.wheel_radius - 0.5 * errors.radius_difference;
  encoder.track_width *= 1.0 + errors.track_width;
  encoder.T_BO.linear() = rotation(errors.odometer_rotation_B) * encoder.T_BO.linear();
  encoder.T_BO.translation() += errors.odometer_position_B;

  for (std::size_t i = 0; i < errors.beams.size(); ++i) {
    LaserBeam& beam = given.lasers->beams[i];
    beam.d_B = rotation(errors.beams[i].rotation_B) * beam.d_B;
    beam.p_BL += errors.beams[i].origin_B;
  }
  given.camera_time_offset += errors.camera_time_offset;
  encoder.time_offset += errors.encoder_time_offset;
  given.lasers->time_offset += errors.laser_time_offset;
  given.imu.gyro_matrix.setIdentity();
  return given;
}

Calibration with_fixed_errors(Calibration given, Rng& rng) {
  EncoderCalibration& encoder = *given.encoder;
  const double radius_error = random_sign(rng) * kFixedScale;
  const double radius_difference = random_sign(rng) * kFixedRadiusDifference;
  encoder.wheel_radius[0] *= 1.0 + radius_error + 0.5 * radius_difference;
  encoder.wheel_radius[1] *= 1.0 + radius_error - 0.5 * radius_difference;
  encoder.track_width *= 1.0 + random_sign(rng) * kFixedScale;
  encoder.T_BO.linear() = random_rotation(rng, kFixedMounting) * encoder.T_BO.linear();

  for (LaserBeam& beam : given.lasers->beams) {
    const Eigen::Vector3d axis = beam.d_B.cross(random_direction(rng)).normalized();
    beam.d_B = Eigen::AngleAxisd(kFixedMounting, axis) * beam.d_B;
  }

  // The pair turns as one about the left camera.
  const Eigen::Vector3d pivot_B = given.cameras.front().T_BC.translation();
  const Eigen::Matrix3d R_error = random_rotation(rng, kFixedMounting);
  for (CameraCalibration& camera : given.cameras) {
    const Eigen::Vector3d p_B = camera.T_BC.translation();
    camera.T_BC.linear() = R_error * camera.T_BC.linear();
    camera.T_BC.translation() = pivot_B + R_error * (p_B - pivot_B);
  }
  Eigen::Isometry3d& T_BC1 = given.cameras.back().T_BC;
  T_BC1.linear() = T_BC1.linear() * random_rotation(rng, kFixedStereo);

  given.camera_time_offset += random_sign(rng) * kFixedTime;
  return given;
}

}  // namespace ear::simulator
