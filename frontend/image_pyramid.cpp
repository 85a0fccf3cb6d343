#include "frontend/image_pyramid.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace ear {
namespace {

constexpr int kSmallest = ImagePyramid::kBorder;  // [px] no level but the first is so narrow or low

// The row of an image that one beyond its edge mirrors, without repeating that at the edge. The same for columns.
int mirrored(int row, int height) {
  if (height == 1) return 0;
  const int period = 2 * (height - 1);
  const int within = ((row % period) + period) % period;
  return std::min(within, period - within);
}

std::uint8_t* row_of(std::uint8_t* origin, const GreyLevel& level, int row) { return origin + row * level.stride; }

// Fills the border from what is inside.
void mirror_edges(const GreyLevel& level, std::uint8_t* origin) {
  for (int row = 0; row < level.height; ++row) {
    std::uint8_t* const first = row_of(origin, level, row);
    std::uint8_t* const last = first + level.width - 1;
    if (level.width > ImagePyramid::kBorder) {
      for (int i = 1; i <= ImagePyramid::kBorder; ++i) {
        first[-i] = first[i];
        last[i] = last[-i];
      }
    } else {
      for (int i = 1; i <= ImagePyramid::kBorder; ++i) {
        first[-i] = first[mirrored(-i, level.width)];
        last[i] = first[mirrored(level.width - 1 + i, level.width)];
      }
    }
  }
  const auto bytes = static_cast<std::size_t>(level.width + 2 * level.border);
  const auto copy = [&](int row) {
    std::memcpy(row_of(origin, level, row) - level.border,
                row_of(origin, level, mirrored(row, level.height)) - level.border, bytes);
  };
  for (int i = 1; i <= level.border; ++i) {
    copy(-i);
    copy(level.height - 1 + i);
  }
}

}  // namespace

bool ImagePyramid::shows(const ImageView& image) const {
  if (levels_.empty() || levels_.front().width != image.width || levels_.front().height != image.height) return false;
  const GreyLevel& base = levels_.front();
  for (std::ptrdiff_t row = 0; row < image.height; ++row) {
    const std::uint8_t* const pixels = image.data + row * image.stride;
    if (!std::equal(pixels, pixels + image.width, base.origin + row * base.stride)) return false;
  }
  return true;
}

void ImagePyramid::allocate(int width, int height) {
  allocated_.clear();
  memory_.clear();
  sums_.assign(static_cast<std::size_t>(width) + 64, 0);
  while (static_cast<int>(allocated_.size()) < max_levels_) {
    GreyLevel level;
    level.width = width;
    level.height = height;
    level.border = kBorder;
    level.stride = (width + 2 * kBorder + 15) / 16 * 16;
    const std::ptrdiff_t rows = height + 2 * kBorder + 2;  // kernels read a row more on either side, see kReadBehind
    memory_.emplace_back(static_cast<std::size_t>(rows * level.stride + kReadBehind));
    level.origin = memory_.back().data() + (1 + kBorder) * level.stride + kBorder;
    allocated_.push_back(level);
    width = (width + 1) / 2;
    height = (height + 1) / 2;
    if (width <= kSmallest || height <= kSmallest) break;
  }
}

void ImagePyramid::build(const ImageView& image) {
  const bool fits =
      !allocated_.empty() && allocated_.front().width == image.width && allocated_.front().height == image.height;
  if (!fits) allocate(image.width, image.height);
  const auto origin_of = [&](std::size_t i) {
    return memory_[i].data() + (1 + kBorder) * allocated_[i].stride + kBorder;
  };
  for (int row = 0; row < image.height; ++row) {
    std::memcpy(row_of(origin_of(0), allocated_[0], row), image.data + row * image.stride,
                static_cast<std::size_t>(image.width));
  }
  mirror_edges(allocated_[0], origin_of(0));
  for (std::size_t i = 1; i < allocated_.size(); ++i) {
    const GreyLevel& finer = allocated_[i - 1];
    for (int row = 0; row < allocated_[i].height; ++row) {
      std::array<const std::uint8_t*, 5> rows{};
      for (int k = 0; k < 5; ++k) rows[static_cast<std::size_t>(k)] = finer.origin + (2 * row + k - 2) * finer.stride;
      kernels_.halve_row(rows, allocated_[i].width, sums_.data(), row_of(origin_of(i), allocated_[i], row));
    }
    mirror_edges(allocated_[i], origin_of(i));
  }
  levels_ = allocated_;
}

}  // namespace ear
