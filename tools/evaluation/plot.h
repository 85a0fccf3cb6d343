// Curves as inline SVG. Knows nothing of trajectories; colours and fonts come from the style sheet of the page.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ear::evaluation {

/// One curve. A point that is not finite interrupts it.
struct Curve {
  std::string css_class;  ///< its colour
  std::string name;       ///< shown under the pointer
  std::vector<Eigen::Vector2d> points;
  std::vector<double> bound = {};  ///< half height of a shaded band about zero, one per point; empty: none
};

/// Coloured stretches of a horizontal strip, each with a text.
struct Stretch {
  double from = 0.0;
  double to = 0.0;
  std::string text;
  std::string css_class;
};

using Range = std::pair<double, double>;

/// One panel with its axes.
struct Plot {
  std::string x_label;  ///< empty: the panel stands above another that shares its axis, and has no numbers either
  std::string y_label;
  std::vector<Curve> curves;
  Range x_range{0.0, 1.0};
  Range y_range{0.0, 1.0};  ///< with log_y: exponents of ten
  double width = 960.0;     ///< [px]
  double height = 170.0;    ///< [px] with axes
  bool log_y = false;
  std::optional<Range> shaded;  ///< a horizontal band across the panel, in the data's unit
  bool is_function = true;      ///< one y per x, x growing: the pointer can read it
};

/// Smallest range that holds all finite values of `values`, widened by 5 % and never empty.
[[nodiscard]] Range range_of(const std::vector<double>& values);

/// Widens one of the ranges so that a metre is as long in x as in y in a panel of this size.
void make_equal(Plot& plot);

/// Round numbers that divide a range into about `count` parts.
[[nodiscard]] std::vector<double> ticks(const Range& range, int count);

/// Curves are thinned to what the eye can see: the extremes of every pixel column, or points 0.7 px apart.
[[nodiscard]] std::string to_svg(const Plot& plot);

/// A strip as wide as the panels, `label` in the place of their y axis.
[[nodiscard]] std::string to_svg_strip(const std::string& label, const std::string& label_class,
                                       const std::vector<Stretch>& stretches, const Range& x_range, double width);

/// Text for HTML and SVG.
[[nodiscard]] std::string escaped(const std::string& text);

}  // namespace ear::evaluation
