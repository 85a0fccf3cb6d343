#include "calibration/stated.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "calibration/degree.h"

namespace ear::calibration {
namespace {

// How cameras, gyroscope and axle are turned against the accelerometer, whose axes are the body's.
constexpr const char* kGyroscope = "imu0: gyroscope";
constexpr const char* kRotation = "cam0: rotation";
constexpr const char* kAxle = "encoder0: axle turned";

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

/// Of the entries whose names begin so, which hang together, `covariance` in the order of the findings: what standard
/// deviations have to be multiplied with, so that independent errors of that size are nowhere smaller than the joint
/// ones. With D their variances and C their correlations, k^2 D - D^1/2 C D^1/2 has no negative eigenvalue if k^2 is
/// the largest of C.
double independent_factor(const std::vector<Finding>& findings, const Eigen::MatrixXd& covariance,
                          const std::vector<std::string>& names) {
  std::vector<Eigen::Index> group;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const auto begins = [&](const std::string& name) { return findings[i].name.rfind(name, 0) == 0; };
    if (std::any_of(names.begin(), names.end(), begins)) group.push_back(static_cast<Eigen::Index>(i));
  }
  if (group.empty()) return 1.0;
  const Eigen::MatrixXd P = covariance(group, group);
  const Eigen::VectorXd scale = P.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd C = scale.asDiagonal() * P * scale.asDiagonal();
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(C).eigenvalues().maxCoeff());
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

Calibration with_sigmas(Calibration calibration, const std::vector<Finding>& findings,
                        const Eigen::MatrixXd& covariance) {
  const double turned = independent_factor(findings, covariance, {kGyroscope, kRotation, kAxle});
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    const std::string name = "cam" + std::to_string(i);
    CameraCalibration& camera = calibration.cameras[i];
    camera.pose_sigma = PoseSigma{(i == 0 ? turned : 1.0) * degrees(findings, name + ": rotation"),
                                  thousandth(findings, name + ": position")};
    camera.intrinsics_sigma = IntrinsicsSigma{mean_sigma(findings, name + ": focal length").value_or(0.0),
                                              mean_sigma(findings, name + ": principal point").value_or(0.0)};
  }
  if (!calibration.cameras.empty()) {
    if (const auto percent = mean_sigma(findings, kGyroscope)) {
      calibration.imu.gyro_scale_sigma = turned * 1e-2 * *percent;
    }
    calibration.camera_time_offset_sigma = thousandth(findings, "cam0: time");
  }
  if (calibration.encoder) {
    EncoderCalibration& encoder = *calibration.encoder;
    encoder.T_BO_sigma = PoseSigma{turned * degrees(findings, kAxle), thousandth(findings, "encoder0: position")};
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
