// Tracks that ended, or whose oldest clone is marginalised, as one measurement of the window: triangulated, linearised,
// gated one by one, and summed up. docs/filter.md, "Features".
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "ear/filter_config.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/records.h"
#include "filter/sources/cameras/feature_update.h"
#include "filter/sources/cameras/lens_pattern.h"
#include "filter/sources/cameras/tracks.h"

namespace ear {

class TrackUpdate {
 public:
  /// `focal_px`: pixels per unit of normalized image coordinates. `cameras`: 1 or 2.
  TrackUpdate(const FilterConfig& config, double focal_px, std::size_t cameras);

  /// Updates the state with the tracks that do not go on in `frame`, and with those that reach back to the oldest clone
  /// if that is marginalised next. Their observations are used up.
  void update(const FeatureFrame& frame, bool oldest_goes, CameraUpdate calibration, TrackTable& tracks, Ekf& ekf,
              Records& records);

  [[nodiscard]] const LensPattern& lens_pattern() const { return lens_pattern_; }
  void reset() { lens_pattern_.reset(); }

 private:
  void select(const FeatureFrame& frame, std::optional<std::uint64_t> oldest, const TrackTable& tracks);
  [[nodiscard]] bool continues(std::uint64_t id) const;
  bool add(const Track& track, const Ekf& ekf);
  void add_to_pattern(const Track& track, const CameraState& cameras);
  void add_observation(const State& x, int clone, std::size_t camera, const InverseDepthPoint& point,
                       const Eigen::Vector2d& uv);
  void log(const Ekf& ekf, Records& records) const;

  /// Of this frame's features, in one camera.
  struct Residuals {
    double squares_px2 = 0.0;
    int count = 0;  ///< one for each axis
  };

  FilterConfig config_;
  double focal_px_;
  std::size_t camera_count_;
  std::array<Residuals, 2> residuals_;
  LensPattern lens_pattern_;
  // Memory that is used again.
  FeatureInformation information_;
  std::vector<CameraPose> cameras_;
  std::vector<Sighting> sightings_;
  std::vector<LinearizedObservation> observations_;
  std::vector<std::size_t> selected_;
  std::vector<std::uint64_t> frame_ids_;  ///< of the frame at hand, ascending
};

}  // namespace ear
