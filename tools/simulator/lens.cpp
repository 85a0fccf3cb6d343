#include "tools/simulator/lens.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace ear::simulator {
namespace {

constexpr double kNearestDepth = 0.02;  // [m] in front of the camera
constexpr double kWidest = 2.0;  // |x|, |y| of a ray: far outside the picture, where the polynomials mean nothing

Eigen::Vector2d bend_radial_tangential(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double r2 = p.squaredNorm();
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {p.x() * radial + 2.0 * k[2] * p.x() * p.y() + k[3] * (r2 + 2.0 * p.x() * p.x()),
          p.y() * radial + k[2] * (r2 + 2.0 * p.y() * p.y()) + 2.0 * k[3] * p.x() * p.y()};
}

Eigen::Vector2d bend_equidistant(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double r = p.norm();
  if (r < 1e-12) return p;
  const double angle = std::atan(r);
  const double a2 = angle * angle;
  return angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / r * p;
}

Eigen::Vector2d bend(const CameraCalibration& camera, const Eigen::Vector2d& normalized) {
  return camera.lens == LensModel::equidistant ? bend_equidistant(camera.distortion, normalized)
                                               : bend_radial_tangential(camera.distortion, normalized);
}

}  // namespace

Eigen::Vector2d to_pixel(const CameraCalibration& camera, const Eigen::Vector2d& normalized) {
  const Eigen::Vector2d bent = bend(camera, normalized);
  return {camera.fu * bent.x() + camera.cu, camera.fv * bent.y() + camera.cv};
}

Eigen::Vector2d to_ray(const CameraCalibration& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d bent((pixel.x() - camera.cu) / camera.fu, (pixel.y() - camera.cv) / camera.fv);
  constexpr double kStep = 1e-6;
  Eigen::Matrix2d J;
  J.col(0) = (bend(camera, bent + Eigen::Vector2d(kStep, 0.0)) - bend(camera, bent - Eigen::Vector2d(kStep, 0.0))) /
             (2.0 * kStep);
  J.col(1) = (bend(camera, bent + Eigen::Vector2d(0.0, kStep)) - bend(camera, bent - Eigen::Vector2d(0.0, kStep))) /
             (2.0 * kStep);
  const Eigen::Matrix2d J_inverse = J.inverse();
  Eigen::Vector2d ray = bent;
  for (int i = 0; i < 50; ++i) {  // chords: one derivative serves all steps
    const Eigen::Vector2d step = J_inverse * (bend(camera, ray) - bent);
    ray -= step;
    if (step.squaredNorm() < 1e-26) break;
  }
  return ray;
}

std::optional<Eigen::Vector2d> project(const CameraCalibration& camera, const Eigen::Vector3d& p_C, double margin) {
  if (p_C.z() < kNearestDepth) return std::nullopt;
  const Eigen::Vector2d ray = p_C.head<2>() / p_C.z();
  if (ray.cwiseAbs().maxCoeff() > kWidest) return std::nullopt;
  const Eigen::Vector2d pixel = to_pixel(camera, ray);
  const bool inside = pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= camera.width - 1 - margin &&
                      pixel.y() <= camera.height - 1 - margin;
  return inside ? std::optional(pixel) : std::nullopt;
}

void change_lenses(const std::vector<CameraCalibration>& from, const std::vector<CameraCalibration>& to,
                   FeatureFrame& frame) {
  const auto intrinsics = [](const CameraCalibration& c) {
    return std::tie(c.lens, c.fu, c.fv, c.cu, c.cv, c.distortion);
  };
  const std::size_t cameras = std::min({from.size(), to.size(), std::size_t{2}});
  for (std::size_t camera = 0; camera < cameras; ++camera) {
    if (intrinsics(from[camera]) == intrinsics(to[camera])) continue;
    for (FeatureObservation& feature : frame.features) {
      if (camera == 1 && !feature.has_right) continue;
      Eigen::Vector2d& seen = camera == 0 ? feature.left : feature.right;
      seen = to_ray(to[camera], to_pixel(from[camera], seen));
    }
  }
}

}  // namespace ear::simulator
