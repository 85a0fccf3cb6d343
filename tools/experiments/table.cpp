#include "tools/experiments/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "tools/experiments/statistics.h"

namespace ear::experiments {
namespace {

using Json = nlohmann::ordered_json;
using Values = std::vector<double>;
using Field = std::optional<double> Figures::*;

double worst(const Values& values) { return *std::max_element(values.begin(), values.end()); }

struct NamedField {
  const char* key;
  Field field;
};

constexpr std::array<NamedField, 22> kFields{{
    {"length_m", &Figures::length},
    {"ate_rmse_m", &Figures::ate_rmse},
    {"ate_percent", &Figures::ate_percent},
    {"z_rmse_m", &Figures::z_rmse},
    {"z_rmse_ground_m", &Figures::z_rmse_ground},
    {"rotation_rmse_deg", &Figures::rotation_rmse},
    {"start_to_end_m", &Figures::start_to_end},
    {"nees_position", &Figures::nees_position},
    {"nees_orientation", &Figures::nees_orientation},
    {"sigma_position_m", &Figures::sigma_position},
    {"sigma_orientation_deg", &Figures::sigma_orientation},
    {"slope_along_rmse_deg", &Figures::slope_along_rmse},
    {"slope_across_rmse_deg", &Figures::slope_across_rmse},
    {"slope_along_inside_percent", &Figures::slope_along_inside},
    {"slope_across_inside_percent", &Figures::slope_across_inside},
    {"mode_agreement_percent", &Figures::mode_agreement},
    {"coverage_percent", &Figures::coverage},
    {"false_tracking_percent", &Figures::false_tracking},
    {"features_rejected_percent", &Figures::features_rejected},
    {"wheel_rows_rejected_percent", &Figures::wheel_rows_rejected},
    {"beams_rejected_percent", &Figures::beams_rejected},
    {"frame_time_ms", &Figures::frame_time},
}};

struct Column {
  const char* label;
  Field field;
  double (*over_seeds)(const Values&);
};

double median_of(const Values& values) { return median(values); }

constexpr std::array<Column, 24> kColumns{{
    {"length [m]", &Figures::length, median_of},
    {"ATE [m]", &Figures::ate_rmse, median_of},
    {"worst", &Figures::ate_rmse, worst},
    {"ATE [%]", &Figures::ate_percent, median_of},
    {"worst", &Figures::ate_percent, worst},
    {"z [m]", &Figures::z_rmse, median_of},
    {"z on ground", &Figures::z_rmse_ground, median_of},
    {"rotation [deg]", &Figures::rotation_rmse, median_of},
    {"start-end [m]", &Figures::start_to_end, median_of},
    {"sigma p [m]", &Figures::sigma_position, median_of},
    {"sigma R [deg]", &Figures::sigma_orientation, median_of},
    {"NEES p", &Figures::nees_position, mean},
    {"NEES R", &Figures::nees_orientation, mean},
    {"slope along [deg]", &Figures::slope_along_rmse, median_of},
    {"in 3 sigma [%]", &Figures::slope_along_inside, mean},
    {"slope across [deg]", &Figures::slope_across_rmse, median_of},
    {"in 3 sigma [%]", &Figures::slope_across_inside, mean},
    {"mode right [%]", &Figures::mode_agreement, mean},
    {"coverage [%]", &Figures::coverage, mean},
    {"false tracking [%]", &Figures::false_tracking, mean},
    {"features rejected [%]", &Figures::features_rejected, mean},
    {"wheel rows", &Figures::wheel_rows_rejected, mean},
    {"beams", &Figures::beams_rejected, mean},
    {"time per frame [ms]", &Figures::frame_time, median_of},
}};

/// Three significant digits, whole numbers from 1000 on.
std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), std::abs(value) < 999.5 ? "%.3g" : "%.0f", value);
  return text.data();
}

bool same(const Setup& a, const Setup& b) {
  const auto tie = [](const Setup& s) {
    return std::tie(s.sequence, s.camera_rate_hz, s.odometer, s.true_calibration, s.settings);
  };
  return tie(a) == tie(b);
}

/// The runs of each setup.
std::vector<std::vector<Run>> rows_of(const std::vector<Run>& runs) {
  std::vector<std::vector<Run>> rows;
  for (const Run& run : runs) {
    const auto row =
        std::find_if(rows.begin(), rows.end(), [&](const std::vector<Run>& r) { return same(r[0].setup, run.setup); });
    if (row != rows.end()) {
      row->push_back(run);
    } else {
      rows.push_back({run});
    }
  }
  return rows;
}

Values values_of(const std::vector<Run>& runs, Field field) {
  Values values;
  for (const Run& run : runs) {
    if (const std::optional<double>& value = run.figures.*field) values.push_back(*value);
  }
  return values;
}

const char* calibration_text(const Setup& setup) { return setup.true_calibration ? "true" : "wrong"; }

}  // namespace

std::string to_markdown(const std::vector<Run>& runs) {
  std::vector<Column> columns;
  std::copy_if(kColumns.begin(), kColumns.end(), std::back_inserter(columns),
               [&](const Column& column) { return !values_of(runs, column.field).empty(); });

  std::string text = "| sequence | Hz | odometer | calibration | settings | seeds |";
  std::string rule = "|---|---|---|---|---|---|";
  for (const Column& column : columns) {
    text += std::string(" ") + column.label + " |";
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const std::vector<Run>& row : rows_of(runs)) {
    const Setup& setup = row.front().setup;
    const std::size_t estimated = values_of(row, &Figures::ate_rmse).size();
    text += "| " + setup.sequence + " | " + number_text(setup.camera_rate_hz) + " | " + setup.odometer + " | " +
            calibration_text(setup) + " | " + setup.settings + " | ";
    text += (estimated < row.size() ? std::to_string(estimated) + " of " : "") + std::to_string(row.size()) + " |";
    for (const Column& column : columns) {
      const Values values = values_of(row, column.field);
      text += values.empty() ? " - |" : " " + number_text(column.over_seeds(values)) + " |";
    }
    text += "\n";
  }
  return text;
}

std::string to_json(const std::vector<Run>& runs) {
  Json list = Json::array();
  for (const Run& run : runs) {
    Json item{{"sequence", run.setup.sequence}, {"camera_rate_hz", run.setup.camera_rate_hz},
              {"odometer", run.setup.odometer}, {"calibration", calibration_text(run.setup)},
              {"settings", run.setup.settings}, {"seed", run.seed}};
    for (const NamedField& field : kFields) {
      const std::optional<double>& value = run.figures.*field.field;
      item[field.key] = value ? Json(*value) : Json(nullptr);
    }
    list.push_back(item);
  }
  return list.dump(2) + "\n";
}

}  // namespace ear::experiments
