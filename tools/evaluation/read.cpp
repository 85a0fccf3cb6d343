#include "tools/evaluation/read.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <stdexcept>

#include "tools/evaluation/text_table.h"

namespace ear::evaluation {
namespace {

namespace fs = std::filesystem;

constexpr double kQuaternionTolerance = 0.01;  // rounding to three digits passes, a shifted column does not

/// Where a pose stands in a row, with the names that errors use.
struct PoseColumns {
  std::size_t time = 0;
  int time_exponent = 0;  // 0: nanoseconds, 9: seconds
  std::array<std::size_t, 3> p{};
  std::array<std::size_t, 4> q_wxyz{};
};

constexpr PoseColumns kEurocColumns{0, 0, {1, 2, 3}, {4, 5, 6, 7}};
constexpr PoseColumns kTumColumns{0, 9, {1, 2, 3}, {7, 4, 5, 6}};
constexpr std::array<const char*, 3> kPositionNames{"p_x", "p_y", "p_z"};
constexpr std::array<const char*, 4> kQuaternionNames{"q_w", "q_x", "q_y", "q_z"};
constexpr std::array<const char*, 6> kErrorNames{"x", "y", "z", "rx", "ry", "rz"};

PoseColumns named_columns(const TextTable& table) {
  PoseColumns columns;
  columns.time = table.required_column("t_ns");
  for (std::size_t i = 0; i < 3; ++i) columns.p[i] = table.required_column(kPositionNames[i]);
  for (std::size_t i = 0; i < 4; ++i) columns.q_wxyz[i] = table.required_column(kQuaternionNames[i]);
  return columns;
}

PoseColumns pose_columns(const TextTable& table) {
  if (table.column("t_ns")) return named_columns(table);
  if (table.columns() < 8)
    table.fail("neither TUM (8 columns), nor EuRoC csv (8 or more), nor a csv with a column 't_ns' in its header");
  return table.has_commas() ? kEurocColumns : kTumColumns;
}

Pose read_pose(const TextTable& table, const Row& row, const PoseColumns& columns) {
  Pose pose;
  pose.t_ns = table.time(row, columns.time, "time", columns.time_exponent);
  for (std::size_t i = 0; i < 3; ++i)
    pose.p_WB(static_cast<Eigen::Index>(i)) = table.number(row, columns.p[i], kPositionNames[i]);
  std::array<double, 4> q{};
  for (std::size_t i = 0; i < 4; ++i) q[i] = table.number(row, columns.q_wxyz[i], kQuaternionNames[i]);
  pose.q_WB = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  const double norm = pose.q_WB.norm();
  if (std::abs(norm - 1.0) > kQuaternionTolerance)
    table.fail(row, columns.q_wxyz[0], kQuaternionNames[0], "quaternion of length " + std::to_string(norm));
  pose.q_WB.normalize();
  return pose;
}

Pose read_position(const TextTable& table, const Row& row) {
  Pose pose;
  pose.t_ns = table.time(row, kEurocColumns.time, "time", kEurocColumns.time_exponent);
  for (std::size_t i = 0; i < 3; ++i)
    pose.p_WB(static_cast<Eigen::Index>(i)) = table.number(row, kEurocColumns.p[i], kPositionNames[i]);
  return pose;
}

bool has_positions_alone(const TextTable& table) {
  return table.has_commas() && !table.column("t_ns") && table.columns() >= 4 && table.columns() < 8;
}

Trajectory read_poses(const TextTable& table, bool positions_alone = false) {
  const PoseColumns columns = positions_alone ? kEurocColumns : pose_columns(table);
  Trajectory poses;
  poses.reserve(table.rows().size());
  for (const Row& row : table.rows()) {
    const Pose pose = positions_alone ? read_position(table, row) : read_pose(table, row, columns);
    if (!poses.empty() && pose.t_ns <= poses.back().t_ns)
      table.fail(row, columns.time, "time", "not later than the line before");
    poses.push_back(pose);
  }
  return poses;
}

std::string covariance_name(std::size_t i, std::size_t j) {
  return std::string("cov_") + kErrorNames[i] + "_" + kErrorNames[j];
}

/// One covariance per row, or nothing if the file has no such columns. All 21 of the upper triangle must be there.
std::vector<PoseCovariance> read_covariances(const TextTable& table) {
  if (!table.column(covariance_name(0, 0))) return {};
  std::vector<PoseCovariance> covariances(table.rows().size());
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) {
      const std::string name = covariance_name(i, j);
      const std::size_t column = table.required_column(name);
      const auto a = static_cast<Eigen::Index>(i);
      const auto b = static_cast<Eigen::Index>(j);
      for (std::size_t k = 0; k < covariances.size(); ++k)
        covariances[k](a, b) = covariances[k](b, a) = table.number(table.rows()[k], column, name);
    }
  }
  return covariances;
}

/// One entry per row, or nothing if the file says nothing about the ground.
std::vector<TerrainEstimate> read_terrain_estimates(const TextTable& table) {
  if (!table.column("on_ground")) return {};
  const std::size_t on_ground = table.required_column("on_ground");
  const bool with_slope = table.column("slope_along").has_value();
  constexpr std::array<const char*, 4> kNames{"slope_along", "slope_across", "sigma_slope_along", "sigma_slope_across"};
  std::array<std::size_t, 4> columns{};
  for (std::size_t i = 0; with_slope && i < kNames.size(); ++i) columns[i] = table.required_column(kNames[i]);

  std::vector<TerrainEstimate> result;
  for (const Row& row : table.rows()) {
    TerrainEstimate estimate;
    estimate.on_ground = table.flag(row, on_ground, "on_ground");
    if (with_slope && table.optional_number(row, columns[0], kNames[0])) {
      const auto value = [&](std::size_t i) { return table.number(row, columns[i], kNames[i]); };
      estimate.slope = Slope{value(0), value(1)};
      estimate.sigma = {value(2), value(3)};
    }
    result.push_back(estimate);
  }
  return result;
}

std::vector<std::string> read_labels(const TextTable& table, const std::string& name) {
  const std::optional<std::size_t> column = table.column(name);
  if (!column) return {};
  std::vector<std::string> labels;
  for (const Row& row : table.rows()) labels.push_back(row.fields[*column]);
  return labels;
}

/// Column `anomalous` of docs/recordings.md in words.
std::vector<std::string> read_anomalous(const TextTable& table) {
  constexpr std::array<const char*, 5> kTexts{"", "imu", "odometer", "camera", "one of two"};
  const std::optional<std::size_t> column = table.column("anomalous");
  if (!column) return {};
  std::vector<std::string> labels;
  for (const Row& row : table.rows()) {
    const double code = table.number(row, *column, "anomalous");
    if (!(code >= 0.0 && code < kTexts.size() && code == std::floor(code)))
      table.fail(row, *column, "anomalous", "not one of 0 to 4");
    labels.emplace_back(kTexts[static_cast<std::size_t>(code)]);
  }
  return labels;
}

/// One entry per row, or nothing if the file has no weights. All three must be there.
std::vector<SensorWeights> read_weights(const TextTable& table) {
  if (!table.column("weight_imu")) return {};
  const std::size_t imu = table.required_column("weight_imu");
  const std::size_t odometer = table.required_column("weight_odometer");
  const std::size_t camera = table.required_column("weight_camera");
  std::vector<SensorWeights> weights;
  for (const Row& row : table.rows())
    weights.push_back({table.number(row, imu, "weight_imu"), table.number(row, odometer, "weight_odometer"),
                       table.number(row, camera, "weight_camera")});
  return weights;
}

/// The file of an estimate or truth given by its folder; a file is itself.
fs::path file_in(const fs::path& path, const std::vector<fs::path>& candidates) {
  if (!fs::exists(path)) throw std::runtime_error(path.string() + ": does not exist");
  if (!fs::is_directory(path)) return path;
  for (const fs::path& candidate : candidates)
    if (fs::exists(path / candidate)) return path / candidate;
  std::string wanted;
  for (const fs::path& candidate : candidates) wanted += (wanted.empty() ? "" : " or ") + candidate.string();
  throw std::runtime_error(path.string() + ": the folder holds no " + wanted);
}

TextTable truth_table(const fs::path& path) {
  return TextTable(
      file_in(path, {"mav0/state_groundtruth_estimate0/data.csv", "state_groundtruth_estimate0/data.csv"}));
}

/// The last `count` folders of a path and nothing else, or all of it if it has fewer.
std::string last_parts(const fs::path& path, std::size_t count) {
  const std::vector<fs::path> parts(path.begin(), path.end());
  fs::path result;
  for (std::size_t i = parts.size() - std::min(count, parts.size()); i < parts.size(); ++i) result /= parts[i];
  return result.string();
}

/// Level 0: the stem. Level n: the n folders above a file, or the last n + 1 parts of a folder.
std::string name_at_level(const fs::path& path, std::size_t level) {
  const fs::path clean = path.has_filename() ? path : path.parent_path();
  if (fs::is_directory(clean)) return last_parts(fs::absolute(clean).lexically_normal(), level + 1);
  if (level == 0) return clean.stem().string();
  return last_parts(fs::absolute(clean).lexically_normal().parent_path(), level);
}

bool all_different(const std::vector<std::string>& names) {
  return std::set<std::string>(names.begin(), names.end()).size() == names.size();
}

}  // namespace

Trajectory read_truth(const fs::path& path) { return read_poses(truth_table(path)); }

Truth read_truth_or_positions(const fs::path& path) {
  const TextTable table = truth_table(path);
  Truth truth;
  truth.has_attitude = !has_positions_alone(table);
  truth.poses = read_poses(table, !truth.has_attitude);
  return truth;
}

std::vector<TerrainTruth> read_terrain(const fs::path& recording) {
  fs::path file = recording / "mav0" / "truth_extra.csv";
  if (!fs::exists(file)) file = recording / "truth_extra.csv";
  if (!fs::exists(file)) return {};
  const TextTable table(file);
  constexpr std::array<const char*, 4> kNames{"timestamp [ns]", "mode [0 ground 1 air]", "slope_along [rad]",
                                              "slope_across [rad]"};
  std::array<std::size_t, 4> columns{};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (!table.column(kNames[i])) return {};  // somebody else's file of that name
    columns[i] = *table.column(kNames[i]);
  }
  std::vector<TerrainTruth> terrain;
  for (const Row& row : table.rows()) {
    const TerrainTruth truth{table.time(row, columns[0], kNames[0], 0),
                             !table.flag(row, columns[1], kNames[1]),
                             {table.number(row, columns[2], kNames[2]), table.number(row, columns[3], kNames[3])}};
    if (!terrain.empty() && truth.t_ns <= terrain.back().t_ns)
      table.fail(row, columns[0], kNames[0], "not later than the line before");
    terrain.push_back(truth);
  }
  return terrain;
}

Estimate read_estimate(const fs::path& path) {
  const TextTable table(file_in(path, {"states.csv", "estimate.tum"}));
  Estimate estimate;
  estimate.poses = read_poses(table);
  estimate.covariance = read_covariances(table);
  estimate.terrain = read_terrain_estimates(table);
  estimate.mode = read_labels(table, "mode");
  estimate.health = read_labels(table, "health");
  estimate.anomalous = read_anomalous(table);
  estimate.weights = read_weights(table);
  return estimate;
}

std::vector<std::string> distinct_names(const std::vector<fs::path>& paths) {
  constexpr std::size_t kDeepest = 8;
  std::vector<std::string> names;
  for (std::size_t level = 0; level <= kDeepest; ++level) {
    names.clear();
    for (const fs::path& path : paths) names.push_back(name_at_level(path, level));
    if (all_different(names)) return names;
  }
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = paths[i].string();
  return names;
}

}  // namespace ear::evaluation
