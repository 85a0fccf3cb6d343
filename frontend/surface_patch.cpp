#include "frontend/surface_patch.h"

#include <Eigen/LU>

namespace ear {
namespace {

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
  const Eigen::Vector3d point = H * ray.homogeneous();
  if (!(point.z() > kMinDepthRatio)) return std::nullopt;
  const Eigen::Vector2d other_ray = point.hnormalized();
  const auto other = to.project(other_ray);
  if (!other) return std::nullopt;
  Warp carried{other->pixel.cast<float>(), warp.affine, warp.perspective};

  const auto own = from.project(ray);
  if (!own || !(own->J_pixel_ray.determinant() > 0.0)) return carried;
  const Eigen::Matrix2d J_ray_pixel = own->J_pixel_ray.inverse();
  const Eigen::RowVector2d slope = H.row(2).head<2>() / point.z();  // of the depth's ratio, along the ray
  const Eigen::Matrix2d J_ray_ray = H.topLeftCorner<2, 2>() / point.z() - other_ray * slope;
  const Eigen::Vector2d perspective = (slope * J_ray_pixel).transpose();
  carried.affine = (other->J_pixel_ray * J_ray_ray * J_ray_pixel).cast<float>() * warp.affine;
  carried.perspective += warp.affine.transpose() * perspective.cast<float>();
  return carried;
}

}  // namespace ear
