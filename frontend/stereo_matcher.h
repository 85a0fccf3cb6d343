// Finds a feature of the left image in the right one.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/calibration.h"
#include "frontend/image_pyramid.h"
#include "frontend/lens.h"
#include "frontend/reference_patch.h"
#include "frontend/stereo_geometry.h"
#include "frontend/surface_patch.h"

namespace ear {

/// A feature seen by both cameras.
struct StereoMatch {
  Eigen::Vector2d right = Eigen::Vector2d::Zero();  ///< normalized coordinates
  SurfacePatch surface;                             ///< in the left camera; its inverse depth is not negative
};

class StereoMatcher {
 public:
  static constexpr int kLevels = 3;  ///< of the right image's pyramid that are looked at

  /// `nearest_depth` [m]: closer points are not searched for. Features may lie 2.5 px off their epipolar lines; where
  /// the right camera states a standard deviation of its rotation, three of these, if that is more, but 12 px at most.
  StereoMatcher(const CameraCalibration& left, const CameraCalibration& right, double nearest_depth);

  /// Follows a match known from before: starts where `surface` predicts it. Nothing if the patch is not there, off the
  /// epipolar line, or at a very different depth.
  [[nodiscard]] std::optional<StereoMatch> follow(const ImagePyramid& right, const ReferencePatch& patch,
                                                  const Warp& left_warp, const Eigen::Vector2d& left,
                                                  const SurfacePatch& surface) const;

  /// Searches the whole epipolar line. Nothing if the patch is not found, or at two places alike.
  [[nodiscard]] std::optional<StereoMatch> search(const ImagePyramid& right, const ReferencePatch& patch,
                                                  const Warp& left_warp, const Eigen::Vector2d& left) const;

  /// Standard deviation of inverse depth [1/m] that one pixel of disparity makes.
  [[nodiscard]] double inverse_depth_per_pixel() const { return inverse_depth_per_pixel_; }

 private:
  struct Hypothesis {
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    float correlation = -1.0F;
  };

  /// Steps of a search that follow the patch's rows, one of its columns on the level each.
  struct Columns {
    Eigen::Vector2d first;   ///< [px]
    Eigen::Vector2d column;  ///< to the next [px]
    double step;             ///< of inverse depth [1/m]
    bool backwards;          ///< against the order of the columns

    [[nodiscard]] Eigen::Vector2d place(int index) const { return first + index * column; }
    [[nodiscard]] Eigen::Vector2d lowest() const { return backwards ? place(kPatchSize - 1) : first; }
    [[nodiscard]] std::size_t number(int index) const {  ///< from the lowest
      return static_cast<std::size_t>(backwards ? kPatchSize - 1 - index : index);
    }
  };

  /// Sixteen, from `inverse_depth` on; nothing where the epipolar line leads elsewhere.
  [[nodiscard]] std::optional<Columns> columns_from(const Eigen::Vector2d& left, double inverse_depth, const Warp& warp,
                                                    const Eigen::Vector2d& aside, int level) const;

  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector2d& left, double inverse_depth) const;
  [[nodiscard]] std::optional<StereoMatch> accept(const ReferencePatch::Match& match, const Warp& start,
                                                  const Warp& left_warp, const Eigen::Vector2d& left,
                                                  const SurfacePatch& surface) const;

  /// Unit vector across the epipolar line, in the right image.
  [[nodiscard]] Eigen::Vector2d across_line(const Eigen::Vector2d& left) const;

  Lens left_lens_;
  Lens right_lens_;
  double epipolar_band_px_;
  Transfer right_from_left_;
  double max_inverse_depth_;
  double inverse_depth_per_pixel_;
};

}  // namespace ear
