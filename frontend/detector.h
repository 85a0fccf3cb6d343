// New features where there are none: FAST corners in the emptiest cells of a grid, ranked by how well they can be
// tracked.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "frontend/fast_corners.h"
#include "frontend/image_pyramid.h"

namespace ear {

/// A place where a feature could be tracked.
struct Corner {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float strength = 0.0F;  ///< smaller eigenvalue of the structure matrix of its surrounding [grey^2]
};

class Detector {
 public:
  /// Cells are square, about as many as features are wanted.
  Detector(int width, int height, int max_features);

  /// Up to `wanted` corners, far enough from each other and from the `taken` pixels; emptiest cells first, and in turn.
  /// Valid until the next call. Asks for no memory once every cell was searched.
  [[nodiscard]] const std::vector<Corner>& detect(const ImagePyramid& pyramid,
                                                  const std::vector<Eigen::Vector2f>& taken, int wanted);

 private:
  void count_per_cell(const std::vector<Eigen::Vector2f>& pixels);
  [[nodiscard]] PixelArea area_of(std::size_t cell) const;
  [[nodiscard]] std::optional<Corner> best_in_cell(const ImagePyramid& pyramid, std::size_t cell);

  int width_;
  int height_;
  int columns_ = 1;
  int rows_ = 1;
  float cell_ = 1.0F;          // [px]
  float min_distance_ = 1.0F;  // [px]
  std::size_t next_ = 0;       // cell to begin with: a different one each time
  FastCorners fast_;
  // Kept for their memory.
  std::vector<int> count_;
  std::vector<Eigen::Vector2f> occupied_;
  std::vector<Corner> corners_;
};

}  // namespace ear
