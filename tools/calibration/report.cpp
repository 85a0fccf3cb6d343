#include "tools/calibration/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>

#include "tools/evaluation/plot.h"
#include "tools/evaluation/report_page.h"

namespace ear::calibration {
namespace {

using evaluation::Curve;
using evaluation::Plot;

constexpr double kWidth = 1040.0;            // [px] of a panel
constexpr double kCell = 40.0;               // [px] of the image, over which residuals are averaged
constexpr double kEnlarged = 40.0;           // how much longer than it is a mean residual is drawn
constexpr std::size_t kFewestResiduals = 5;  // residuals in a cell
constexpr std::size_t kHits = 1500;          // of a beam that are drawn
const Eigen::Vector2d kInterruption(std::nan(""), std::nan(""));

using Chosen = std::function<bool(const Residual&)>;

std::string section(const std::string& heading, const std::string& words, const std::string& content) {
  return "<section data-axis=\"t [s]\"><h2>" + heading + "</h2><p>" + words + "</p>" + content + "</section>\n";
}

std::string cell(const std::string& tag, const std::string& text) {
  return "<" + tag + ">" + evaluation::escaped(text) + "</" + tag + ">";
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::string table(const Result& result) {
  std::string out = "<div class=\"scroll\"><table><thead><tr>";
  for (const char* head : {"", "unit", "given", "change", "known to", "before", "what would show it"})
    out += cell("th", head);
  out += "</tr></thead><tbody>";
  for (const Finding& finding : result.findings) {
    out += "<tr>" + cell("th", finding.name) + cell("td", finding.unit) + cell("td", number(finding.given)) +
           cell("td", finding.shown ? number(finding.change) : "kept") + cell("td", number(finding.posterior)) +
           cell("td", number(finding.prior)) + cell("td", finding.motion_wanted) + "</tr>";
  }
  return out + "</tbody></table></div>";
}

/// Root mean square of each second.
Curve over_time(const std::vector<Residual>& residuals, const Chosen& chosen, const std::string& colour,
                const std::string& name) {
  std::map<long, std::pair<double, double>> seconds;
  for (const Residual& residual : residuals) {
    if (!chosen(residual)) continue;
    auto& [sum, count] = seconds[std::lround(std::floor(residual.t))];
    sum += residual.value.squaredNorm();
    count += 1.0;
  }
  Curve curve{colour, name, {}, {}};
  for (const auto& [second, sums] : seconds) {
    if (!curve.points.empty() && static_cast<double>(second) > curve.points.back().x() + 1.5) {
      curve.points.push_back(kInterruption);
    }
    curve.points.emplace_back(static_cast<double>(second) + 0.5, std::sqrt(sums.first / sums.second));
  }
  return curve;
}

std::string time_panel(const Result& result, const std::string& label, const Chosen& chosen) {
  Plot plot;
  plot.width = kWidth;
  plot.x_label = "time [s]";
  plot.y_label = label;
  plot.log_y = true;
  plot.curves = {over_time(result.before, chosen, "e1", "before"), over_time(result.after, chosen, "e0", "after")};
  std::vector<double> times, heights;
  for (const Curve& curve : plot.curves) {
    for (const Eigen::Vector2d& point : curve.points) {
      if (!point.allFinite() || !(point.y() > 0.0)) continue;
      times.push_back(point.x());
      heights.push_back(std::log10(point.y()));
    }
  }
  if (times.empty()) return {};
  plot.x_range = evaluation::range_of(times);
  plot.y_range = evaluation::range_of(heights);
  return to_svg(plot);
}

std::string time_section(const Result& result, std::size_t drive) {
  const auto of = [drive](Term kind, std::size_t sensor) {
    return [=](const Residual& r) { return r.kind == kind && r.drive == drive && r.sensor == sensor; };
  };
  std::string content = time_panel(result, "left camera [px]", of(Term::pixel, 0)) +
                        time_panel(result, "right camera [px]", of(Term::pixel, 1)) +
                        time_panel(result, "wheels [sigma]", of(Term::roll, 0));
  const std::size_t beams = result.calibration.lasers ? result.calibration.lasers->beams.size() : 0;
  for (std::size_t i = 0; i < beams; ++i) {
    content += time_panel(result, result.calibration.lasers->beams[i].name + " [sigma]", of(Term::beam, i));
  }
  content += time_panel(result, "reference [sigma]", of(Term::reference, 0));
  return section("Drive " + std::to_string(drive + 1) + ": residuals over time",
                 "Root mean square of each second, by the calibration given (orange) and by the one found (blue). In "
                 "sigmas of the noise assumed at the start, before, and of the noise found, after.",
                 content);
}

/// Mean residual of each cell of the image, as a line from its middle.
Curve mean_residuals(const std::vector<Residual>& residuals, std::size_t camera, const std::string& colour) {
  std::map<std::pair<long, long>, std::pair<Eigen::Vector2d, std::size_t>> cells;
  for (const Residual& residual : residuals) {
    if (residual.kind != Term::pixel || residual.sensor != camera) continue;
    const auto key = std::make_pair(std::lround(std::floor(residual.at.x() / kCell)),
                                    std::lround(std::floor(residual.at.y() / kCell)));
    auto& [sum, count] = cells.try_emplace(key, Eigen::Vector2d::Zero(), 0).first->second;
    if (residual.value.norm() > 10.0) continue;  // another feature
    sum += residual.value;
    ++count;
  }
  Curve curve{colour, "", {}, {}};
  for (const auto& [key, mean] : cells) {
    if (mean.second < kFewestResiduals) continue;
    const Eigen::Vector2d middle((static_cast<double>(key.first) + 0.5) * kCell,
                                 -(static_cast<double>(key.second) + 0.5) * kCell);
    const Eigen::Vector2d error = kEnlarged / static_cast<double>(mean.second) * mean.first;
    curve.points.insert(curve.points.end(), {middle, middle + Eigen::Vector2d(error.x(), -error.y()), kInterruption});
  }
  return curve;
}

std::string image_section(const Result& result) {
  std::string content;
  for (std::size_t camera = 0; camera < result.calibration.cameras.size(); ++camera) {
    const CameraCalibration& lens = result.calibration.cameras[camera];
    Plot plot;
    plot.width = 0.7 * kWidth;
    plot.height = plot.width * lens.height / std::max(1, lens.width);
    plot.x_label = "cam" + std::to_string(camera) + " [px]";
    plot.y_label = "down [-px]";
    plot.x_range = {0.0, lens.width};
    plot.y_range = {-lens.height, 0.0};
    plot.is_function = false;
    plot.curves = {mean_residuals(result.before, camera, "e1"), mean_residuals(result.after, camera, "e0")};
    content += to_svg(plot);
  }
  if (content.empty()) return content;
  return section(
      "Reprojection errors over the image",
      "Mean of each 40 px cell, drawn 40 times as long, before (orange) and after (blue). A pattern that stays "
      "after is a lens that the model does not describe.",
      content);
}

std::string hit_section(const Result& result) {
  if (!result.calibration.lasers) return {};
  Plot plot;
  plot.width = 0.7 * kWidth;
  plot.height = 0.6 * kWidth;
  plot.x_label = "x [m]";
  plot.y_label = "y [m]";
  plot.is_function = false;
  std::vector<double> xs, ys;
  for (std::size_t beam = 0; beam < result.calibration.lasers->beams.size(); ++beam) {
    std::vector<Eigen::Vector2d> hits;
    for (const Residual& residual : result.after) {
      if (residual.kind == Term::beam && residual.sensor == beam) hits.push_back(residual.at);
    }
    Curve curve{"e" + std::to_string(beam % 8), result.calibration.lasers->beams[beam].name, {}, {}};
    const std::size_t stride = hits.size() / kHits + 1;
    for (std::size_t i = 0; i < hits.size(); i += stride) {
      const Eigen::Vector2d aside(0.01, 0.0);
      curve.points.insert(curve.points.end(), {hits[i] - aside, hits[i] + aside, kInterruption});
      xs.push_back(hits[i].x());
      ys.push_back(hits[i].y());
    }
    if (!hits.empty()) plot.curves.push_back(curve);
  }
  if (plot.curves.empty()) return {};
  plot.x_range = evaluation::range_of(xs);
  plot.y_range = evaluation::range_of(ys);
  make_equal(plot);
  return section("Where the beams hit", "In the world of the first drive's start, a colour for each beam.",
                 to_svg(plot));
}

}  // namespace

std::string to_html(const std::string& title, const Result& result) {
  std::size_t drives = 0;
  for (const Residual& residual : result.after) drives = std::max(drives, residual.drive + 1);
  const std::string name = evaluation::escaped(title);
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>" + name + "</title>\n<style>" +
      evaluation::kReportStyle + "</style></head>\n<body><main>\n<h1>" + name + "</h1>\n" +
      section("Found", "One line per number. What the drives did not show keeps its value.", table(result));
  for (std::size_t drive = 0; drive < drives; ++drive) page += time_section(result, drive);
  page += image_section(result) + hit_section(result);
  return page + "</main><div id=\"readout\"></div>\n<script>" + evaluation::kReportScript + "</script></body></html>\n";
}

std::string to_html(const std::string& title, const BoardResult& board) {
  Result result;
  result.calibration = board.calibration;
  result.findings = board.findings;
  result.after = board.residuals;
  return to_html(title, result);
}

}  // namespace ear::calibration
