// A grey image at several resolutions, with a border around each so that patches may reach over the edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ear/types.h"
#include "frontend/grey_level.h"
#include "frontend/image_kernels.h"

namespace ear {

/// Only the image itself is copied when it comes. The levels above it are made in bands of rows, when somebody asks for
/// them, and hold what they would hold if they were made as a whole.
class ImagePyramid {
 public:
  static constexpr int kMaxLevels = 4;  ///< the image and three halvings; small images have fewer
  static constexpr int kBorder = 16;    ///< [px] on every level

  /// `levels`: at most so many are built.
  explicit ImagePyramid(const ImageKernels& kernels = image_kernels(Kernels::best), int levels = kMaxLevels)
      : kernels_(kernels), max_levels_(levels) {}
  ImagePyramid(ImagePyramid&&) = default;
  ImagePyramid& operator=(ImagePyramid&&) = default;

  /// Copies the image. Memory is kept from one image to the next.
  void build(const ImageView& image);

  /// Was it built from this very image, byte for byte? What lies between the rows of either does not count.
  [[nodiscard]] bool shows(const ImageView& image) const;

  /// As before the first image.
  void clear() { built_ = false; }

  [[nodiscard]] int top_level() const { return built_ ? static_cast<int>(levels_.size()) - 1 : -1; }

  /// As a whole.
  [[nodiscard]] const GreyLevel& level(int index) const;

  /// Good for reading the rows from `first` to `last`, both included; those beyond the border are not there.
  [[nodiscard]] const GreyLevel& level(int index, int first, int last) const;

  /// What it was built with, and patches of it are.
  [[nodiscard]] const ImageKernels& kernels() const { return kernels_; }

 private:
  struct Level : GreyLevel {
    std::vector<std::uint8_t> memory;
    mutable std::vector<std::uint8_t> made;  // a flag for each band
    [[nodiscard]] std::uint8_t* pixels() const { return const_cast<std::uint8_t*>(origin); }
  };

  void allocate(int width, int height);
  void make(std::size_t index, std::size_t band) const;

  ImageKernels kernels_;
  int max_levels_;
  bool built_ = false;
  std::vector<Level> levels_;  // for images of the size that was there last
};

}  // namespace ear
