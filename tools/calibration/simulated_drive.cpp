#include "tools/calibration/simulated_drive.h"

#include "calibration/degree.h"

namespace ear::calibration {
Priors drawn_priors(double factor) {
  Priors priors{};
  priors.camera_rotation = factor * 0.2 * kDegree;
  priors.camera_position = factor * 1e-3;
  priors.stereo_rotation = factor * 0.02 * kDegree;
  priors.stereo_position = factor * 5e-5;
  priors.focal_length.fill(factor * 1e-3);
  priors.principal_point.fill(factor * 0.5);
  priors.distortion = 1e-3;
  priors.camera_time = factor * 2e-3;
  priors.gyro = factor * 3e-3;
  priors.wheel_radius = factor * 4e-3;
  priors.radius_difference = factor * 1e-3;
  priors.track_width = factor * 5e-3;
  priors.axle_rotation = factor * 0.3 * kDegree;
  priors.axle_position = factor * 3e-3;
  priors.encoder_time = 2e-3;
  priors.beam_direction = factor * 0.3 * kDegree;
  priors.beam_origin = factor * 2e-3;
  priors.laser_time = 2e-3;
  return priors;
}

std::vector<double> errors_left(const Result& result, const Calibration& given, const Calibration& truth,
                                const Priors& priors) {
  std::vector<double> errors;
  Parameters parameters = errors_of(given, truth);
  for (const CalibrationBlock& block : blocks_of(parameters, given, priors)) {
    for (const Entry& entry : block.entries) {
      errors.push_back(entry.scale * *entry.value - result.findings[errors.size()].change);
    }
  }
  return errors;
}

Drive recorded_drive(const simulator::Simulation& simulation) {
  Drive drive;
  drive.name = simulation.options().sequence;
  drive.imu = simulation.imu();
  drive.encoders = simulation.encoders();
  drive.lasers = simulation.lasers();
  for (std::size_t i = 0; i < simulation.frames().size(); ++i) {
    drive.frames.push_back(simulation.tracks(i));
  }
  return drive;
}

SimulatedCalibration calibrate_simulated(const simulator::Simulation& simulation, const Settings& settings) {
  const double factor = simulation.options().calibration_error.value_or(1.0);
  const Priors priors = drawn_priors(factor);
  Calibration given = simulation.calibration();
  given.imu.accel_bias_sigma = 0.08 * std::max(1.0, factor);
  const std::vector<Drive> drives{recorded_drive(simulation)};
  SimulatedCalibration made;
  made.result = calibrate(given, priors, drives, settings);
  made.errors = errors_left(made.result, given, simulation.true_calibration(), priors);
  return made;
}

}  // namespace ear::calibration
