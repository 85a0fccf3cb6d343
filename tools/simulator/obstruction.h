// What is right before the lenses: a cover, or blades of grass that the vehicle brushes past.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "tools/simulator/random.h"
#include "tools/simulator/rays.h"
#include "tools/simulator/sequence.h"

namespace ear::simulator {

/// Grey level of a covered lens: no cover is quite tight.
inline constexpr double kCoverGrey = 6.0;

/// Both cameras look past the same blades, at their parallax. Times are those of the motion [s].
class Obstruction {
 public:
  /// Nothing.
  Obstruction() = default;
  /// Draws the tufts of grass of a motion of this duration [s].
  Obstruction(const Hindrance& hindrance, double duration, Rng& rng);

  struct Veil {
    double opacity = 0.0;  ///< 0: free sight, 1: none
    double grey = 0.0;     ///< grey level of what is in the way
  };
  /// What is in the way of a ray (x, y, 1) of a camera (0 left, 1 right).
  [[nodiscard]] Veil veil(std::size_t camera, double t, const Eigen::Vector2d& ray) const;

  /// Whether anything is before the lenses.
  [[nodiscard]] bool active(double t) const;
  /// Whether nothing is seen but the cover.
  [[nodiscard]] bool covered(double t) const { return cover(t) >= 1.0; }

 private:
  // A band that rises from below the picture and becomes narrower to its tip; it leans and passes sideways.
  struct Blade {
    double begin, end;       // [s]
    double x, lean, speed;   // of its middle in the left picture at y = 0: x + lean y + speed (t - begin)
    double tip, half_width;  // y of the tip; half the width one unit below it
    double disparity, grey;
  };
  [[nodiscard]] double cover(double t) const;  // opacity

  std::optional<double> covered_after_;
  std::vector<Blade> blades_;  // ordered by `begin`
};

/// Puts what is in the way into a picture, in grey levels (float). `rays` pass through the pixels' centres.
void draw_obstruction(const Obstruction& obstruction, const PixelRays& rays, std::size_t camera, double t,
                      cv::Mat& grey);

}  // namespace ear::simulator
