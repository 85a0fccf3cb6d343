#include "calibration/stated.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "calibration/degree.h"

namespace ear::calibration {
namespace {

double degrees(const std::vector<Finding>& findings, const std::string& name) {
  return kDegree * mean_sigma(findings, name).value_or(0.0);
}

double thousandth(const std::vector<Finding>& findings, const std::string& name) {
  return 1e-3 * mean_sigma(findings, name).value_or(0.0);
}

/// What the filter knows of the beams is what each reads too much: along it, and by the direction at a short range.
double range_sigma(const std::vector<Finding>& findings, const LaserCalibration& lasers) {
  constexpr double kLeast = 5e-4;  // [m]
  double sum = 0.0;
  for (const LaserBeam& beam : lasers.beams) {
    const double origin = thousandth(findings, "laser0 " + beam.name + ": origin z");
    sum += origin * origin / static_cast<double>(lasers.beams.size());
  }
  return std::max(kLeast, std::sqrt(sum));
}

}  // namespace

std::optional<double> mean_sigma(const std::vector<Finding>& findings, const std::string& name) {
  double sum = 0.0;
  int count = 0;
  for (const Finding& finding : findings) {
    if (finding.name.rfind(name, 0) != 0) continue;
    sum += finding.posterior * finding.posterior;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / count);
}

Calibration with_sigmas(Calibration calibration, const std::vector<Finding>& findings) {
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    const std::string name = "cam" + std::to_string(i);
    CameraCalibration& camera = calibration.cameras[i];
    camera.pose_sigma = PoseSigma{degrees(findings, name + ": rotation"), thousandth(findings, name + ": position")};
    camera.intrinsics_sigma = IntrinsicsSigma{mean_sigma(findings, name + ": focal length").value_or(0.0),
                                              mean_sigma(findings, name + ": principal point").value_or(0.0)};
  }
  if (!calibration.cameras.empty()) {
    calibration.imu.gyro_scale_sigma = 1e-2 * mean_sigma(findings, "imu0: gyroscope").value_or(0.0);
    calibration.camera_time_offset_sigma = thousandth(findings, "cam0: time");
  }
  if (calibration.encoder) {
    EncoderCalibration& encoder = *calibration.encoder;
    encoder.T_BO_sigma =
        PoseSigma{degrees(findings, "encoder0: axle turned"), thousandth(findings, "encoder0: position")};
    encoder.wheel_radius_sigma = thousandth(findings, "encoder0: wheel radius, mean");
    encoder.wheel_radius_difference_sigma =
        std::min(thousandth(findings, "encoder0: wheel radius, left"), 1.9 * *encoder.wheel_radius_sigma);
    encoder.track_width_sigma = thousandth(findings, "encoder0: wheel separation");
    encoder.time_offset_sigma = thousandth(findings, "encoder0: time");
  }
  if (calibration.lasers) {
    calibration.lasers->time_offset_sigma = thousandth(findings, "laser0: time");
    calibration.lasers->offset_sigma = range_sigma(findings, *calibration.lasers);
  }
  return calibration;
}

}  // namespace ear::calibration
