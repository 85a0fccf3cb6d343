// The simulated lenses: from rays to pixels and back. Pixel (0, 0) is the centre of the first pixel.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear::simulator {

/// Pixel of the ray (x, y, 1) in the camera's frame.
[[nodiscard]] Eigen::Vector2d to_pixel(const CameraCalibration& camera, const Eigen::Vector2d& normalized);

/// The ray (x, y, 1) that reaches this pixel: the inverse of `to_pixel`, to 1e-12.
[[nodiscard]] Eigen::Vector2d to_ray(const CameraCalibration& camera, const Eigen::Vector2d& pixel);

/// Pixel of a point in the camera's frame, or nothing when it is behind the camera or not within the picture
/// (at least `margin` pixels from the outermost pixel centres).
[[nodiscard]] std::optional<Eigen::Vector2d> project(const CameraCalibration& camera, const Eigen::Vector3d& p_C,
                                                     double margin = 0.0);

/// Features that were normalized with the lenses `from`, as who has `to` normalizes their pixels. Cameras whose
/// lens is the same keep their bits.
void change_lenses(const std::vector<CameraCalibration>& from, const std::vector<CameraCalibration>& to,
                   FeatureFrame& frame);

}  // namespace ear::simulator
