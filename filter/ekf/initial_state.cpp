#include "filter/ekf/initial_state.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(what);
}

void require_sigma(const std::optional<double>& sigma, const char* what) {
  require(!sigma || (*sigma > 0.0 && std::isfinite(*sigma)), what);
}

void require_sigma(const std::optional<PoseSigma>& sigma, const char* what) {
  if (!sigma) return;
  require_sigma(sigma->rotation, what);
  require_sigma(sigma->position, what);
}

void require_sigmas(const Calibration& calibration) {
  require_sigma(calibration.camera_time_offset_sigma, "calibration: camera_time_offset_sigma must be positive");
  for (const CameraCalibration& camera : calibration.cameras) {
    require_sigma(camera.pose_sigma, "calibration: a camera's pose_sigma must be positive");
    if (const auto& lens = camera.intrinsics_sigma) {
      require_sigma(lens->focal_length, "calibration: a camera's intrinsics_sigma must be positive");
      require_sigma(lens->principal_point, "calibration: a camera's intrinsics_sigma must be positive");
    }
  }
  require_sigma(calibration.imu.gyro_bias_sigma, "calibration: gyro_bias_sigma must be positive");
  require_sigma(calibration.imu.accel_bias_sigma, "calibration: accel_bias_sigma must be positive");
  require_sigma(calibration.imu.gyro_scale_sigma, "calibration: gyro_scale_sigma must be positive");
  require_sigma(calibration.imu.accel_scale_sigma, "calibration: accel_scale_sigma must be positive");
  if (const auto& encoder = calibration.encoder) {
    require(encoder->stamp_sigma >= 0.0 && std::isfinite(encoder->stamp_sigma),
            "calibration: the encoder's stamp_sigma must not be negative");
    require_sigma(encoder->time_offset_sigma, "calibration: the encoder's time_offset_sigma must be positive");
    require_sigma(encoder->T_BO_sigma, "calibration: T_BO_sigma must be positive");
    require_sigma(encoder->wheel_radius_sigma, "calibration: wheel_radius_sigma must be positive");
    require_sigma(encoder->wheel_radius_difference_sigma,
                  "calibration: wheel_radius_difference_sigma must be positive");
    require_sigma(encoder->track_width_sigma, "calibration: track_width_sigma must be positive");
  }
  if (calibration.lasers) {
    require_sigma(calibration.lasers->time_offset_sigma, "calibration: the lasers' time_offset_sigma must be positive");
    require_sigma(calibration.lasers->offset_sigma, "calibration: a laser's offset_sigma must be positive");
  }
}

}  // namespace

const FilterConfig& checked(const FilterConfig& config) {
  require(config.window >= 3, "filter.window: at least 3 clones are needed");
  require(config.window <= 60, "filter.window: at most 60 clones");
  require(config.max_track_updates >= 1, "filter.max_track_updates: at least 1");
  require(config.max_track_updates <= 1000, "filter.max_track_updates: at most 1000");
  require(config.feature_sigma_px > 0.0, "filter.feature_sigma_px: must be positive");
  require(config.huber_px > 0.0, "filter.huber_px: must be positive");
  require(config.gate_probability > 0.0 && config.gate_probability < 1.0, "filter.gate_probability: between 0 and 1");
  const AnomalyConfig& anomaly = config.anomaly;
  require(anomaly.distance > 0.0, "filter.anomaly.distance: must be positive");
  require(anomaly.false_alarm > 0.0 && anomaly.false_alarm < 1.0, "filter.anomaly.false_alarm: between 0 and 1");
  require(anomaly.min_weight > 0.0 && anomaly.min_weight <= 1.0, "filter.anomaly.min_weight: above 0, at most 1");
  return config;
}

const Calibration& checked(const Calibration& calibration) {
  const auto require_rotation = [](const Eigen::Isometry3d& T, const char* what) {
    const Eigen::Matrix3d R = T.linear();
    require((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 && R.determinant() > 0.0, what);
  };
  const auto require_offset = [](double seconds, const char* what) {
    require(std::abs(seconds) <= kLargestTimeOffset, what);
  };
  require(!calibration.cameras.empty() || calibration.encoder, "calibration: a camera or wheels are needed");
  require(calibration.cameras.size() <= 2, "calibration: at most two cameras");
  for (const CameraCalibration& camera : calibration.cameras) {
    require(camera.fu > 0.0 && camera.fv > 0.0, "calibration: a camera's focal lengths must be positive");
    require_rotation(camera.T_BC, "calibration: a camera's T_BS holds no rotation");
  }
  require_offset(calibration.camera_time_offset,
                 "calibration: camera_time_offset must be a number of seconds, at most an hour");
  require(calibration.imu.gyro_noise > 0.0 && calibration.imu.accel_noise > 0.0,
          "calibration: imu noise must be positive");
  require(calibration.imu.rate_hz > 0.0 && std::isfinite(calibration.imu.rate_hz),
          "calibration: imu rate_hz must be a positive number");
  require((calibration.imu.gyro_matrix - Eigen::Matrix3d::Identity()).norm() < 0.5,
          "calibration: gyro_matrix must be near the identity: axes that point elsewhere belong into T_BS");
  if (const auto& encoder = calibration.encoder) {
    require(encoder->wheel_radius[0] > 0.0 && encoder->wheel_radius[1] > 0.0,
            "calibration: wheel_radius must be positive");
    require(encoder->track_width > 0.0, "calibration: track_width must be positive");
    require(encoder->resolution > 0, "calibration: encoder resolution must be positive");
    require_offset(encoder->time_offset,
                   "calibration: the encoder's time_offset must be a number of seconds, at most an hour");
    require_rotation(encoder->T_BO, "calibration: the encoder's T_BS holds no rotation");
  }
  if (const auto& lasers = calibration.lasers) {
    require(lasers->beams.size() <= kMaxBeams, "calibration: at most three laser beams");
    require_offset(lasers->time_offset,
                   "calibration: the lasers' time_offset must be a number of seconds, at most an hour");
    for (const LaserBeam& beam : lasers->beams) {
      require(std::abs(beam.d_B.norm() - 1.0) < 1e-2, "calibration: a laser's direction must have length one");
    }
  }
  require_sigmas(calibration);
  return calibration;
}

/// The prior takes both radii for independent, then their difference for known: their mean has 1 / sqrt(2) of the
/// standard deviation of one.
FilterConfig settings_for(const FilterConfig& config, const Calibration& calibration) {
  FilterConfig result = config;
  PriorConfig& prior = result.prior;
  const auto state_pose = [](const std::optional<PoseSigma>& sigma, double& rotation, double& position) {
    if (!sigma) return;
    rotation = sigma->rotation;
    position = sigma->position;
  };
  prior.gyro_bias = calibration.imu.gyro_bias_sigma.value_or(prior.gyro_bias);
  prior.accel_bias = calibration.imu.accel_bias_sigma.value_or(prior.accel_bias);
  prior.gyro_scale = calibration.imu.gyro_scale_sigma.value_or(prior.gyro_scale);
  prior.accel_scale = calibration.imu.accel_scale_sigma.value_or(prior.accel_scale);
  prior.gyro_unseen = calibration.imu.gyro_scale_sigma.value_or(prior.gyro_unseen);
  prior.gyro_axes_unseen = calibration.imu.gyro_scale_sigma.value_or(prior.gyro_axes_unseen);
  prior.time_offset = calibration.camera_time_offset_sigma.value_or(prior.time_offset);
  const std::vector<CameraCalibration>& cameras = calibration.cameras;
  if (!cameras.empty()) state_pose(cameras[0].pose_sigma, prior.camera_rotation, prior.camera_position);
  if (cameras.size() > 1) state_pose(cameras[1].pose_sigma, prior.stereo_rotation, prior.stereo_position);
  if (const auto& encoder = calibration.encoder) {
    const double radius = 0.5 * (encoder->wheel_radius[0] + encoder->wheel_radius[1]);
    if (const auto& sigma = encoder->wheel_radius_sigma) {
      prior.wheel_scale = *sigma / radius;
      prior.wheel_radius = std::sqrt(2.0) * prior.wheel_scale;
    }
    if (const auto& sigma = encoder->wheel_radius_difference_sigma) {
      const double independent = std::sqrt(2.0) * prior.wheel_radius;
      const double missing = std::pow(radius / *sigma, 2) - 1.0 / (independent * independent);
      prior.wheel_apart = 1.0 / std::sqrt(2.0 * std::max(missing, 1.0));
    }
    if (const auto& sigma = encoder->track_width_sigma) prior.track_width = *sigma / encoder->track_width;
    prior.encoder_time_offset = encoder->time_offset_sigma.value_or(prior.encoder_time_offset);
    state_pose(encoder->T_BO_sigma, prior.odometer_rotation, prior.axle);
    state_pose(encoder->T_BO_sigma, prior.odometer_unseen, prior.axle_unseen);
  }
  if (calibration.lasers) prior.beam_offset = calibration.lasers->offset_sigma.value_or(prior.beam_offset);
  return result;
}

bool has_beams(const Calibration& calibration) { return calibration.lasers && !calibration.lasers->beams.empty(); }

bool uses_wheels(const FilterConfig& config, const Calibration& calibration) {
  return calibration.encoder && config.odometer.model != OdometerModel::none;
}

double focal_length(const Calibration& calibration) {
  if (calibration.cameras.empty()) return 1.0;
  return 0.5 * (calibration.cameras[0].fu + calibration.cameras[0].fv);
}

Eigen::Vector3d lens_sigma(const PriorConfig& prior, const CameraCalibration& camera) {
  const auto& stated = camera.intrinsics_sigma;
  const double focal = stated ? stated->focal_length / camera.fu : prior.focal_length;
  const double centre = stated ? stated->principal_point : prior.principal_point;
  return {focal, centre / camera.fu, centre / camera.fv};
}

double odometer_rotation_sigma(const PriorConfig& prior, const Calibration& calibration) {
  return has_beams(calibration) ? prior.odometer_rotation : prior.odometer_unseen;
}

CameraState camera_state(const Calibration& calibration) {
  CameraState camera;
  camera.time_offset = calibration.camera_time_offset;
  if (calibration.cameras.empty()) return camera;
  const Eigen::Isometry3d& T_BC0 = calibration.cameras.front().T_BC;
  camera.T_BC0 = {renormalized(T_BC0.linear()), T_BC0.translation()};
  const Eigen::Isometry3d T_C0C1 = T_BC0.inverse() * calibration.cameras.back().T_BC;
  camera.T_C0C1 = {renormalized(T_C0C1.linear()), T_C0C1.translation()};
  return camera;
}

OdometerState odometer_state(const Calibration& calibration) {
  OdometerState odometer;
  if (const auto& encoder = calibration.encoder) {
    odometer.wheel_radius << encoder->wheel_radius[0], encoder->wheel_radius[1];
    odometer.track_width = encoder->track_width;
    odometer.T_BO = {renormalized(encoder->T_BO.linear()), encoder->T_BO.translation()};
  }
  return odometer;
}

}  // namespace ear
