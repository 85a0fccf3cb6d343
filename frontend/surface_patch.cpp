#include "frontend/surface_patch.h"

#include <Eigen/LU>

namespace ear {
namespace {

constexpr double kStepPx = 4.0;          // of finite differences through the lenses
constexpr double kMinDepthRatio = 1e-3;  // of a point's depths in the two cameras
constexpr double kMinHeightRatio = 0.1;  // of the cameras' heights above a surface patch: closer, it is seen edge-on
constexpr double kSteepest = 20.0;       // largest gradient of inverse depth over itself: seen at 3 degrees

}  // namespace

SurfacePatch SurfacePatch::through(const Eigen::Vector2d& ray, double inverse_depth, const Eigen::Vector2d& gradient) {
  const double length = gradient.norm();
  const double longest = kSteepest * inverse_depth;
  const Eigen::Vector2d g = length > longest ? Eigen::Vector2d(gradient * (longest / length)) : gradient;
  return {{g.x(), g.y(), inverse_depth - g.dot(ray)}};
}

// n . X = 1 and X1 = R X + p give (R n) . X1 = 1 + (R n) . p.
SurfacePatch SurfacePatch::seen_after(const Transfer& motion, const Eigen::Vector2d& ray,
                                      const Eigen::Vector2d& found) const {
  const double before = inverse_depth(ray);
  const double after = before / motion.scaled_point(ray, before).z();
  const Eigen::Vector3d turned = motion.R_10 * n;
  const double height_ratio = 1.0 + turned.dot(motion.p_10);
  if (!(height_ratio > kMinHeightRatio)) return through(found, after);
  return through(found, after, turned.head<2>() / height_ratio);
}

std::optional<Warp> carry_over(const Warp& warp, const Eigen::Vector2d& ray, const SurfacePatch& surface,
                               const Transfer& motion, const Lens& from, const Lens& to) {
  const Eigen::Matrix3d H = motion.R_10 + motion.p_10 * surface.n.transpose();
  const auto move = [&](const Eigen::Vector2d& x) -> std::optional<Eigen::Vector2d> {
    const Eigen::Vector3d point = H * x.homogeneous();
    if (!(point.z() > kMinDepthRatio)) return std::nullopt;
    return to.to_pixel(point.hnormalized());
  };
  const auto centre = move(ray);
  if (!centre) return std::nullopt;
  Warp carried{centre->cast<float>(), warp.affine, warp.perspective};

  const Eigen::Vector2d pixel = warp.centre.cast<double>();
  const auto ray_right = from.to_normalized(pixel + Eigen::Vector2d(kStepPx, 0.0));
  const auto ray_below = from.to_normalized(pixel + Eigen::Vector2d(0.0, kStepPx));
  if (!ray_right || !ray_below) return carried;
  const auto right = move(*ray_right);
  const auto below = move(*ray_below);
  if (!right || !below) return carried;

  Eigen::Matrix2d J_ray_pixel;
  J_ray_pixel << (*ray_right - ray) / kStepPx, (*ray_below - ray) / kStepPx;
  const Eigen::Vector2d perspective =
      J_ray_pixel.transpose() * H.row(2).head<2>().transpose() / H.row(2).dot(ray.homogeneous());
  Eigen::Matrix2d J;  // the differences are shortened by the perspective
  J << (*right - *centre) * (1.0 / kStepPx + perspective.x()), (*below - *centre) * (1.0 / kStepPx + perspective.y());
  carried.affine = J.cast<float>() * warp.affine;
  carried.perspective += warp.affine.transpose() * perspective.cast<float>();
  return carried;
}

}  // namespace ear
