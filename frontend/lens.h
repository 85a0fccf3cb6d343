// The lens of one camera: pixels to rays and back.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/calibration.h"

namespace ear {

using LensCoefficients = Eigen::Matrix<double, 5, 1>;  // in the order of CameraCalibration::distortion

/// Maps between pixels and normalized image coordinates (x/z, y/z), which have no lens in them.
class Lens {
 public:
  /// Throws std::invalid_argument if size, focal length or a coefficient makes no sense.
  explicit Lens(const CameraCalibration& camera);

  /// The ray through a pixel; nothing where the lens model has no inverse or the ray does not point forward.
  [[nodiscard]] std::optional<Eigen::Vector2d> to_normalized(const Eigen::Vector2d& pixel) const;

  /// The pixel [px] that sees the ray; nothing outside the range in which the lens model is one-to-one.
  /// The pixel may lie outside the image.
  [[nodiscard]] std::optional<Eigen::Vector2d> to_pixel(const Eigen::Vector2d& normalized) const;

  struct Projection {
    Eigen::Vector2d pixel;        ///< [px]
    Eigen::Matrix2d J_pixel_ray;  ///< by the normalized coordinates [px]
  };

  /// to_pixel() and its derivative.
  [[nodiscard]] std::optional<Projection> project(const Eigen::Vector2d& normalized) const;

  /// Mean focal length [px]: turns small distances in normalized coordinates into pixels.
  [[nodiscard]] double focal_px() const { return 0.5 * (focal_.x() + focal_.y()); }

 private:
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort_radial_tangential(const Eigen::Vector2d& distorted) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort_equidistant(const Eigen::Vector2d& distorted) const;

  LensModel model_;
  Eigen::Vector2d focal_;
  Eigen::Vector2d centre_;
  LensCoefficients k_;
  double max_radius_ =
      0.0;  // of a normalized point (radial-tangential) or angle [rad] (equidistant): the model folds beyond
};

}  // namespace ear
