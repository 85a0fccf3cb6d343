#include "tools/paper/report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "tools/evaluation/evaluate.h"
#include "tools/evaluation/plot.h"
#include "tools/evaluation/report_page.h"
#include "tools/experiments/statistics.h"
#include "tools/paper/measure/configuration.h"

namespace ear::paper {
namespace {

using evaluation::Curve;
using evaluation::escaped;
using evaluation::Plot;
using evaluation::range_of;

constexpr double kWidth = 1040.0;   // [px]
constexpr std::size_t kGrid = 200;  // places at which runs of several seeds are put together

/// The configurations that are drawn, in the order of the colours.
const std::vector<std::string> kDrawn{"default", "none", "differential", "gyro", "smoother"};

/// Which figures of the paper show the like.
const std::map<std::string, std::string> kPaperFigures{
    {"flat1", "6 and 7"},   {"wave1", "6 and 7"}, {"fly2", "8"},   {"occlusion1", "9"}, {"occlusion2", "9"},
    {"flat3, 10 Hz", "10"}, {"sway1", "11"},      {"sway2", "11"}, {"sway3", "11"}};

using Number = double Moment::*;

/// The runs of one sequence and rate, by configuration; all seeds.
struct Scene {
  std::string title;
  std::vector<std::pair<std::size_t, std::vector<Result>>> runs;  ///< place in kDrawn; runs that followed
};

std::string colour(std::size_t place) { return "e" + std::to_string(place); }

const std::string& title_of(std::size_t place) { return find_configuration(kDrawn[place]).title; }

Curve curve(std::size_t place, const Result& result, Number x, Number y) {
  Curve drawn{colour(place), title_of(place), {}};
  for (const Moment& moment : result.moments) drawn.points.emplace_back(moment.*x, moment.*y);
  return drawn;
}

Curve truth_curve(const Scene& scene, Number x, Number y) {
  Curve drawn = curve(0, scene.runs.front().second.front(), x, y);
  drawn.css_class = "truth";
  drawn.name = "truth";
  return drawn;
}

void fit(Plot& plot) {
  std::vector<double> x;
  std::vector<double> y;
  for (const Curve& drawn : plot.curves) {
    for (const Eigen::Vector2d& point : drawn.points) {
      x.push_back(point.x());
      y.push_back(point.y());
    }
  }
  plot.x_range = range_of(x);
  plot.y_range = range_of(y);
}

Plot panel(const std::string& x_label, const std::string& y_label, double height) {
  Plot plot;
  plot.width = kWidth;
  plot.height = height;
  plot.x_label = x_label;
  plot.y_label = y_label;
  return plot;
}

/// The path of the first seed from above.
std::string path_panel(const Scene& scene) {
  Plot plot = panel("x [m]", "y [m]", 440.0);
  plot.is_function = false;
  plot.curves.push_back(truth_curve(scene, &Moment::true_x, &Moment::true_y));
  for (const auto& [place, runs] : scene.runs) {
    plot.curves.push_back(curve(place, runs.front(), &Moment::x, &Moment::y));
  }
  fit(plot);
  make_equal(plot);
  return to_svg(plot);
}

std::string height_panel(const Scene& scene) {
  Plot plot = panel("time [s]", "z [m]", 190.0);
  plot.curves.push_back(truth_curve(scene, &Moment::t, &Moment::true_z));
  for (const auto& [place, runs] : scene.runs) {
    plot.curves.push_back(curve(place, runs.front(), &Moment::t, &Moment::z));
  }
  fit(plot);
  return to_svg(plot);
}

/// `value` of the last moment of a run whose `x` is not beyond a place; nothing before its first and after its last.
template <typename Value>
std::optional<double> at(const Result& run, Number x, double place, const Value& value) {
  const auto after =
      std::find_if(run.moments.begin(), run.moments.end(), [&](const Moment& m) { return m.*x > place; });
  if (after == run.moments.begin() || after == run.moments.end()) return std::nullopt;
  return value(*(after - 1));
}

/// What the runs of all seeds have at evenly spread places, put together.
template <typename Value, typename Together>
Curve over_seeds(std::size_t place, const std::vector<Result>& runs, Number x, const Value& value,
                 const Together& together) {
  Curve drawn{colour(place), title_of(place), {}};
  double end = 0.0;
  for (const Result& run : runs) end = std::max(end, run.moments.back().*x);
  for (std::size_t i = 0; i < kGrid; ++i) {
    const double here = end * static_cast<double>(i) / kGrid;
    std::vector<double> values;
    for (const Result& run : runs) {
      if (const std::optional<double> there = at(run, x, here, value)) values.push_back(*there);
    }
    drawn.points.emplace_back(here, 2 * values.size() > runs.size() ? together(values) : std::nan(""));
  }
  return drawn;
}

/// Error against the distance, against time where the vehicle hardly travels: median of the seeds.
std::string error_panel(const Scene& scene) {
  const bool travels = scene.runs.front().second.front().length > 5.0;
  const Number x = travels ? &Moment::distance : &Moment::t;
  Plot plot = panel(travels ? "distance travelled [m]" : "time [s]", "error [m]", 190.0);
  for (const auto& [place, runs] : scene.runs) {
    plot.curves.push_back(over_seeds(
        place, runs, x, [](const Moment& m) { return std::optional(m.error); }, experiments::median));
  }
  fit(plot);
  plot.y_range.first = 0.0;
  return to_svg(plot);
}

std::string nees_panel(const Scene& scene) {
  Plot plot = panel("time [s]", "NEES", 190.0);
  plot.log_y = true;
  plot.shaded = evaluation::Range{evaluation::kNeesLow, evaluation::kNeesHigh};
  for (const auto& [place, runs] : scene.runs) {
    plot.curves.push_back(over_seeds(
        place, runs, &Moment::t, [](const Moment& m) { return m.nees; },
        [](const std::vector<double>& values) { return std::max(0.01, experiments::mean(values)); }));
  }
  fit(plot);
  plot.y_range = {-2.0, std::max(2.0, std::log10(std::max(1.0, plot.y_range.second)))};
  return to_svg(plot);
}

std::string scene_section(const Scene& scene) {
  const auto figure = kPaperFigures.find(scene.title);
  std::string text =
      "Path and height: first seed, aligned to the truth. Error: first poses aligned, median of the "
      "seeds. NEES of the position: mean of the seeds; shaded: where that of one run is 95 % of the time.";
  if (figure != kPaperFigures.end()) text = "As the paper's figure " + figure->second + ". " + text;
  return "<section data-axis=\"\"><h2>" + escaped(scene.title) + "</h2><p>" + text + "</p>\n" + path_panel(scene) +
         height_panel(scene) + error_panel(scene) + nees_panel(scene) + "</section>\n";
}

std::vector<Scene> scenes_of(const std::vector<Setup>& setups, const Lookup& results) {
  std::vector<Scene> scenes;
  for (const Setup& setup : setups) {
    const auto drawn = std::find(kDrawn.begin(), kDrawn.end(), setup.configuration);
    if (drawn == kDrawn.end()) continue;
    std::vector<Result> runs;
    for (const Result& run : results(setup)) {
      if (run.estimated && !run.moments.empty()) runs.push_back(run);
    }
    if (runs.empty()) continue;
    const bool full_rate = setup.camera_rate_hz == Setup{}.camera_rate_hz;
    const std::string title =
        setup.sequence + (full_rate ? "" : ", " + std::to_string(std::lround(setup.camera_rate_hz)) + " Hz");
    auto scene = std::find_if(scenes.begin(), scenes.end(), [&](const Scene& s) { return s.title == title; });
    if (scene == scenes.end()) scene = scenes.insert(scenes.end(), {title, {}});
    scene->runs.emplace_back(static_cast<std::size_t>(drawn - kDrawn.begin()), runs);
  }
  for (Scene& scene : scenes) {
    std::sort(scene.runs.begin(), scene.runs.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  }
  return scenes;
}

std::string legend(const std::vector<Scene>& scenes) {
  std::string out =
      "<div class=\"legend\"><button class=\"truth\" data-of=\"truth\" aria-pressed=\"true\"><i></i>truth</button>";
  for (std::size_t place = 0; place < kDrawn.size(); ++place) {
    const bool drawn = std::any_of(scenes.begin(), scenes.end(), [&](const Scene& scene) {
      return std::any_of(scene.runs.begin(), scene.runs.end(), [&](const auto& run) { return run.first == place; });
    });
    if (!drawn) continue;
    out += "<button class=\"" + colour(place) + "\" data-of=\"" + colour(place) + "\" aria-pressed=\"true\"><i></i>" +
           escaped(title_of(place)) + "</button>";
  }
  return out + "</div>\n";
}

std::string table_section(const Table& table) {
  const TableDefinition& definition = table.definition;
  std::string out = "<section data-axis=\"\"><h2>Table " + escaped(definition.id) + ". " + escaped(definition.title) +
                    "</h2><p>" + escaped(definition.text) + "</p>\n<div class=\"scroll\"><table><thead><tr><th></th>";
  for (const std::string& column : definition.printed_columns) out += "<th>" + escaped(column) + "</th>";
  for (const std::string& column : definition.our_columns) out += "<th class=\"e0\">" + escaped(column) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (std::size_t r = 0; r < definition.rows.size(); ++r) {
    out += "<tr><th>" + escaped(definition.rows[r].label) + "</th>";
    for (const std::string& printed : definition.rows[r].printed) out += "<td>" + escaped(printed) + "</td>";
    for (const Value& value : table.values[r]) out += "<td>" + escaped(text_of(value)) + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody></table></div></section>\n";
}

std::string seeds_text(const std::vector<std::uint64_t>& seeds) {
  std::string text;
  for (const std::uint64_t seed : seeds) text += (text.empty() ? "" : ", ") + std::to_string(seed);
  return text;
}

}  // namespace

std::string to_html(const std::vector<Table>& tables, const Origin& origin, const std::vector<Setup>& setups,
                    const Lookup& results) {
  const std::vector<Scene> scenes = scenes_of(setups, results);
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>Experiments</title>\n<style>";
  page += std::string(evaluation::kReportStyle) + "</style></head>\n<body><main>\n<h1>Experiments</h1>\n<p>" +
          escaped(origin.command) + "<br>On " + origin.kind + ", seeds " + seeds_text(origin.seeds) +
          ". Median of the seeds, in brackets the worst. Sources: estimator " + origin.estimator + ", simulator " +
          origin.simulator + ".</p>\n" + legend(scenes);
  for (const Table& table : tables) page += table_section(table);
  for (const Scene& scene : scenes) page += scene_section(scene);
  return page + "</main><div id=\"readout\"></div>\n<script>" + evaluation::kReportScript + "</script></body></html>\n";
}

}  // namespace ear::paper
