#include "tools/evaluation/report.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <sstream>
#include <utility>

#include "tools/evaluation/plot.h"
#include "tools/evaluation/report_page.h"
#include "tools/evaluation/space_section.h"
#include "tools/evaluation/summary.h"

namespace ear::evaluation {
namespace {

constexpr double kWidth = 1040.0;      // [px] of a panel
constexpr std::size_t kColours = 8;    // in the style sheet, of estimates and of strips
constexpr double kBoundsInView = 4.0;  // a bound wider than this many times the error is cut off
constexpr double kSigmas = 3.0;
constexpr double kLowestNees = 0.01;  // what lies below is drawn there

const Eigen::Vector2d kInterruption(std::nan(""), std::nan(""));

std::string colour(std::size_t entry) { return "e" + std::to_string(entry % kColours); }

/// What to plot of one frame; `entry` gives access to its covariance.
using FrameValue = std::function<double(const ReportEntry&, const Frame&)>;

double seconds_since_start(const Trajectory& truth, const Frame& frame) {
  return seconds_between(truth.front().t_ns, frame.match.truth.t_ns);
}

/// A curve over all frames of an entry, interrupted where the estimate or the truth has a gap.
Curve curve_of(std::size_t index, const ReportEntry& entry, const FrameValue& x, const FrameValue& y) {
  Curve curve{colour(index), entry.evaluation.name, {}};
  int segment = entry.evaluation.frames.front().match.segment;
  for (const Frame& frame : entry.evaluation.frames) {
    if (frame.match.segment != segment) curve.points.push_back(kInterruption);
    segment = frame.match.segment;
    curve.points.emplace_back(x(entry, frame), y(entry, frame));
  }
  return curve;
}

std::vector<double> coordinate(const std::vector<Curve>& curves, int axis) {
  std::vector<double> values;
  for (const Curve& curve : curves)
    for (const Eigen::Vector2d& point : curve.points) values.push_back(point(axis));
  return values;
}

/// Symmetric about zero: all errors, and the bounds as far as they do not dwarf them.
Range error_range(const std::vector<Curve>& curves) {
  double error = 0.0;
  double bound = 0.0;
  for (const Curve& curve : curves) {
    for (const Eigen::Vector2d& point : curve.points)
      if (point.allFinite()) error = std::max(error, std::abs(point.y()));
    for (const double value : curve.bound)
      if (std::isfinite(value)) bound = std::max(bound, value);
  }
  const double half = 1.08 * std::max({error, std::min(bound, kBoundsInView * error), 1e-6});
  return {-half, half};
}

/// From world axes into those of the heading: x forward, y left. Turns errors about world x and y into roll and pitch.
Eigen::Matrix3d heading_axes(const Pose& pose) {
  const Eigen::Vector3d forward = pose.q_WB * Eigen::Vector3d::UnitX();
  return Eigen::AngleAxisd(-std::atan2(forward.y(), forward.x()), Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

const Pose& estimated_pose(const ReportEntry& entry, const Frame& frame) {
  return entry.estimate.poses[frame.match.index];
}

/// Standard deviation of component `axis` of the position (block 0) or rotation (block 3), turned by `R`.
double sigma(const ReportEntry& entry, const Frame& frame, int block, int axis, const Eigen::Matrix3d& R) {
  const Eigen::Matrix3d P = entry.estimate.covariance[frame.match.index].block<3, 3>(block, block);
  return std::sqrt(std::max(0.0, (R * P * R.transpose())(axis, axis)));
}

/// One panel of errors over time with the bounds that the estimates give.
Plot error_panel(const std::string& label, const Trajectory& truth, const std::vector<ReportEntry>& entries,
                 const Range& time, const FrameValue& error, const FrameValue& deviation) {
  Plot plot;
  plot.width = kWidth;
  plot.height = 150.0;
  plot.y_label = label;
  plot.x_range = time;
  const FrameValue x = [&](const ReportEntry&, const Frame& frame) { return seconds_since_start(truth, frame); };
  for (std::size_t i = 0; i < entries.size(); ++i) {
    Curve curve = curve_of(i, entries[i], x, error);
    if (!entries[i].estimate.covariance.empty())
      for (const Eigen::Vector2d& point : curve_of(i, entries[i], x, [&](const ReportEntry&e, const Frame&f) {
                                            return kSigmas * deviation(e, f);
                                          }).points)
        curve.bound.push_back(point.y());
    plot.curves.push_back(curve);
  }
  plot.y_range = error_range(plot.curves);
  return plot;
}

/// Panels on top of each other; only the last has numbers and a label at its x axis.
std::string stacked(std::vector<Plot> plots, const std::string& x_label) {
  plots.back().x_label = x_label;
  plots.back().height += 30.0;
  std::string out;
  for (const Plot& plot : plots) out += to_svg(plot);
  return out;
}

// The strips under the errors: what an estimator said about itself, as stretches of equal text.

std::vector<Stretch> stretches(const Trajectory& truth, const Evaluation& evaluation,
                               const std::vector<std::string>& labels,
                               const std::map<std::string, std::size_t>& colours) {
  constexpr int kNoSegment = -1;
  std::vector<Stretch> result;
  int segment = kNoSegment;
  for (const Frame& frame : evaluation.frames) {
    const std::string& text = labels[frame.match.index];
    const double t = seconds_since_start(truth, frame);
    if (text.empty()) {  // nothing to say
      segment = kNoSegment;
      continue;
    }
    const bool joined = !result.empty() && frame.match.segment == segment;
    if (joined) result.back().to = t;
    if (!joined || result.back().text != text)
      result.push_back({t, t, text, "s" + std::to_string(colours.at(text) % kColours)});
    segment = frame.match.segment;
  }
  return result;
}

/// Equal texts get equal colours, in the order in which they appear in any of the estimates.
std::map<std::string, std::size_t> label_colours(const std::vector<ReportEntry>& entries) {
  std::map<std::string, std::size_t> colours;
  for (const ReportEntry& entry : entries)
    for (const auto* labels : {&entry.estimate.mode, &entry.estimate.health, &entry.estimate.anomalous})
      for (const std::string& text : *labels)
        if (!text.empty()) colours.emplace(text, colours.size());
  return colours;
}

std::string strips(const Trajectory& truth, const std::vector<ReportEntry>& entries, const Range& time) {
  const std::map<std::string, std::size_t> colours = label_colours(entries);
  std::string out;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto add = [&](const std::string& label, const std::vector<std::string>& labels) {
      if (labels.empty()) return;
      const std::string name = entries.size() > 1 ? label + " " + std::to_string(i + 1) : label;
      out += to_svg_strip(name, colour(i), stretches(truth, entries[i].evaluation, labels, colours), time, kWidth);
    };
    add("mode", entries[i].estimate.mode);
    add("health", entries[i].estimate.health);
    add("at fault", entries[i].estimate.anomalous);
  }
  return out;
}

/// The weight of each sensor over time, of the estimates that have it.
std::string weight_panels(const Trajectory& truth, const std::vector<ReportEntry>& entries, const Range& time) {
  const std::vector<std::pair<std::string, double SensorWeights::*>> sensors{
      {"weight: IMU", &SensorWeights::imu}, {"odometer", &SensorWeights::odometer}, {"camera", &SensorWeights::camera}};
  std::vector<Plot> plots;
  for (const auto& [label, weight] : sensors) {
    Plot plot;
    plot.width = kWidth;
    plot.height = 80.0;
    plot.y_label = label;
    plot.x_range = time;
    plot.y_range = {-0.1, 1.1};
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (entries[i].estimate.weights.empty()) continue;
      plot.curves.push_back(curve_of(
          i, entries[i], [&](const ReportEntry&, const Frame& f) { return seconds_since_start(truth, f); },
          [sensor = weight](const ReportEntry& e, const Frame& f) {
            return e.estimate.weights[f.match.index].*sensor;
          }));
    }
    if (!plot.curves.empty()) plots.push_back(plot);
  }
  return plots.empty() ? "" : stacked(plots, "time [s]");
}

// The sections of the page.

std::string section(const std::string& title, const std::string& text, const std::string& axis,
                    const std::string& content) {
  return "<section data-axis=\"" + axis + "\"><h2>" + title + "</h2><p>" + text + "</p>\n" + content + "</section>\n";
}

std::string legend(const std::vector<ReportEntry>& entries) {
  std::string out =
      "<div class=\"legend\"><button class=\"truth\" data-of=\"truth\" aria-pressed=\"true\"><i></i>truth</button>";
  for (std::size_t i = 0; i < entries.size(); ++i)
    out += "<button class=\"" + colour(i) + "\" data-of=\"" + colour(i) + "\" aria-pressed=\"true\"><i></i>" +
           escaped(entries[i].evaluation.name) + "</button>";
  return out + "</div>\n";
}

/// Index of the smallest value, if there are several to choose from.
std::optional<std::size_t> best(const SummaryRow& row) {
  if (!row.less_is_better || row.values.size() < 2) return std::nullopt;
  std::optional<std::size_t> result;
  for (std::size_t i = 0; i < row.values.size(); ++i)
    if (row.values[i] && (!result || *row.values[i] < *row.values[*result])) result = i;
  return result;
}

std::string table_section(const std::vector<Evaluation>& evaluations) {
  std::string out = "<div class=\"scroll\"><table><thead><tr><th></th>";
  for (std::size_t i = 0; i < evaluations.size(); ++i)
    out += "<th class=\"" + colour(i) + "\">" + escaped(evaluations[i].name) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (const SummaryRow& row : summary_rows(evaluations)) {
    const std::optional<std::size_t> winner = best(row);
    out += "<tr><th>" + escaped(row.label) + "</th>";
    for (std::size_t i = 0; i < evaluations.size(); ++i)
      out += (winner == i ? "<td class=\"best\">" : "<td>") + value_text(row, i) + "</td>";
    out += "</tr>\n";
  }
  out += "</tbody></table></div>";
  const std::vector<std::string> remarks = notes(evaluations);
  if (!remarks.empty()) {
    out += "<ul class=\"notes\">";
    for (const std::string& remark : remarks) out += "<li>" + escaped(remark) + "</li>";
    out += "</ul>";
  }
  return section("Figures",
                 "Alignment: " + to_string(evaluations.front().kind) +
                     ". Start-to-end error and NEES align the first pose only. NEES has 3 degrees of freedom each: its "
                     "mean is 3 for a consistent estimate, more where it believes too much.",
                 "", out);
}

std::string trajectory_section(const Trajectory& truth, const std::vector<ReportEntry>& entries) {
  const std::vector<double> distances = distance_travelled(truth, truth);
  Curve truth_above{"truth", "truth", {}};
  Curve truth_aside{"truth", "truth", {}};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    truth_above.points.emplace_back(truth[i].p_WB.head<2>());
    truth_aside.points.emplace_back(distances[i], truth[i].p_WB.z());
  }
  Plot above;
  above.curves.push_back(truth_above);
  Plot aside;
  aside.curves.push_back(truth_aside);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    above.curves.push_back(curve_of(
        i, entries[i], [](const ReportEntry&, const Frame& f) { return f.aligned.p_WB.x(); },
        [](const ReportEntry&, const Frame& f) { return f.aligned.p_WB.y(); }));
    aside.curves.push_back(curve_of(
        i, entries[i], [](const ReportEntry&, const Frame& f) { return f.distance; },
        [](const ReportEntry&, const Frame& f) { return f.aligned.p_WB.z(); }));
  }
  above.width = aside.width = kWidth;
  above.height = 520.0;
  above.x_label = "x [m]";
  above.y_label = "y [m]";
  above.is_function = false;
  above.x_range = range_of(coordinate(above.curves, 0));
  above.y_range = range_of(coordinate(above.curves, 1));
  make_equal(above);
  aside.height = 230.0;
  aside.x_label = "distance travelled [m]";
  aside.y_label = "z [m]";
  aside.x_range = range_of(coordinate(aside.curves, 0));
  aside.y_range = range_of(coordinate(aside.curves, 1));
  return section("Trajectory", "From above and from the side, aligned to the truth. Circle: start; square: end.",
                 "distance [m]", to_svg(above) + to_svg(aside));
}

std::string space_section() {
  return section(
      "In perspective",
      "Drag to turn, or use the arrow keys; + and - zoom, Home goes back. Broad and pale: the truth. Dashed: in "
      "the air. Numbers: the moments below.",
      "", space_canvas());
}

std::string moments_section(const Trajectory& truth, const std::vector<ReportEntry>& entries,
                            const std::vector<Moment>& moments) {
  if (moments.empty()) return "";
  const std::string whose = entries.size() > 1 ? " by " + escaped(entries.front().evaluation.name) : "";
  return section("Moments", "What happened" + whose + ", and what the left camera saw then.", "",
                 filmstrip(moments, truth.front().t_ns));
}

std::string position_section(const Trajectory& truth, const std::vector<ReportEntry>& entries, const Range& time) {
  const std::vector<std::string> labels{"x [m]", "y [m]", "z [m]"};
  std::vector<Plot> plots;
  plots.reserve(labels.size());
  for (int axis = 0; axis < 3; ++axis)
    plots.push_back(error_panel(
        labels[static_cast<std::size_t>(axis)], truth, entries, time,
        [axis](const ReportEntry&, const Frame& f) { return f.position_error(axis); },
        [axis](const ReportEntry& e, const Frame& f) { return sigma(e, f, 0, axis, Eigen::Matrix3d::Identity()); }));
  return section(
      "Position error",
      "True minus estimated in the axes of the estimate's world, first poses aligned. Shaded: three standard "
      "deviations, as the estimate gives them. Below, where the estimate says it: what the vehicle does, its health, "
      "the sensor at fault, and the weight of each sensor (1: full; 0: it measured nothing).",
      "t [s]", stacked(plots, "time [s]") + strips(truth, entries, time) + weight_panels(truth, entries, time));
}

std::string rotation_section(const Trajectory& truth, const std::vector<ReportEntry>& entries, const Range& time) {
  const std::vector<std::string> labels{"roll [deg]", "pitch [deg]", "yaw [deg]"};
  std::vector<Plot> plots;
  plots.reserve(labels.size());
  for (const int axis : {2, 0, 1})
    plots.push_back(error_panel(
        labels[static_cast<std::size_t>(axis)], truth, entries, time,
        [axis](const ReportEntry& e, const Frame& f) {
          return kDegPerRad * (heading_axes(estimated_pose(e, f)) * f.rotation_error)(axis);
        },
        [axis](const ReportEntry& e, const Frame& f) {
          return kDegPerRad * sigma(e, f, 3, axis, heading_axes(estimated_pose(e, f)));
        }));
  return section("Rotation error",
                 "About the vertical (yaw), the heading (roll) and the axis to its left (pitch), first poses aligned.",
                 "t [s]", stacked(plots, "time [s]"));
}

Plot nees_panel(const std::string& label, const Trajectory& truth, const std::vector<ReportEntry>& entries,
                const Range& time, const std::function<std::optional<double>(const Frame&)>& nees) {
  Plot plot;
  plot.width = kWidth;
  plot.height = 170.0;
  plot.y_label = label;
  plot.log_y = true;
  plot.x_range = time;
  plot.shaded = Range{kNeesLow, kNeesHigh};
  double highest = 100.0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (!entries[i].evaluation.nees) continue;
    plot.curves.push_back(curve_of(
        i, entries[i], [&](const ReportEntry&, const Frame& f) { return seconds_since_start(truth, f); },
        [&](const ReportEntry&, const Frame& f) { return std::max(nees(f).value_or(std::nan("")), kLowestNees); }));
    for (const Eigen::Vector2d& point : plot.curves.back().points)
      if (point.allFinite()) highest = std::max(highest, point.y());
  }
  plot.y_range = {std::log10(kLowestNees), std::log10(1.2 * highest)};
  return plot;
}

std::string nees_section(const Trajectory& truth, const std::vector<ReportEntry>& entries, const Range& time) {
  if (std::none_of(entries.begin(), entries.end(), [](const ReportEntry& e) { return e.evaluation.nees.has_value(); }))
    return {};
  const std::vector<Plot> plots{
      nees_panel("position", truth, entries, time, [](const Frame& f) { return f.nees_position; }),
      nees_panel("orientation", truth, entries, time, [](const Frame& f) { return f.nees_orientation; })};
  return section("Consistency",
                 "Normalized estimation error squared (NEES). Shaded: where it should be 95 % of the time. Above: the "
                 "error is larger than the estimate admits.",
                 "t [s]", stacked(plots, "time [s]"));
}

std::string drift_section(const std::vector<ReportEntry>& entries) {
  Plot plot;
  plot.width = kWidth;
  plot.height = 240.0;
  plot.x_label = "distance travelled [m]";
  plot.y_label = "error [m]";
  for (std::size_t i = 0; i < entries.size(); ++i)
    plot.curves.push_back(curve_of(
        i, entries[i], [](const ReportEntry&, const Frame& f) { return f.distance; },
        [](const ReportEntry&, const Frame& f) { return f.position_error.norm(); }));
  plot.x_range = range_of(coordinate(plot.curves, 0));
  plot.y_range = {0.0, range_of(coordinate(plot.curves, 1)).second};
  return section("Drift", "Length of the position error against the distance travelled, first poses aligned.",
                 "distance [m]", to_svg(plot));
}

/// From the first to the last frame of any entry [s].
Range time_range(const Trajectory& truth, const std::vector<ReportEntry>& entries) {
  Range range{INFINITY, -INFINITY};
  for (const ReportEntry& entry : entries) {
    range.first = std::min(range.first, seconds_since_start(truth, entry.evaluation.frames.front()));
    range.second = std::max(range.second, seconds_since_start(truth, entry.evaluation.frames.back()));
  }
  return range;
}

}  // namespace

std::string to_html(const std::string& title, const Trajectory& truth, const std::vector<ReportEntry>& entries,
                    const std::vector<Moment>& moments) {
  std::vector<Evaluation> evaluations;
  evaluations.reserve(entries.size());
  for (const ReportEntry& entry : entries) evaluations.push_back(entry.evaluation);
  std::vector<std::string> classes;
  classes.reserve(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) classes.push_back(colour(i));
  const Range time = time_range(truth, entries);

  std::ostringstream page;
  page << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
       << "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" << escaped(title)
       << "</title>\n<style>" << kReportStyle << "</style></head>\n<body><main>\n<h1>" << escaped(title) << "</h1>\n"
       << legend(entries) << table_section(evaluations) << trajectory_section(truth, entries) << space_section()
       << moments_section(truth, entries, moments) << position_section(truth, entries, time)
       << rotation_section(truth, entries, time) << nees_section(truth, entries, time) << drift_section(entries)
       << "</main><div id=\"readout\"></div>\n<script>" << kReportScript << space_data(truth, entries, classes, moments)
       << perspective_script() << "</script></body></html>\n";
  return page.str();
}

}  // namespace ear::evaluation
