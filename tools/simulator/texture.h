// A grey picture on a panel, with smaller copies of itself, so that far surfaces do not flicker.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "tools/simulator/lanes.h"

namespace ear::simulator {

class Texture {
 public:
  /// base: 8-bit grey, first row at the panel's v = 0; texel: edge of a base pixel on the panel [m].
  Texture(const cv::Mat& base, double texel);

  /// Of level 0, the base. Each further level has pixels of twice the size.
  [[nodiscard]] float pixels_per_metre() const { return levels_.front().per_metre; }

  /// Level whose pixels have this size [m], a real number.
  [[nodiscard]] float level_of(float size) const { return std::log2(std::max(1e-6F, size * pixels_per_metre())); }

  /// The level that serves a real one: the next below, within those that there are.
  [[nodiscard]] int whole(float level) const {
    return std::clamp(static_cast<int>(level), 0, static_cast<int>(levels_.size()) - 1);
  }

  /// Bilinear values at (a, b) [m] of the panel on one whole level; beyond the border the border's.
  [[nodiscard]] Lanes at(const Lanes& a, const Lanes& b, int level) const {
    using Whole = Eigen::Array<int, kLanes, 1>;
    const Level& l = levels_[static_cast<std::size_t>(level)];
    const Lanes s = (a * l.per_metre - 0.5F).max(0.0F).min(l.max_s);
    const Lanes t = (b * l.per_metre - 0.5F).max(0.0F).min(l.max_t);
    const Whole i = s.cast<int>();
    const Whole j = t.cast<int>();
    Whole p00, p01, p10, p11;
    for (int k = 0; k < kLanes; ++k) {
      const std::uint8_t* p = l.data + static_cast<std::ptrdiff_t>(j[k]) * l.stride + i[k];
      p00[k] = p[0];
      p01[k] = p[1];
      p10[k] = p[l.stride];
      p11[k] = p[l.stride + 1];
    }
    const Lanes right = s - i.cast<float>();
    const Lanes low = p00.cast<float>() + right * (p01 - p00).cast<float>();
    const Lanes high = p10.cast<float>() + right * (p11 - p10).cast<float>();
    return low + (t - j.cast<float>()) * (high - low);
  }

  /// Bilinear value at (a, b) [m] of the panel, on the next level below; beyond the border the border's.
  [[nodiscard]] float at(float a, float b, float level) const {
    const Level& l = levels_[static_cast<std::size_t>(whole(level))];
    float s = a * l.per_metre - 0.5F;
    float t = b * l.per_metre - 0.5F;
    s = s < 0.0F ? 0.0F : (s > l.max_s ? l.max_s : s);
    t = t < 0.0F ? 0.0F : (t > l.max_t ? l.max_t : t);
    const int i = static_cast<int>(s);
    const int j = static_cast<int>(t);
    const float fs = s - static_cast<float>(i);
    const float ft = t - static_cast<float>(j);
    const std::uint8_t* p = l.data + static_cast<std::ptrdiff_t>(j) * l.stride + i;
    const float low = static_cast<float>(p[0]) + fs * static_cast<float>(p[1] - p[0]);
    const float high = static_cast<float>(p[l.stride]) + fs * static_cast<float>(p[l.stride + 1] - p[l.stride]);
    return low + ft * (high - low);
  }

 private:
  struct Level {
    cv::Mat image;
    const std::uint8_t* data = nullptr;
    int stride = 0;
    float max_s = 0.0F, max_t = 0.0F;  // largest coordinates with a neighbour to interpolate with
    float per_metre = 0.0F;
  };
  std::vector<Level> levels_;
};

/// Texture sizes are multiples of this, so that each smaller copy covers its pixels exactly.
inline constexpr int kTextureMultiple = 64;

}  // namespace ear::simulator
