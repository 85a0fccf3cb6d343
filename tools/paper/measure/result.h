// What one run came to, and its file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ear::paper {

/// One moment of a run. Positions are aligned to the truth (yaw), in the truth's world [m].
struct Moment {
  double t = 0.0;         ///< since the truth's first pose [s]
  double distance = 0.0;  ///< travelled [m]
  double x = 0.0, y = 0.0, z = 0.0;
  double true_x = 0.0, true_y = 0.0, true_z = 0.0;
  double error = 0.0;          ///< of the position, the first poses aligned [m]
  std::optional<double> nees;  ///< of the position, 3 degrees of freedom
};

/// Definitions of the figures: docs/evaluation.md.
struct Result {
  bool estimated = false;          ///< false: no two poses, or one that is not finite; all other figures are then 0
  double coverage = 0.0;           ///< share of the truth's time with an estimate
  double length = 0.0;             ///< [m]
  double ate = 0.0;                ///< RMSE [m]
  double z = 0.0;                  ///< RMSE [m]
  double rotation = 0.0;           ///< RMSE [deg]
  double start_to_end = 0.0;       ///< error of the last pose, the first aligned [m]
  double end_distance = 0.0;       ///< from the first to the last estimated position [m]
  double true_end_distance = 0.0;  ///< the same of the truth [m]
  std::optional<double> nees_position;
  std::optional<double> nees_orientation;
  double frame_ms = 0.0;        ///< processor time of a frame, median: with images the whole pipeline, else the filter
  double worst_frame_ms = 0.0;  ///< 99th percentile
  std::vector<Moment> moments;  ///< at most kMoments, evenly spread

  /// The estimate was there for most of the time. What is not counts as failed, as "-" in the paper's tables.
  [[nodiscard]] bool followed() const { return estimated && coverage >= 0.5; }
};

inline constexpr std::size_t kMoments = 400;

/// The file's text.
[[nodiscard]] std::string to_json(const Result& result);

/// Throws std::runtime_error, naming the file, if it holds no result.
[[nodiscard]] Result read_result(const std::filesystem::path& file);

/// Writes so that the file is either not there or complete, whenever the program is ended.
void write_complete(const std::filesystem::path& file, const std::string& text);

}  // namespace ear::paper
