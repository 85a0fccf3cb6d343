#include "frontend/image_pyramid.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace ear {
namespace {

constexpr int kSmallest = ImagePyramid::kBorder;  // [px] no level but the first is so narrow or low
constexpr int kBand = 32;                         // rows; the last one of a level is higher, up to twice
static_assert(kBand > ImagePyramid::kBorder, "a border mirrors one band");
static_assert(ImagePyramid::kBorder % 8 == 0, "mirrored in eights");

// The row of an image that one beyond its edge mirrors, without repeating that at the edge. The same for columns.
int mirrored(int row, int height) {
  if (height == 1) return 0;
  const int period = 2 * (height - 1);
  const int within = ((row % period) + period) % period;
  return std::min(within, period - within);
}

// Rows, or bands of them, from `first` to before `end`.
struct Range {
  int first, end;
};

int bands_of(int height) { return std::max(1, height / kBand); }

Range rows_of(int band, int height) {
  return {band * kBand, band + 1 == bands_of(height) ? height : (band + 1) * kBand};
}

// The bands that are seen from row `first` to `last`, also by way of the border.
Range bands_seen(int first, int last, int height) {
  const auto inside = [&](int row) { return std::clamp(row, 0, height - 1); };
  const int highest = std::min(inside(first), last >= height ? inside(2 * (height - 1) - last) : height - 1);
  const int lowest = std::max(inside(last), first < 0 ? inside(-first) : 0);
  const auto band = [&](int row) { return std::min(row / kBand, bands_of(height) - 1); };
  return {band(highest), band(lowest) + 1};
}

std::uint8_t* row_of(std::uint8_t* origin, const GreyLevel& level, int row) { return origin + row * level.stride; }

// Eight pixels in the reverse order.
void copy_reversed(const std::uint8_t* from, std::uint8_t* to) {
  std::uint64_t eight = 0;
  std::memcpy(&eight, from, sizeof(eight));
  eight = __builtin_bswap64(eight);
  std::memcpy(to, &eight, sizeof(eight));
}

// Fills the border that mirrors these rows.
void mirror_edges(const GreyLevel& level, std::uint8_t* origin, const Range& rows) {
  constexpr int kBorder = ImagePyramid::kBorder;
  for (int row = rows.first; row < rows.end; ++row) {
    std::uint8_t* const first = row_of(origin, level, row);
    std::uint8_t* const last = first + level.width - 1;
    if (level.width > kBorder) {
      for (int i = 1; i <= kBorder; i += 8) {
        copy_reversed(first + i, first - i - 7);
        copy_reversed(last - i - 7, last + i);
      }
    } else {
      for (int i = 1; i <= kBorder; ++i) {
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
  for (int i = 1; rows.first == 0 && i <= level.border; ++i) copy(-i);
  for (int i = 1; rows.end == level.height && i <= level.border; ++i) copy(level.height - 1 + i);
}

}  // namespace

bool ImagePyramid::shows(const ImageView& image) const {
  if (!built_ || levels_.front().width != image.width || levels_.front().height != image.height) return false;
  const GreyLevel& base = levels_.front();
  for (std::ptrdiff_t row = 0; row < image.height; ++row) {
    const std::uint8_t* const pixels = image.data + row * image.stride;
    if (!std::equal(pixels, pixels + image.width, base.origin + row * base.stride)) return false;
  }
  return true;
}

void ImagePyramid::allocate(int width, int height) {
  levels_.clear();
  while (static_cast<int>(levels_.size()) < max_levels_) {
    Level level;
    level.width = width;
    level.height = height;
    level.border = kBorder;
    level.stride = (width + 2 * kBorder + 15) / 16 * 16;
    const std::ptrdiff_t rows = height + 2 * kBorder + 3;  // kernels read more than they use, see kReadBehind
    level.memory.resize(static_cast<std::size_t>(rows * level.stride + kReadBehind));
    level.origin = level.memory.data() + (1 + kBorder) * level.stride + kBorder;
    level.made.resize(static_cast<std::size_t>(bands_of(height)));
    levels_.push_back(std::move(level));
    width = (width + 1) / 2;
    height = (height + 1) / 2;
    if (width <= kSmallest || height <= kSmallest) break;
  }
}

void ImagePyramid::build(const ImageView& image) {
  const bool fits = !levels_.empty() && levels_.front().width == image.width && levels_.front().height == image.height;
  if (!fits) allocate(image.width, image.height);
  const Level& base = levels_.front();
  for (int row = 0; row < image.height; ++row) {
    std::memcpy(row_of(base.pixels(), base, row), image.data + row * image.stride,
                static_cast<std::size_t>(image.width));
  }
  mirror_edges(base, base.pixels(), {0, image.height});
  std::fill(base.made.begin(), base.made.end(), std::uint8_t{1});
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    std::fill(levels_[i].made.begin(), levels_[i].made.end(), std::uint8_t{0});
  }
  built_ = true;
}

const GreyLevel& ImagePyramid::level(int index) const {
  return level(index, 0, levels_[static_cast<std::size_t>(index)].height - 1);
}

const GreyLevel& ImagePyramid::level(int index, int first, int last) const {
  const auto i = static_cast<std::size_t>(index);
  const Level& level = levels_[i];
  if (index == 0) return level;
  const Range bands = bands_seen(first, last, level.height);
  for (auto band = static_cast<std::size_t>(bands.first); band < static_cast<std::size_t>(bands.end); ++band) {
    if (level.made[band] == 0) make(i, band);
  }
  return level;
}

void ImagePyramid::make(std::size_t index, std::size_t band) const {
  constexpr int kReach = 2;  // of the filter, on the finer level
  const Level& out = levels_[index];
  const Range rows = rows_of(static_cast<int>(band), out.height);
  const GreyLevel& finer = level(static_cast<int>(index) - 1, 2 * rows.first - kReach, 2 * (rows.end - 1) + kReach);
  kernels_.halve(finer.origin + 2 * rows.first * finer.stride, finer.stride, out.width, rows.end - rows.first,
                 row_of(out.pixels(), out, rows.first), out.stride);
  mirror_edges(out, out.pixels(), rows);
  out.made[band] = 1;
}

}  // namespace ear
