// Which recordings and runs are missing, and making them. Everything is kept under the hash of what made it: an
// interrupted or extended measurement goes on where it was, and a changed estimator or simulator measures anew.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/paper/catalogue.h"
#include "tools/paper/measure/result.h"

namespace ear::paper {

/// What holds for all runs.
struct Conditions {
  std::filesystem::path out;       ///< results below out/runs, recordings below out/recordings
  bool tracks = false;             ///< feature tracks in memory instead of rendered images
  std::optional<double> duration;  ///< [s] stop earlier
  std::vector<std::uint64_t> seeds;
  int threads = 2;  ///< recordings that are worked on at a time
  bool keep_recordings = true;
};

/// Where the result of a run is or will be. Two setups that differ in their names alone share it.
[[nodiscard]] std::filesystem::path result_file(const Conditions& conditions, const Setup& setup, std::uint64_t seed);

/// Makes all results that are missing, and tells how it goes on. Returns how many runs that were.
/// Throws std::runtime_error if the disk cannot hold the recordings.
std::size_t measure(const Conditions& conditions, const std::vector<Setup>& setups);

/// Results of one setup, in the order of the seeds. Throws std::runtime_error if one is missing.
[[nodiscard]] std::vector<Result> results_of(const Conditions& conditions, const Setup& setup);

}  // namespace ear::paper
