// A grey image at several resolutions, with a border around each so that patches may reach over the edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ear/types.h"
#include "frontend/grey_level.h"
#include "frontend/image_kernels.h"

namespace ear {

class ImagePyramid {
 public:
  static constexpr int kMaxLevels = 4;  ///< the image and three halvings; small images have fewer
  static constexpr int kBorder = 16;    ///< [px] on every level

  /// `levels`: at most so many are built.
  explicit ImagePyramid(const ImageKernels& kernels = image_kernels(Kernels::best), int levels = kMaxLevels)
      : kernels_(kernels), max_levels_(levels) {}
  ImagePyramid(ImagePyramid&&) = default;
  ImagePyramid& operator=(ImagePyramid&&) = default;

  /// Copies the image and builds all levels. Memory is kept from one image to the next.
  void build(const ImageView& image);

  /// Was it built from this very image, byte for byte? What lies between the rows of either does not count.
  [[nodiscard]] bool shows(const ImageView& image) const;

  /// As before the first image.
  void clear() { levels_.clear(); }

  [[nodiscard]] int top_level() const { return static_cast<int>(levels_.size()) - 1; }

  [[nodiscard]] const GreyLevel& level(int index) const { return levels_[static_cast<std::size_t>(index)]; }

  /// What it was built with, and patches of it are.
  [[nodiscard]] const ImageKernels& kernels() const { return kernels_; }

 private:
  void allocate(int width, int height);

  ImageKernels kernels_;
  int max_levels_;
  std::vector<GreyLevel> levels_;     // none before the first image
  std::vector<GreyLevel> allocated_;  // for images of the size that was there last
  std::vector<std::vector<std::uint8_t>> memory_;
  std::vector<std::uint16_t> sums_;  // of a row
};

}  // namespace ear
