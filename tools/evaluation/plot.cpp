#include "tools/evaluation/plot.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <sstream>

namespace ear::evaluation {
namespace {

// Margins of a panel [px].
constexpr double kLeft = 64.0;
constexpr double kRight = 14.0;
constexpr double kTop = 8.0;
constexpr double kBottom = 10.0;
constexpr double kBottomWithAxis = 40.0;
constexpr double kStripHeight = 20.0;
constexpr double kPixelStep = 0.7;             // between points of a path
constexpr std::size_t kMostPathPoints = 2500;  // keeps the page small whatever the path
constexpr double kFineCurves = 3.0;            // so many are drawn to the pixel, more of them coarser
constexpr double kTextWidth = 6.6;             // of one letter in a strip

/// From data to pixels.
struct Scale {
  double x0, x1, y0, y1;            ///< data; y as exponents if log_y
  double left, right, top, bottom;  ///< pixels
  bool log_y;

  [[nodiscard]] double x(double value) const { return left + (value - x0) / (x1 - x0) * (right - left); }
  [[nodiscard]] double y(double value) const {
    const double v = log_y ? std::log10(std::max(value, 1e-12)) : value;
    return bottom - (v - y0) / (y1 - y0) * (bottom - top);
  }
};

Scale scale_of(const Plot& plot) {
  const double below = plot.x_label.empty() ? kBottom : kBottomWithAxis;
  return {plot.x_range.first,
          plot.x_range.second,
          plot.y_range.first,
          plot.y_range.second,
          kLeft,
          plot.width - kRight,
          kTop,
          plot.height - below,
          plot.log_y};
}

std::string number(double value) {
  std::ostringstream text;
  text << std::setprecision(8) << (std::abs(value) < 1e-12 ? 0.0 : value);
  return text.str();
}

/// A pixel coordinate, tenths are enough.
std::string px(double value) {
  std::ostringstream text;
  text << std::round(10.0 * value) / 10.0;
  return text.str();
}

std::string attribute(const std::string& name, const std::string& value) { return " " + name + "=\"" + value + "\""; }

std::string line(const std::string& css_class, double x1, double y1, double x2, double y2) {
  return "<line" + attribute("class", css_class) + attribute("x1", px(x1)) + attribute("y1", px(y1)) +
         attribute("x2", px(x2)) + attribute("y2", px(y2)) + "/>";
}

std::string text(const std::string& css_class, double x, double y, const std::string& content,
                 const std::string& more = "") {
  return "<text" + attribute("class", css_class) + attribute("x", px(x)) + attribute("y", px(y)) + more + ">" +
         escaped(content) + "</text>";
}

std::string rectangle(const std::string& css_class, double x, double y, double width, double height) {
  return "<rect" + attribute("class", css_class) + attribute("x", px(x)) + attribute("y", px(y)) +
         attribute("width", px(std::max(0.0, width))) + attribute("height", px(std::max(0.0, height))) + "/>";
}

std::string ten_to_the(int exponent) {
  return exponent >= 0 && exponent <= 4 ? number(std::pow(10.0, exponent)) : "1e" + std::to_string(exponent);
}

std::string axes(const Plot& plot, const Scale& s) {
  std::string out = rectangle("frame", s.left, s.top, s.right - s.left, s.bottom - s.top);
  for (const double x : ticks(plot.x_range, static_cast<int>((s.right - s.left) / 90.0))) {
    out += line("grid", s.x(x), s.top, s.x(x), s.bottom);
    if (!plot.x_label.empty()) out += text("tick middle", s.x(x), s.bottom + 15.0, number(x));
  }
  if (plot.log_y) {
    for (int e = static_cast<int>(std::ceil(s.y0)); e <= static_cast<int>(std::floor(s.y1)); ++e) {
      const double y = s.y(std::pow(10.0, e));
      out += line("grid", s.left, y, s.right, y) + text("tick end", s.left - 6.0, y + 4.0, ten_to_the(e));
    }
  } else {
    for (const double y : ticks(plot.y_range, static_cast<int>((s.bottom - s.top) / 24.0)))
      out += line(y == 0.0 ? "grid zero" : "grid", s.left, s.y(y), s.right, s.y(y)) +
             text("tick end", s.left - 6.0, s.y(y) + 4.0, number(y));
  }
  if (!plot.x_label.empty()) out += text("label middle", 0.5 * (s.left + s.right), s.bottom + 33.0, plot.x_label);
  const double middle = 0.5 * (s.top + s.bottom);
  return out +
         text("label middle", 13.0, middle, plot.y_label, attribute("transform", "rotate(-90 13 " + px(middle) + ")"));
}

using Path = std::vector<Eigen::Vector2d>;

/// The pieces of a curve between points that are not finite, in pixels.
std::vector<Path> pieces(const std::vector<Eigen::Vector2d>& points, const Scale& s) {
  std::vector<Path> result(1);
  for (const Eigen::Vector2d& point : points) {
    if (point.allFinite())
      result.back().emplace_back(s.x(point.x()), s.y(point.y()));
    else if (!result.back().empty())
      result.emplace_back();
  }
  if (result.back().empty()) result.pop_back();
  return result;
}

/// The lowest and the highest point of every column of this width [px], and both ends: no peak is lost.
Path thinned_function(const Path& path, double column) {
  const auto lower = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.y() < b.y(); };
  Path result{path.front()};
  for (auto begin = path.begin(); begin != path.end();) {
    const double index = std::floor(begin->x() / column);
    const auto end = std::find_if(
        begin, path.end(), [&](const Eigen::Vector2d& point) { return std::floor(point.x() / column) != index; });
    const auto [low, high] = std::minmax_element(begin, end, lower);
    result.push_back(*std::min(low, high));
    if (low != high) result.push_back(*std::max(low, high));
    begin = end;
  }
  result.push_back(path.back());
  return result;
}

/// Points at least kPixelStep apart, and no more than kMostPathPoints.
Path thinned_path(const Path& path) {
  Path kept{path.front()};
  for (const Eigen::Vector2d& point : path)
    if ((point - kept.back()).norm() >= kPixelStep) kept.push_back(point);
  if (kept.back() != path.back()) kept.push_back(path.back());
  const std::size_t stride = kept.size() / kMostPathPoints + 1;
  Path result;
  for (std::size_t i = 0; i < kept.size(); i += stride) result.push_back(kept[i]);
  return result;
}

/// Many curves share the space that a page may take.
double column_width(const Plot& plot) { return std::max(1.0, static_cast<double>(plot.curves.size()) / kFineCurves); }

std::string coordinates(const Path& path) {
  std::string out;
  for (const Eigen::Vector2d& point : path) out += (out.empty() ? "" : " ") + px(point.x()) + "," + px(point.y());
  return out;
}

std::string polyline(const Curve& curve, const Plot& plot, const Scale& s) {
  std::string out;
  for (const Path& path : pieces(curve.points, s))
    out += "<polyline" + attribute("class", "curve " + curve.css_class) + attribute("data-name", escaped(curve.name)) +
           attribute("points",
                     coordinates(plot.is_function ? thinned_function(path, column_width(plot)) : thinned_path(path))) +
           "/>";
  return out;
}

/// The band from -bound to +bound: along its upper edge and back along its lower one.
std::string band(const Curve& curve, const Plot& plot, const Scale& s) {
  if (curve.bound.empty()) return {};
  std::vector<Eigen::Vector2d> upper;
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const double bound = curve.points[i].allFinite() ? curve.bound[i] : std::nan("");
    upper.emplace_back(curve.points[i].x(), bound);
  }
  std::string out;
  for (const Path& piece : pieces(upper, s)) {
    const Path edge = thinned_function(piece, column_width(plot));
    Path outline = edge;
    for (auto point = edge.rbegin(); point != edge.rend(); ++point)
      outline.emplace_back(point->x(), 2.0 * s.y(0.0) - point->y());
    out +=
        "<polygon" + attribute("class", "band " + curve.css_class) + attribute("points", coordinates(outline)) + "/>";
  }
  return out;
}

std::string ends_of_path(const Curve& curve, const Scale& s) {
  const std::vector<Path> all = pieces(curve.points, s);
  if (all.empty()) return {};
  const Eigen::Vector2d first = all.front().front();
  const Eigen::Vector2d last = all.back().back();
  return "<circle" + attribute("class", "start " + curve.css_class) + attribute("cx", px(first.x())) +
         attribute("cy", px(first.y())) + attribute("r", "4") + "><title>start</title></circle>" + "<rect" +
         attribute("class", "end " + curve.css_class) + attribute("x", px(last.x() - 3.5)) +
         attribute("y", px(last.y() - 3.5)) + attribute("width", "7") + attribute("height", "7") +
         "><title>end</title></rect>";
}

std::string open_svg(const Plot& plot, const Scale& s, const std::string& clip) {
  std::string out = "<svg" + attribute("class", plot.is_function ? "plot readable" : "plot") +
                    attribute("viewBox", "0 0 " + px(plot.width) + " " + px(plot.height)) + attribute("role", "img") +
                    attribute("aria-label", escaped(plot.y_label)) +
                    attribute("data-x", number(s.x0) + " " + number(s.x1)) +
                    attribute("data-y", number(s.y0) + " " + number(s.y1)) +
                    attribute("data-box", px(s.left) + " " + px(s.right) + " " + px(s.top) + " " + px(s.bottom));
  if (plot.log_y) out += attribute("data-log", "1");
  return out + "><clipPath" + attribute("id", clip) + ">" +
         rectangle("", s.left, s.top, s.right - s.left, s.bottom - s.top) + "</clipPath>";
}

/// Panels of the same size share the clip of the same name: all of them have the same rectangle.
std::string clip_name(const Plot& plot, const Scale& s) {
  return "clip-" + std::to_string(std::lround(plot.width)) + "-" + std::to_string(std::lround(s.bottom));
}

}  // namespace

Range range_of(const std::vector<double>& values) {
  double low = INFINITY;
  double high = -INFINITY;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) return {-1.0, 1.0};
  const double margin = std::max(0.05 * (high - low), 1e-6 * (1.0 + std::abs(high)));
  return {low - margin, high + margin};
}

void make_equal(Plot& plot) {
  const Scale s = scale_of(plot);
  const double x_size = s.x1 - s.x0;
  const double y_size = s.y1 - s.y0;
  const double per_pixel = std::max(x_size / (s.right - s.left), y_size / (s.bottom - s.top));
  const double x_more = 0.5 * (per_pixel * (s.right - s.left) - x_size);
  const double y_more = 0.5 * (per_pixel * (s.bottom - s.top) - y_size);
  plot.x_range = {s.x0 - x_more, s.x1 + x_more};
  plot.y_range = {s.y0 - y_more, s.y1 + y_more};
}

std::vector<double> ticks(const Range& range, int count) {
  const double rough = (range.second - range.first) / std::max(1, count);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double mantissa = rough / power;
  const double step = power * (mantissa <= 1.0 ? 1.0 : mantissa <= 2.0 ? 2.0 : mantissa <= 5.0 ? 5.0 : 10.0);
  std::vector<double> result;
  const auto last = static_cast<long>(std::floor(range.second / step + 1e-9));
  for (auto i = static_cast<long>(std::ceil(range.first / step - 1e-9)); i <= last; ++i)
    result.push_back(static_cast<double>(i) * step);
  return result;
}

std::string to_svg(const Plot& plot) {
  const Scale s = scale_of(plot);
  const std::string clip = clip_name(plot, s);
  std::string out = open_svg(plot, s, clip);
  if (plot.shaded) {
    const double top = std::max(s.top, s.y(plot.shaded->second));
    out += rectangle("shaded", s.left, top, s.right - s.left, std::min(s.bottom, s.y(plot.shaded->first)) - top);
  }
  out += axes(plot, s) + "<g" + attribute("clip-path", "url(#" + clip + ")") + ">";
  for (const Curve& curve : plot.curves) out += band(curve, plot, s);
  for (const Curve& curve : plot.curves) out += polyline(curve, plot, s);
  if (!plot.is_function)
    for (const Curve& curve : plot.curves) out += ends_of_path(curve, s);
  return out + "</g>" + (plot.is_function ? line("cursor", s.left, s.top, s.left, s.bottom) : "") + "</svg>\n";
}

std::string to_svg_strip(const std::string& label, const std::string& label_class,
                         const std::vector<Stretch>& stretches, const Range& x_range, double width) {
  const double right = width - kRight;
  const auto x = [&](double value) {
    const double place = kLeft + (value - x_range.first) / (x_range.second - x_range.first) * (right - kLeft);
    return std::clamp(place, kLeft, right);
  };
  std::string out = "<svg" + attribute("class", "strip " + label_class) +
                    attribute("viewBox", "0 0 " + px(width) + " " + px(kStripHeight)) + ">" +
                    text("tick end", kLeft - 6.0, 14.0, label);
  for (const Stretch& stretch : stretches) {
    const double from = x(stretch.from);
    const double size = x(stretch.to) - from;
    out += "<g><title>" + escaped(stretch.text) + "</title>" +
           rectangle(stretch.css_class, from, 2.0, std::max(size, 0.5), kStripHeight - 4.0);
    if (size > kTextWidth * static_cast<double>(stretch.text.size()) + 6.0)
      out += text("inside middle", from + 0.5 * size, 14.0, stretch.text);
    out += "</g>";
  }
  return out + "</svg>\n";
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

}  // namespace ear::evaluation
