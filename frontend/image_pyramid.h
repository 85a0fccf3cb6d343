// A grey image at several resolutions, with a border around each so that patches may reach over the edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "ear/types.h"

namespace ear {

/// One level of a pyramid. A pixel (u, v) of the image is at (u, v) / 2^level here.
struct GreyLevel {
  const std::uint8_t* origin = nullptr;  ///< pixel (0, 0)
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;
  int border = 0;  ///< mirrored pixels that may be read on each side
};

class ImagePyramid {
 public:
  static constexpr int kMaxLevels = 4;  ///< the image and three halvings; small images have fewer
  static constexpr int kBorder = 16;    ///< [px] on every level

  /// Copies the image and builds all levels. Memory is kept from one image to the next.
  void build(const ImageView& image);

  /// Was it built from this very image, byte for byte? What lies between the rows of either does not count.
  [[nodiscard]] bool shows(const ImageView& image) const;

  /// As before the first image.
  void clear() { levels_.clear(); }

  [[nodiscard]] int top_level() const { return static_cast<int>(levels_.size()) - 1; }

  [[nodiscard]] const GreyLevel& level(int index) const { return levels_[static_cast<std::size_t>(index)]; }

  /// The image itself, for library calls.
  [[nodiscard]] const cv::Mat& image() const { return mats_.front(); }

 private:
  std::vector<cv::Mat> mats_;
  std::vector<GreyLevel> levels_;
};

}  // namespace ear
