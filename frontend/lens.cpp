#include "frontend/lens.h"

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

namespace ear {
namespace {

constexpr int kMaxNewtonSteps = 20;
// In normalized coordinates. A step's error is of the order of its square: far below a millionth of a pixel.
constexpr double kNewtonTolerance = 1e-6;
constexpr double kMaxTangent = 20.0;  // rays flatter than 87 degrees have no usable x/z

struct Distorted {
  Eigen::Vector2d value;
  Eigen::Matrix2d J_value_point;
};

// Brown's model with three radial and two tangential coefficients (k1, k2, p1, p2, k3), and its derivative.
Distorted distort(const LensCoefficients& k, const Eigen::Vector2d& p) {
  const double x = p.x();
  const double y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double radial_slope = 2.0 * (k[0] + r2 * (2.0 * k[1] + 3.0 * r2 * k[4]));  // d radial / d r2, times 2
  Distorted d;
  d.value.x() = x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x);
  d.value.y() = y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y;
  const double mixed = x * y * radial_slope + 2.0 * k[2] * x + 2.0 * k[3] * y;
  d.J_value_point << radial + x * x * radial_slope + 2.0 * k[2] * y + 6.0 * k[3] * x, mixed, mixed,
      radial + y * y * radial_slope + 6.0 * k[2] * y + 2.0 * k[3] * x;
  return d;
}

// Distorted angle and its derivative, Kannala-Brandt.
struct DistortedAngle {
  double value;
  double slope;
};

DistortedAngle distort_angle(const LensCoefficients& k, double a) {
  const double a2 = a * a;
  return {a * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))),
          1.0 + a2 * (3.0 * k[0] + a2 * (5.0 * k[1] + a2 * (7.0 * k[2] + a2 * 9.0 * k[3])))};
}

// Largest radius (or angle) up to which the radial part of the model grows.
double find_max_radius(LensModel model, const LensCoefficients& k) {
  constexpr double kStep = 0.01;
  const double limit = model == LensModel::equidistant ? std::atan(kMaxTangent) : kMaxTangent;
  double radius = kStep;
  for (; radius < limit; radius += kStep) {
    const double r2 = radius * radius;
    const double slope = model == LensModel::equidistant
                             ? distort_angle(k, radius).slope
                             : 1.0 + r2 * (3.0 * k[0] + r2 * (5.0 * k[1] + r2 * 7.0 * k[4]));
    if (slope <= 0.0) break;
  }
  return radius - kStep;
}

}  // namespace

Lens::Lens(const CameraCalibration& camera)
    : model_(camera.lens), focal_(camera.fu, camera.fv), centre_(camera.cu, camera.cv), k_(camera.distortion.data()) {
  if (camera.width <= 0 || camera.height <= 0) throw std::invalid_argument("camera: resolution must be positive");
  if (!focal_.allFinite() || focal_.minCoeff() <= 0.0) {
    throw std::invalid_argument("camera: focal lengths must be positive");
  }
  if (!centre_.allFinite() || !k_.allFinite()) throw std::invalid_argument("camera: intrinsics must be finite");
  if (model_ == LensModel::equidistant && k_[4] != 0.0) {
    throw std::invalid_argument("camera: distortion: the equidistant model has four coefficients, the fifth is not 0");
  }
  max_radius_ = find_max_radius(model_, k_);
}

std::optional<Eigen::Vector2d> Lens::to_normalized(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d distorted = (pixel - centre_).cwiseQuotient(focal_);
  return model_ == LensModel::equidistant ? undistort_equidistant(distorted) : undistort_radial_tangential(distorted);
}

std::optional<Eigen::Vector2d> Lens::to_pixel(const Eigen::Vector2d& normalized) const {
  const double radius = normalized.norm();
  Eigen::Vector2d distorted;
  if (model_ == LensModel::equidistant) {
    const double angle = std::atan(radius);
    if (!(angle <= max_radius_)) return std::nullopt;
    const double scale = radius > 1e-9 ? distort_angle(k_, angle).value / radius : 1.0;
    distorted = scale * normalized;
  } else {
    if (!(radius <= max_radius_)) return std::nullopt;
    distorted = distort(k_, normalized).value;
  }
  return distorted.cwiseProduct(focal_) + centre_;
}

std::optional<Lens::Projection> Lens::project(const Eigen::Vector2d& normalized) const {
  const double radius2 = normalized.squaredNorm();
  Distorted d;
  if (model_ == LensModel::equidistant) {
    const double radius = std::sqrt(radius2);
    const double angle = std::atan(radius);
    if (!(angle <= max_radius_)) return std::nullopt;
    const DistortedAngle distorted = distort_angle(k_, angle);
    const double scale = radius > 1e-9 ? distorted.value / radius : 1.0;
    const double slope = distorted.slope / (1.0 + radius2);  // by the radius
    const Eigen::Vector2d direction = radius > 1e-9 ? Eigen::Vector2d(normalized / radius) : Eigen::Vector2d::Zero();
    d.value = scale * normalized;
    d.J_value_point = scale * Eigen::Matrix2d::Identity() + (slope - scale) * direction * direction.transpose();
  } else {
    if (!(radius2 <= max_radius_ * max_radius_)) return std::nullopt;
    d = distort(k_, normalized);
  }
  return Projection{d.value.cwiseProduct(focal_) + centre_, focal_.asDiagonal() * d.J_value_point};
}

std::optional<Eigen::Vector2d> Lens::undistort_radial_tangential(const Eigen::Vector2d& distorted) const {
  Eigen::Vector2d point = distorted;
  for (int step = 0; step < kMaxNewtonSteps; ++step) {
    const Distorted d = distort(k_, point);
    const Eigen::Vector2d change = d.J_value_point.inverse() * (distorted - d.value);
    point += change;
    if (!(point.squaredNorm() <= max_radius_ * max_radius_)) return std::nullopt;
    if (change.squaredNorm() < kNewtonTolerance * kNewtonTolerance) return point;
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> Lens::undistort_equidistant(const Eigen::Vector2d& distorted) const {
  const double radius = distorted.norm();
  if (radius < 1e-9) return distorted;
  double angle = std::min(radius, max_radius_);
  for (int step = 0; step < kMaxNewtonSteps; ++step) {
    const DistortedAngle d = distort_angle(k_, angle);
    const double change = (radius - d.value) / d.slope;
    angle += change;
    if (!(angle >= 0.0 && angle <= max_radius_)) return std::nullopt;
    if (std::abs(change) < kNewtonTolerance) return (std::tan(angle) / radius) * distorted;
  }
  return std::nullopt;
}

}  // namespace ear
