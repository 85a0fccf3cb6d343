#include "frontend/fast_corners.h"

#include <algorithm>
#include <cstring>

namespace ear {
namespace {

constexpr int kBlock = 32;  // the kernel writes whole blocks

bool peak(const std::uint8_t* score, std::ptrdiff_t stride) {
  const int s = *score;
  return s > score[-1] && s > score[1] && s > score[-stride - 1] && s > score[-stride] && s > score[1 - stride] &&
         s > score[stride - 1] && s > score[stride] && s > score[stride + 1];
}

constexpr int kWord = 8;  // scores that are looked at in one

// Is one of them at least `threshold`, which is from 1 to 128?
bool any_reaches(const std::uint8_t* scores, int threshold) {
  constexpr std::uint64_t kOnes = 0x0101010101010101U;
  std::uint64_t word = 0;
  std::memcpy(&word, scores, kWord);
  const std::uint64_t lower = (word & (0x7f * kOnes)) + static_cast<std::uint64_t>(128 - threshold) * kOnes;
  return ((lower | word) & (0x80 * kOnes)) != 0;
}

// Of equal ones the lower right one.
bool weaker(const FastCorner& a, const FastCorner& b) {
  if (a.score != b.score) return a.score < b.score;
  return a.v != b.v ? a.v > b.v : a.u > b.u;
}

}  // namespace

void FastCorners::find(const ImagePyramid& pyramid, const PixelArea& area, int threshold) {
  const GreyLevel& image = pyramid.level(0);
  const std::ptrdiff_t stride = (area.width + kBlock - 1) / kBlock * kBlock + 2;
  scores_.assign(static_cast<std::size_t>(stride * (area.height + 2)), 0);
  std::uint8_t* const first = scores_.data() + stride + 1;
  for (int row = 0; row < area.height; ++row) {
    std::uint8_t* const out = first + row * stride;
    pyramid.kernels().corner_scores(image.origin + (area.top + row) * image.stride + area.left, image.stride,
                                    area.width, threshold, out);
    std::fill(out + area.width, out + stride - 1, std::uint8_t{0});
  }
  found_.clear();
  found_.reserve(static_cast<std::size_t>((area.width + 1) / 2 * ((area.height + 1) / 2)));  // no two are neighbours
  for (int row = 0; row < area.height; ++row) {
    const std::uint8_t* const score = first + row * stride;
    for (int from = 0; from < area.width; from += kWord) {  // most words have no corner; zeros follow the last one
      if (!any_reaches(score + from, std::min(threshold, 128))) continue;
      for (int column = from; column < std::min(from + kWord, area.width); ++column) {
        if (score[column] < threshold || !peak(score + column, stride)) continue;
        found_.push_back({area.left + column, area.top + row, score[column]});
      }
    }
  }
  std::make_heap(found_.begin(), found_.end(), weaker);
}

std::optional<FastCorner> FastCorners::take_strongest() {
  if (found_.empty()) return std::nullopt;
  std::pop_heap(found_.begin(), found_.end(), weaker);
  const FastCorner strongest = found_.back();
  found_.pop_back();
  return strongest;
}

}  // namespace ear
