// Truths and estimates from files. All functions throw std::runtime_error that names file, line and field.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

/// The truth of a recording (its folder), or a file: EuRoC csv, TUM, or a states.csv.
[[nodiscard]] Trajectory read_truth(const std::filesystem::path& path);

/// The same; also a csv of positions alone: time [ns], x, y, z [m], and up to three columns that nobody reads.
[[nodiscard]] Truth read_truth_or_positions(const std::filesystem::path& path);

/// What a simulated recording (its folder) knows of the ground: its truth_extra.csv. Empty where there is none.
[[nodiscard]] std::vector<TerrainTruth> read_terrain(const std::filesystem::path& recording);

/// An estimate: the output folder of a run (states.csv if it is there, else estimate.tum), or any file that read_truth
/// takes. Only a states.csv holds covariance, ground, mode, health and weights. The name stays empty: see
/// distinct_names().
[[nodiscard]] Estimate read_estimate(const std::filesystem::path& path);

/// Short names that tell the paths apart: the stem; where stems are equal, as many folders above it as it takes.
[[nodiscard]] std::vector<std::string> distinct_names(const std::vector<std::filesystem::path>& paths);

}  // namespace ear::evaluation
