// What is estimated of a vehicle: errors of the calibration that was given, all zero at the start, and how well that
// was known. Additive, so that a prior is a standard deviation of each.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "calibration/inertial_path.h"
#include "ear/calibration.h"

namespace ear::calibration {

/// Blocks as Ceres sees them.
struct Parameters {
  std::array<double, 6> camera{};  ///< phi [rad], p [m]: R_BC0 = Exp(phi) R^, p_BC0 = p^ + p
  std::array<double, 6> stereo{};  ///< the same of camera 1 in camera 0
  /// Of each camera: focal length (relative), principal point [px], k1, k2.
  std::array<std::array<double, 5>, 2> lens{};
  std::array<double, 1> camera_time{};  ///< [s] added to the stamps
  GyroErrors gyro{};
  std::array<double, 3> wheels{};  ///< mean radius, left less right radius, track width; relative
  /// Position of O [m]; turn of O about its own x and z, tangents: y_O = (-z, 1, x) normalized.
  std::array<double, 5> axle{};
  std::array<double, 1> encoder_time{};  ///< [s] added to the stamps
  /// Origin [m]; tilt t of the direction, tangents: d = (d^ + (B t) x d^) normalized, B = tangent_basis(-d^).
  std::vector<std::array<double, 5>> beams;
  std::array<double, 1> laser_time{};  ///< [s] added to the stamps
};

/// What the values were known to before, as standard deviations, in the units of Parameters.
struct Priors {
  double camera_rotation, camera_position, stereo_rotation, stereo_position;
  std::array<double, 2> focal_length, principal_point;  ///< of each camera
  double distortion, camera_time, gyro;
  double wheel_radius, radius_difference, track_width;
  double axle_position, axle_rotation, encoder_time;
  double beam_origin, beam_direction, laser_time;
};

/// Where the calibration states standard deviations, these. Elsewhere: cameras as somebody measured them by hand who
/// knows their lens; wheels and beams as in a sketch: radii to 5 %, directions to 10 degrees.
[[nodiscard]] Priors priors_of(const Calibration& given);

/// One number that is estimated.
struct Entry {
  std::string name;    ///< "encoder0: wheel radius, mean"
  std::string unit;    ///< that it is shown in
  double scale = 1.0;  ///< from Parameters to that unit
  double given = 0.0;  ///< the value that was given, in that unit; 0 where the entry is an angle or a lever of a frame
  double prior = 1.0;  ///< standard deviation, in Parameters' unit
  double* value = nullptr;  ///< in Parameters
};

/// A block and the numbers that it holds.
struct CalibrationBlock {
  double* data = nullptr;
  std::vector<Entry> entries;
};

/// All that the vehicle has, in a fixed order. They point into `parameters`, whose beams must have been sized.
[[nodiscard]] std::vector<CalibrationBlock> blocks_of(Parameters& parameters, const Calibration& given,
                                                      const Priors& priors);

/// Of the size that the calibration asks for.
[[nodiscard]] Parameters zero_parameters(const Calibration& given);

/// The calibration that the parameters say.
[[nodiscard]] Calibration applied(const Calibration& given, const Parameters& parameters);

/// The parameters for which applied(given, ...) is `truth`, in what the models depend on.
[[nodiscard]] Parameters errors_of(const Calibration& given, const Calibration& truth);

/// `given` with the standard deviations stated that `priors` are: what the filter starts with.
[[nodiscard]] Calibration with_priors(const Calibration& given, const Priors& priors);

}  // namespace ear::calibration
