// Tracks that ended, or whose oldest clone is marginalised, as one measurement of the window: triangulated, linearised,
// gated one by one, and summed up. docs/filter.md, "Features".
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "ear/filter_config.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/iterated_update.h"
#include "filter/ekf/records.h"
#include "filter/sources/cameras/feature_update.h"
#include "filter/sources/cameras/lens_pattern.h"
#include "filter/sources/cameras/tracks.h"

namespace ear {

/// Which tracks update the state.
enum class UsedTracks : std::uint8_t {
  ended,       ///< those that do not go on to the newest clone
  oldest_too,  ///< and those that reach back to the oldest one, which is marginalised next
  all          ///< after a gap: those that go on first, all together
};

class TrackUpdate {
 public:
  /// `focal_px`: pixels per unit of normalized image coordinates.
  TrackUpdate(const FilterConfig& config, double focal_px);

  /// Updates the state with the tracks. Their observations are used up.
  void update(UsedTracks use, CameraUpdate calibration, TrackTable& tracks, Ekf& ekf, Records& records);

  [[nodiscard]] const LensPattern& lens_pattern() const { return lens_pattern_; }
  void reset() { lens_pattern_.reset(); }

 private:
  [[nodiscard]] double sigma() const { return config_.feature_sigma_px / focal_px_; }  ///< of an observation, usually
  void select(const State& x, UsedTracks use, const TrackTable& tracks);
  /// The rows of the selected tracks, by the poses of `at`. `again`: where an update found the state to be.
  void linearize(const TrackTable& tracks, const State& at, bool again, const Ekf& ekf);
  /// The rows become those of where they move the state to.
  void iterate(const TrackTable& tracks, CameraUpdate calibration, Ekf& ekf);
  bool add(const Track& track, const State& x, bool again, const Ekf& ekf);
  /// Normalized: what the linearisation leaves out of where the feature of `sightings_`, with this inverse depth [1/m],
  /// is seen.
  [[nodiscard]] double left_out(const Track& track, double inverse_depth, bool again, const Ekf& ekf) const;
  /// Of the left camera's way from one clone to another [m^2]. `again`: after the update at hand.
  [[nodiscard]] Eigen::Matrix3d way_covariance(int from, int to, bool again, const Ekf& ekf) const;
  void add_to_pattern(const Track& track, const CameraState& cameras);
  void log(const Ekf& ekf, Records& records) const;

  /// Of this frame's features, in one camera.
  struct Residuals {
    double squares_px2 = 0.0;
    int count = 0;  ///< one for each axis
  };

  FilterConfig config_;
  double focal_px_;
  std::array<Residuals, 2> residuals_;
  LensPattern lens_pattern_;
  UsedTracks use_ = UsedTracks::ended;  ///< now
  double most_left_out_ = 0.0;          ///< of all tracks, over the noise of an image
  // Memory that is used again.
  FeatureInformation information_;
  std::vector<CameraPose> cameras_;
  std::vector<Sighting> sightings_;
  std::vector<LinearizedObservation> observations_;
  std::vector<std::size_t> selected_;
  std::vector<bool> used_;  ///< of these
  IteratedUpdate iterated_;
};

}  // namespace ear
