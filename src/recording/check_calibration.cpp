#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "src/recording/calibration_files.h"

namespace ear {
namespace {

constexpr double kRotationTolerance = 1e-6;  // readers have already repaired what is only rounded
constexpr double kLeastBaseline = 1e-3;      // [m]
constexpr double kMostBaseline = 5.0;        // [m]
constexpr double kLeastFocal = 0.1;          // of the image's width: 157 degrees wide
constexpr double kMostFocal = 20.0;          // of the image's width: 3 degrees wide
constexpr double kMostLever = 10.0;          // [m] between two sensors of one vehicle
constexpr double kMostTimeOffset = 0.5;      // [s]

class Findings {
 public:
  void error(const std::string& where, const std::string& message) { add(Severity::error, where, message); }
  void warning(const std::string& where, const std::string& message) { add(Severity::warning, where, message); }
  void require_positive(const std::string& where, double value) {
    if (!(value > 0.0)) error(where, text(value) + " is not positive");
  }

  static std::string text(double value) {
    std::ostringstream stream;
    stream << value;
    return stream.str();
  }

  std::vector<Finding> list;

 private:
  void add(Severity severity, const std::string& where, const std::string& message) {
    list.push_back({severity, where, message});
  }
};

void check_pose(const Eigen::Isometry3d& T, const std::string& where, Findings& findings) {
  const Eigen::Matrix3d R = T.linear();
  const double defect = (R.transpose() * R - Eigen::Matrix3d::Identity()).norm();
  if (defect > kRotationTolerance) {
    findings.error(where, "rotation is not orthonormal (off by " + Findings::text(defect) + ")");
  } else if (R.determinant() < 0.0) {
    findings.error(where, "rotation has determinant -1: it mirrors");
  }
  if (T.translation().norm() > kMostLever) {
    findings.warning(where, Findings::text(T.translation().norm()) + " m away from the IMU");
  }
}

// Where the lens model folds: the largest distance from the principal point [focal lengths] that it maps to. Infinite
// where it grows as far as a lens sees.
double reach_of(const CameraCalibration& camera) {
  constexpr double kStep = 0.01;
  const std::array<double, 5>& k = camera.distortion;
  const bool fisheye = camera.lens == LensModel::equidistant;
  const double widest = fisheye ? 1.55 : 20.0;  // an angle [rad], or a tangent
  double reach = 0.0;
  for (double r = kStep; r < widest; r += kStep) {
    const double r2 = r * r;
    const double factor = fisheye ? 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * k[3])))
                                  : 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    if (r * factor <= reach) return reach;
    reach = r * factor;
  }
  return std::numeric_limits<double>::infinity();
}

void check_distortion(const CameraCalibration& camera, const std::string& name, Findings& findings) {
  const std::string where = name + ": distortion_coefficients";
  const std::array<double, 5>& k = camera.distortion;
  if (!std::all_of(k.begin(), k.end(), [](double value) { return std::isfinite(value); })) {
    findings.error(where, "not finite");
    return;
  }
  if (camera.lens == LensModel::equidistant && k[4] != 0.0) {
    findings.error(where, "the equidistant model has four");
    return;
  }
  const double x = std::max(camera.cu, camera.width - 1 - camera.cu) / camera.fu;
  const double y = std::max(camera.cv, camera.height - 1 - camera.cv) / camera.fv;
  const double reach = reach_of(camera);
  if (reach < std::hypot(x, y)) {
    findings.warning(where, "the lens model folds " + Findings::text(std::round(reach * camera.fu)) +
                                " px from the principal point, within the image: is the order " +
                                (camera.lens == LensModel::equidistant ? "k1, k2, k3, k4?" : "k1, k2, p1, p2, k3?"));
  }
}

void check_camera(const CameraCalibration& camera, const std::string& name, Findings& findings) {
  check_pose(camera.T_BC, name + ": T_BS", findings);
  if (camera.T_BC.matrix().isIdentity(1e-9)) {
    findings.warning(name + ": T_BS", "the identity: has it been calibrated?");
  }
  if (camera.width <= 0 || camera.height <= 0) {
    findings.error(name + ": resolution", "not positive");
    return;
  }
  const auto absurd = [&](double focal) {
    return !(focal > kLeastFocal * camera.width && focal < kMostFocal * camera.width);
  };
  if (!(camera.fu > 0.0 && camera.fv > 0.0)) {
    findings.error(name + ": intrinsics", "focal length is not positive");
    return;
  }
  if (absurd(camera.fu) || absurd(camera.fv)) {
    findings.warning(name + ": intrinsics", "focal length " + Findings::text(camera.fu) + " px for an image " +
                                                std::to_string(camera.width) + " px wide");
  } else if (std::abs(camera.fu - camera.fv) > 0.2 * camera.fu) {
    findings.warning(name + ": intrinsics", "focal lengths differ: are these fu, fv, cu, cv?");
  }
  if (!(camera.cu > 0.0 && camera.cu < camera.width && camera.cv > 0.0 && camera.cv < camera.height)) {
    findings.warning(name + ": intrinsics", "principal point lies outside of the image");
    return;
  }
  check_distortion(camera, name, findings);
}

void check_stereo(const CameraCalibration& left, const CameraCalibration& right, Findings& findings) {
  const Eigen::Isometry3d T_C0C1 = left.T_BC.inverse(Eigen::Affine) * right.T_BC;
  const Eigen::Vector3d p_C0C1 = T_C0C1.translation();
  const double baseline = p_C0C1.norm();
  if (baseline < kLeastBaseline) {
    findings.error("cam1: T_BS", "both cameras are at the same place");
    return;
  }
  if (p_C0C1.x() < -0.5 * baseline) {
    findings.error("cam1: T_BS", "cameras are swapped: cam1 lies " + Findings::text(-p_C0C1.x()) + " m left of cam0");
  } else if (p_C0C1.x() < 0.5 * baseline) {
    findings.warning("cam1: T_BS", "cam1 does not lie to the right of cam0");
  }
  if (baseline > kMostBaseline) findings.warning("cam1: T_BS", "baseline of " + Findings::text(baseline) + " m");
  if (T_C0C1.linear()(2, 2) < 0.5) findings.warning("cam1: T_BS", "the cameras look in different directions");
}

void check_imu(const ImuCalibration& imu, Findings& findings) {
  findings.require_positive("imu0: rate_hz", imu.rate_hz);
  findings.require_positive("imu0: gyroscope_noise_density", imu.gyro_noise);
  findings.require_positive("imu0: gyroscope_random_walk", imu.gyro_random_walk);
  findings.require_positive("imu0: accelerometer_noise_density", imu.accel_noise);
  findings.require_positive("imu0: accelerometer_random_walk", imu.accel_random_walk);
}

void check_time_offset(const std::string& where, double offset, Findings& findings) {
  if (!(std::abs(offset) <= kLargestTimeOffset)) {
    findings.error(
        where, Findings::text(offset) + " s: not a number of seconds, at most " + Findings::text(kLargestTimeOffset));
  } else if (std::abs(offset) > kMostTimeOffset) {
    findings.warning(where, Findings::text(offset) + " s");
  }
}

void check_encoder(const EncoderCalibration& encoder, Findings& findings) {
  check_pose(encoder.T_BO, "encoder0: T_BS", findings);
  findings.require_positive("encoder0: resolution", static_cast<double>(encoder.resolution));
  for (const double radius : encoder.wheel_radius) findings.require_positive("encoder0: wheel_radius", radius);
  findings.require_positive("encoder0: wheel_separation", encoder.track_width);
  findings.require_positive("encoder0: noise_counts", encoder.noise_counts);
  check_time_offset("encoder0: timeshift_encoder_imu", encoder.time_offset, findings);
}

void check_lasers(const LaserCalibration& lasers, Findings& findings) {
  for (const LaserBeam& beam : lasers.beams) {
    const double length = beam.d_B.norm();
    if (!(std::abs(length - 1.0) < kRotationTolerance)) {
      findings.error("laser0: beams." + beam.name + ".direction", "length " + Findings::text(length) + ", not 1");
    }
  }
  findings.require_positive("laser0: noise", lasers.noise);
  check_time_offset("laser0: timeshift_laser_imu", lasers.time_offset, findings);
  if (!(lasers.range_min >= 0.0 && lasers.range_min < lasers.range_max)) {
    findings.error("laser0: range", "not [least, most]");
  }
}

}  // namespace

std::vector<Finding> check_calibration(const Calibration& calibration) {
  Findings findings;
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    check_camera(calibration.cameras[i], "cam" + std::to_string(i), findings);
  }
  if (calibration.cameras.size() == 2) check_stereo(calibration.cameras[0], calibration.cameras[1], findings);
  check_time_offset("cam0: timeshift_cam_imu", calibration.camera_time_offset, findings);
  check_imu(calibration.imu, findings);
  if (calibration.encoder) check_encoder(*calibration.encoder, findings);
  if (calibration.lasers) check_lasers(*calibration.lasers, findings);
  return findings.list;
}

std::optional<Finding> check_sensors(const Calibration& calibration) {
  if (!calibration.cameras.empty() || calibration.encoder) return std::nullopt;
  return Finding{Severity::error, "cam0, encoder0",
                 "neither a camera nor wheels: inertial samples and lasers alone do not give an estimate"};
}

}  // namespace ear
