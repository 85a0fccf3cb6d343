// Results to files: estimate.tum, states.csv, summary.json. docs/recordings.md lists their fields.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "src/recording/warnings.h"

namespace ear {

/// A text file that is written line by line and throws when it cannot be (a full disk, for example).
class OutputFile {
 public:
  /// Throws InputError if the file cannot be created.
  explicit OutputFile(const std::filesystem::path& file);

  /// Appends text. Throws InputError if that fails.
  void write(const std::string& text);

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

/// The trajectory of the body as TUM's tools and evo read it: t [s] x y z [m] qx qy qz qw, one line per estimate.
class TumWriter {
 public:
  explicit TumWriter(const std::filesystem::path& file) : out_(file) {}
  void write(const NavState& state);
  void write(const Estimate& estimate) { write(estimate.state); }

 private:
  OutputFile out_;
};

/// State, covariance, weights, mode and health of every frame, with a heading that names the columns.
class StatesWriter {
 public:
  explicit StatesWriter(const std::filesystem::path& file);
  /// `health`: the estimate's health in words, for people; its commas become semicolons.
  void write(const Estimate& estimate, std::string health);

 private:
  OutputFile out_;
};

/// What the estimator reported of itself from some moment on.
struct HealthChange {
  TimeNs t_ns = 0;
  std::string text;
};

/// What a run read, did and took.
struct RunSummary {
  std::string recording;
  std::vector<std::pair<std::string, std::uint64_t>> counts;  ///< "frames", "estimates", "imu_gaps", ...
  double duration_s = 0.0;                                    ///< length of the recording [s]
  double wall_time_s = 0.0;                                   ///< time that the run took [s]
  std::vector<std::pair<std::string, double>> stage_times_s;  ///< whole run, per stage [s]
  Calibration calibration;                                    ///< with what was learned while running
  std::vector<HealthChange> health;                           ///< every change, the first ones of very many
  std::vector<Warning> warnings;
};

/// Writes summary.json. Throws InputError if that fails.
void write_summary(const RunSummary& summary, const std::filesystem::path& file);

}  // namespace ear
