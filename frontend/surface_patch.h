// The small flat piece of surface that a feature's patch lies on: how it looks from another camera.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "frontend/lens.h"
#include "frontend/patch.h"
#include "frontend/stereo_geometry.h"

namespace ear {

/// The plane of all points X of a camera's frame with n . X = 1. A surface patch at infinity has n = 0.
struct SurfacePatch {
  Eigen::Vector3d n = Eigen::Vector3d::Zero();  ///< [1/m]

  /// The plane through the point of `inverse_depth` [1/m] on `ray`; along other rays the inverse depth changes by
  /// `gradient` per unit of normalized coordinates. A gradient of 0 faces the camera; one that only a plane seen almost
  /// edge-on would have is shortened.
  [[nodiscard]] static SurfacePatch through(const Eigen::Vector2d& ray, double inverse_depth,
                                            const Eigen::Vector2d& gradient = Eigen::Vector2d::Zero());

  /// 1/z of the plane's point on a ray [1/m].
  [[nodiscard]] double inverse_depth(const Eigen::Vector2d& ray) const { return n.dot(ray.homogeneous()); }

  [[nodiscard]] Eigen::Vector2d gradient() const { return n.head<2>(); }

  /// The same surface patch in another camera, which sees at `found` what this one sees at `ray`.
  [[nodiscard]] SurfacePatch seen_after(const Transfer& motion, const Eigen::Vector2d& ray,
                                        const Eigen::Vector2d& found) const;
};

/// What is known of a patch in one camera, carried over to another one that sees the same surface patch: a homography,
/// taken apart at the patch's centre. `ray` is the centre's own. Nothing if the surface patch is not before the other
/// camera.
[[nodiscard]] std::optional<Warp> carry_over(const Warp& warp, const Eigen::Vector2d& ray, const SurfacePatch& surface,
                                             const Transfer& motion, const Lens& from, const Lens& to);

}  // namespace ear
