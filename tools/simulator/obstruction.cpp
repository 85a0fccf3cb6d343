#include "tools/simulator/obstruction.h"

#include <algorithm>
#include <cmath>

namespace ear::simulator {
namespace {

constexpr double kCovering = 0.3;    // [s] that it takes to cover the lenses
constexpr double kBaseline = 0.05;   // [m] of the parallax; blades need not meet it to the millimetre
constexpr double kSoftness = 0.012;  // blades are out of focus: width of their edges, in units of a ray

constexpr double kShortestTuft = 0.2;  // [s]
constexpr double kLongestTuft = 0.9;

}  // namespace

Obstruction::Obstruction(const Hindrance& hindrance, double duration, Rng& rng)
    : covered_after_(hindrance.covered_after) {
  if (hindrance.tufts <= 0.0) return;
  std::exponential_distribution<double> pause(hindrance.tufts);
  constexpr double kFirst = 3.0;  // the vehicle stands, and nothing passes
  for (double begin = kFirst + pause(rng); begin < duration - kFirst; begin += pause(rng)) {
    const double end = begin + uniform(rng, kShortestTuft, kLongestTuft);
    const double middle = uniform(rng, -0.8, 0.8);
    const double speed = (middle < 0.0 ? -1.0 : 1.0) * uniform(rng, 0.1, 0.8);  // outwards, as the vehicle passes
    const int count = 3 + static_cast<int>(uniform(rng, 0.0, 5.99));
    for (int i = 0; i < count; ++i) {
      const double depth = uniform(rng, 0.10, 0.30);  // [m]
      Blade blade{};
      blade.begin = begin;
      blade.end = end;
      blade.x = middle + uniform(rng, -0.25, 0.25);
      blade.lean = uniform(rng, -0.5, 0.5);
      blade.speed = speed * uniform(rng, 0.8, 1.2);
      blade.tip = uniform(rng, -0.5, 0.2);
      blade.half_width = uniform(rng, 0.003, 0.006) / depth;
      blade.disparity = kBaseline / depth;
      blade.grey = uniform(rng, 70.0, 160.0);
      blades_.push_back(blade);
    }
  }
}

double Obstruction::cover(double t) const {
  return covered_after_ ? std::clamp((t - *covered_after_) / kCovering, 0.0, 1.0) : 0.0;
}

bool Obstruction::active(double t) const {
  const auto passes = [t](const Blade& blade) { return blade.begin <= t && t <= blade.end; };
  return cover(t) > 0.0 || std::any_of(blades_.begin(), blades_.end(), passes);
}

Obstruction::Veil Obstruction::veil(std::size_t camera, double t, const Eigen::Vector2d& ray) const {
  Veil veil{cover(t), kCoverGrey};
  if (veil.opacity >= 1.0) return veil;
  const auto after = [](double now, const Blade& blade) { return now < blade.begin; };
  const auto begun = std::upper_bound(blades_.begin(), blades_.end(), t, after);
  const auto recent = std::lower_bound(blades_.begin(), begun, t - kLongestTuft,
                                       [](const Blade& blade, double then) { return blade.begin < then; });
  for (auto blade = recent; blade != begun; ++blade) {
    if (t > blade->end || ray.y() <= blade->tip) continue;
    const double middle =
        blade->x + blade->lean * ray.y() + blade->speed * (t - blade->begin) - (camera == 1 ? blade->disparity : 0.0);
    const double half_width = blade->half_width * std::min(1.0, ray.y() - blade->tip);
    const double inside = half_width - std::abs(ray.x() - middle);
    const double opacity = std::clamp(0.5 + inside / kSoftness, 0.0, 1.0);
    if (opacity > veil.opacity) veil = {opacity, blade->grey};
  }
  return veil;
}

void draw_obstruction(const Obstruction& obstruction, const PixelRays& rays, std::size_t camera, double t,
                      cv::Mat& grey) {
  if (!obstruction.active(t)) return;
  if (obstruction.covered(t)) {
    grey.setTo(kCoverGrey);
    return;
  }
  for (int v = 0; v < grey.rows; ++v) {
    for (int u = 0; u < grey.cols; ++u) {
      const std::size_t i = rays.index(u, v);
      const Obstruction::Veil veil = obstruction.veil(camera, t, Eigen::Vector2f(rays.x[i], rays.y[i]).cast<double>());
      float& value = grey.at<float>(v, u);
      value += static_cast<float>(veil.opacity) * (static_cast<float>(veil.grey) - value);
    }
  }
}

}  // namespace ear::simulator
