#include "calibration/stated.h"

#include <cmath>
#include <optional>
#include <string>

namespace ear::calibration {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// Root of the mean square of the standard deviations of all entries whose name begins so [unit of the findings].
std::optional<double> sigma_of(const std::vector<Finding>& findings, const std::string& name) {
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

double degrees(const std::vector<Finding>& findings, const std::string& name) {
  return kDegree * sigma_of(findings, name).value_or(0.0);
}

double thousandth(const std::vector<Finding>& findings, const std::string& name) {
  return 1e-3 * sigma_of(findings, name).value_or(0.0);
}

}  // namespace

Calibration with_sigmas(Calibration calibration, const std::vector<Finding>& findings) {
  const auto lens = [&](const std::string& camera, double focal) {  // the filter counts it as a rotation
    return sigma_of(findings, camera + ": principal point").value_or(0.0) / focal;
  };
  if (!calibration.cameras.empty()) {
    calibration.cameras[0].pose_sigma =
        PoseSigma{std::hypot(degrees(findings, "cam0: rotation"), lens("cam0", calibration.cameras[0].fu)),
                  thousandth(findings, "cam0: position")};
    calibration.camera_time_offset_sigma = thousandth(findings, "cam0: time");
  }
  if (calibration.cameras.size() > 1) {
    calibration.cameras[1].pose_sigma =
        PoseSigma{std::hypot(degrees(findings, "cam1: rotation"), lens("cam1", calibration.cameras[1].fu)),
                  thousandth(findings, "cam1: position")};
  }
  if (calibration.encoder) {
    EncoderCalibration& encoder = *calibration.encoder;
    encoder.T_BO_sigma =
        PoseSigma{degrees(findings, "encoder0: axle turned"), thousandth(findings, "encoder0: position")};
    encoder.wheel_radius_sigma = thousandth(findings, "encoder0: wheel radius, mean");
    encoder.wheel_radius_difference_sigma =
        std::min(thousandth(findings, "encoder0: wheel radius, left"), 1.9 * *encoder.wheel_radius_sigma);
    encoder.track_width_sigma = thousandth(findings, "encoder0: wheel separation");
  }
  return calibration;
}

}  // namespace ear::calibration
