#include "tools/evaluation/summary.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

namespace ear::evaluation {
namespace {

using Json = nlohmann::ordered_json;
using Getter = std::function<std::optional<double>(const Evaluation&)>;

SummaryRow row(const std::vector<Evaluation>& evaluations, const std::string& label, int decimals, bool less_is_better,
               const Getter& get) {
  SummaryRow result{label, {}, decimals, less_is_better};
  for (const Evaluation& evaluation : evaluations) result.values.push_back(get(evaluation));
  return result;
}

/// A distance without needless zeros: "5".
std::string metres_text(double metres) {
  std::ostringstream text;
  text << metres;
  return text.str();
}

/// The relative errors are rows of their own, one pair per distance that any of the evaluations reached.
void add_relative_rows(const std::vector<Evaluation>& evaluations, std::vector<SummaryRow>& rows) {
  std::vector<double> distances;
  for (const Evaluation& evaluation : evaluations)
    for (const RelativeError& relative : evaluation.relative) distances.push_back(relative.distance);
  std::sort(distances.begin(), distances.end());
  distances.erase(std::unique(distances.begin(), distances.end()), distances.end());

  const auto find = [](const Evaluation& evaluation, double distance) -> const RelativeError* {
    for (const RelativeError& relative : evaluation.relative)
      if (relative.distance == distance) return &relative;
    return nullptr;
  };
  for (const double distance : distances) {
    const std::string label = "RPE over " + metres_text(distance) + " m ";
    rows.push_back(row(evaluations, label + "[%]", 3, true, [&](const Evaluation& e) -> std::optional<double> {
      const RelativeError* relative = find(e, distance);
      return relative != nullptr ? std::optional(100.0 * relative->translation) : std::nullopt;
    }));
    rows.push_back(row(evaluations, label + "[deg/m]", 4, true, [&](const Evaluation& e) -> std::optional<double> {
      const RelativeError* relative = find(e, distance);
      return relative != nullptr ? std::optional(kDegPerRad * relative->rotation) : std::nullopt;
    }));
  }
}

void add_nees_rows(const std::vector<Evaluation>& evaluations, std::vector<SummaryRow>& rows) {
  if (std::none_of(evaluations.begin(), evaluations.end(), [](const Evaluation& e) { return e.nees.has_value(); }))
    return;
  using Value = std::optional<double>;
  const auto add = [&](const std::string& label, int decimals, const std::function<Value(const Evaluation&)>& get) {
    rows.push_back(row(evaluations, label, decimals, false, [get](const Evaluation& e) -> Value {
      return e.nees && e.nees->frames > 0 ? get(e) : std::nullopt;
    }));
  };
  const auto of_attitude = [](const Evaluation& e, double value) {
    return e.truth_has_attitude ? Value(value) : std::nullopt;
  };
  add("NEES position, mean (3)", 2, [](const Evaluation& e) { return e.nees->position.mean; });
  add("  inside 95 % band [%]", 1, [](const Evaluation& e) { return 100.0 * e.nees->position.inside; });
  add("NEES orientation, mean (3)", 2, [&](const Evaluation& e) { return of_attitude(e, e.nees->orientation.mean); });
  add("  inside 95 % band [%]", 1,
      [&](const Evaluation& e) { return of_attitude(e, 100.0 * e.nees->orientation.inside); });
}

/// What the health says where the position is far off; nothing where no estimate has a health.
void add_health_rows(const std::vector<Evaluation>& evaluations, std::vector<SummaryRow>& rows) {
  if (std::none_of(evaluations.begin(), evaluations.end(),
                   [](const Evaluation& e) { return e.false_tracking.has_value(); }))
    return;
  const auto add = [&](const std::string& label, double FalseTracking::*share) {
    rows.push_back(row(evaluations, label, 1, true, [share](const Evaluation& e) {
      return e.false_tracking ? std::optional(100.0 * ((*e.false_tracking).*share)) : std::nullopt;
    }));
  };
  add("position far off [% of time]", &FalseTracking::far_off);
  add("  of that false tracking [% of time]", &FalseTracking::share);
}

void add_terrain_rows(const std::vector<Evaluation>& evaluations, std::vector<SummaryRow>& rows) {
  using Value = std::optional<double>;
  const auto add = [&](const std::string& label, int decimals, bool less_is_better,
                       const std::function<Value(const TerrainFigures&)>& get) {
    SummaryRow added = row(evaluations, label, decimals, less_is_better,
                           [&](const Evaluation& e) { return e.terrain ? get(*e.terrain) : std::nullopt; });
    if (std::any_of(added.values.begin(), added.values.end(), [](const Value& value) { return value.has_value(); }))
      rows.push_back(std::move(added));
  };
  const auto add_angle = [&](const std::string& label, std::optional<SlopeError> TerrainFigures::*angle) {
    add(label + " RMSE [deg]", 3, true,
        [&](const TerrainFigures& t) { return t.*angle ? Value(kDegPerRad * (t.*angle)->rmse) : std::nullopt; });
    add("  inside 3 sigma [%]", 1, false,
        [&](const TerrainFigures& t) { return t.*angle ? Value(100.0 * (t.*angle)->inside) : std::nullopt; });
  };
  add("z RMSE on the ground [m]", 4, true, [](const TerrainFigures& t) { return t.z_rmse; });
  add_angle("slope along", &TerrainFigures::along);
  add_angle("slope across", &TerrainFigures::across);
  add("ground or air, right [%]", 1, false,
      [](const TerrainFigures& t) { return t.mode_agreement ? Value(100.0 * *t.mode_agreement) : std::nullopt; });
}

std::size_t largest_width(const std::vector<std::string>& texts) {
  std::size_t width = 0;
  for (const std::string& text : texts) width = std::max(width, text.size());
  return width;
}

Json to_json(const Consistency& consistency) { return {{"mean", consistency.mean}, {"inside_95", consistency.inside}}; }

Json nees_json(const Evaluation& evaluation) {
  if (!evaluation.nees) return nullptr;
  const Nees& nees = *evaluation.nees;
  return {
      {"frames", nees.frames},
      {"skipped", nees.skipped},
      {"position", nees.frames > 0 ? to_json(nees.position) : Json(nullptr)},
      {"orientation", nees.frames > 0 && evaluation.truth_has_attitude ? to_json(nees.orientation) : Json(nullptr)}};
}

Json false_tracking_json(const Evaluation& evaluation) {
  if (!evaluation.false_tracking) return nullptr;
  Json stretches = Json::array();
  for (const FarOff& off : evaluation.false_tracking->stretches)
    stretches.push_back({{"from_ns", off.from_ns},
                         {"to_ns", off.to_ns},
                         {"tracking_s", off.tracking},
                         {"largest_error_m", off.largest_error},
                         {"travelled_m", off.travelled},
                         {"most_sigmas", off.most_sigmas}});
  return {{"percent", 100.0 * evaluation.false_tracking->share},
          {"far_off_percent", 100.0 * evaluation.false_tracking->far_off},
          {"stretches", stretches}};
}

Json relative_json(const Evaluation& evaluation) {
  Json list = Json::array();
  for (const RelativeError& relative : evaluation.relative)
    list.push_back({{"distance_m", relative.distance},
                    {"stretches", relative.stretches},
                    {"translation_percent", 100.0 * relative.translation},
                    {"rotation_deg_per_m", kDegPerRad * relative.rotation}});
  return list;
}

Json to_json(const std::optional<SlopeError>& error) {
  if (!error) return nullptr;
  return {{"poses", error->poses}, {"rmse_deg", kDegPerRad * error->rmse}, {"inside_3_sigma", error->inside}};
}

Json terrain_json(const Evaluation& evaluation) {
  if (!evaluation.terrain) return nullptr;
  const TerrainFigures& terrain = *evaluation.terrain;
  const auto optional = [](const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); };
  return {{"ground_poses", terrain.ground_poses},
          {"z_rmse_m", optional(terrain.z_rmse)},
          {"mode_agreement", optional(terrain.mode_agreement)},
          {"slope_along", to_json(terrain.along)},
          {"slope_across", to_json(terrain.across)}};
}

Json to_json(const Evaluation& e) {
  return {{"name", e.name},
          {"poses", e.poses},
          {"matched", e.matched},
          {"outside_truth", e.outside},
          {"in_truth_gaps", e.in_gaps},
          {"rotation_from", e.rotation_from_attitude ? "attitude" : "positions"},
          {"duration_s", e.duration},
          {"coverage", e.coverage},
          {"length_m", e.length},
          {"ate_rmse_m", e.position_rmse},
          {"ate_percent", e.position_ratio ? Json(100.0 * *e.position_ratio) : Json(nullptr)},
          {"ate_max_m", e.position_max},
          {"z_rmse_m", e.z_rmse},
          {"rotation_rmse_deg", e.truth_has_attitude ? Json(kDegPerRad * e.rotation_rmse) : Json(nullptr)},
          {"rpe", relative_json(e)},
          {"start_to_end",
           {{"error_m", e.start_to_end.error},
            {"estimated_m", e.start_to_end.estimated},
            {"truth_m", e.start_to_end.truth},
            {"difference_m", e.start_to_end.difference}}},
          {"nees", nees_json(e)},
          {"false_tracking", false_tracking_json(e)},
          {"ground", terrain_json(e)}};
}

}  // namespace

std::string to_string(AlignmentKind kind) {
  switch (kind) {
    case AlignmentKind::se3:
      return "se3";
    case AlignmentKind::yaw:
      return "yaw";
    case AlignmentKind::none:
      break;
  }
  return "none";
}

std::vector<SummaryRow> summary_rows(const std::vector<Evaluation>& evaluations) {
  using E = Evaluation;
  const auto make = [&](const std::string& label, int decimals, bool less_is_better, const Getter& get) {
    return row(evaluations, label, decimals, less_is_better, get);
  };
  std::vector<SummaryRow> rows{
      make("length [m]", 2, false, [](const E& e) { return e.length; }),
      make("duration [s]", 2, false, [](const E& e) { return e.duration; }),
      make("coverage [%]", 1, false, [](const E& e) { return 100.0 * e.coverage; }),
      make("ATE RMSE [m]", 4, true, [](const E& e) { return e.position_rmse; }),
      make("ATE RMSE [% of length]", 3, true,
           [](const E& e) { return e.position_ratio ? std::optional(100.0 * *e.position_ratio) : std::nullopt; }),
      make("largest error [m]", 4, true, [](const E& e) { return e.position_max; }),
      make("z RMSE [m]", 4, true, [](const E& e) { return e.z_rmse; }),
      make(
          "rotation RMSE [deg]", 3, true,
          [](const E& e) { return e.truth_has_attitude ? std::optional(kDegPerRad * e.rotation_rmse) : std::nullopt; }),
      make("start-to-end error [m]", 4, true, [](const E& e) { return e.start_to_end.error; }),
      make("|end - start|, off by [m]", 4, true, [](const E& e) { return e.start_to_end.difference; }),
  };
  add_relative_rows(evaluations, rows);
  add_terrain_rows(evaluations, rows);
  add_nees_rows(evaluations, rows);
  add_health_rows(evaluations, rows);
  return rows;
}

std::string value_text(const SummaryRow& row, std::size_t evaluation) {
  if (!row.values[evaluation]) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(row.decimals) << *row.values[evaluation];
  return text.str();
}

std::vector<std::string> notes(const std::vector<Evaluation>& evaluations) {
  std::vector<std::string> result;
  for (const Evaluation& e : evaluations) {
    const std::string total = " of " + std::to_string(e.poses) + " poses ";
    if (e.outside > 0)
      result.push_back(e.name + ": " + std::to_string(e.outside) + total + "before or after the truth are not counted");
    if (e.in_gaps > 0)
      result.push_back(e.name + ": " + std::to_string(e.in_gaps) + total + "in gaps of the truth are not counted");
    if (!e.truth_has_attitude)
      result.push_back(e.name + ": the truth is positions alone; the yaw between the worlds is that of all positions");
    if (e.rotation_from_attitude)
      result.push_back(e.name + ": the positions do not tell the rotation between the worlds; it comes from attitudes");
    if (e.nees && e.nees->skipped > 0)
      result.push_back(e.name + ": " + std::to_string(e.nees->skipped) + total +
                       "have a covariance without an inverse");
  }
  return result;
}

std::string to_table(const std::vector<Evaluation>& evaluations) {
  const std::vector<SummaryRow> rows = summary_rows(evaluations);
  std::vector<std::string> labels;
  labels.reserve(rows.size());
  for (const SummaryRow& r : rows) labels.push_back(r.label);
  const auto label_width = static_cast<int>(largest_width(labels));

  std::vector<int> widths;
  for (std::size_t i = 0; i < evaluations.size(); ++i) {
    std::vector<std::string> column{evaluations[i].name};
    for (const SummaryRow& r : rows) column.push_back(value_text(r, i));
    widths.push_back(2 + static_cast<int>(largest_width(column)));
  }

  std::ostringstream text;
  text << std::left << std::setw(label_width) << ("alignment: " + to_string(evaluations.front().kind)) << std::right;
  for (std::size_t i = 0; i < evaluations.size(); ++i) text << std::setw(widths[i]) << evaluations[i].name;
  text << '\n';
  for (const SummaryRow& r : rows) {
    text << std::left << std::setw(label_width) << r.label << std::right;
    for (std::size_t i = 0; i < evaluations.size(); ++i) text << std::setw(widths[i]) << value_text(r, i);
    text << '\n';
  }
  for (const std::string& note : notes(evaluations)) text << note << '\n';
  return text.str();
}

std::string to_json(const std::vector<Evaluation>& evaluations, const std::string& truth) {
  Json list = Json::array();
  for (const Evaluation& evaluation : evaluations) list.push_back(to_json(evaluation));
  return Json{{"truth", truth}, {"align", to_string(evaluations.front().kind)}, {"estimates", list}}.dump(2) + "\n";
}

}  // namespace ear::evaluation
