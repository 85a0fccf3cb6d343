// The cameras as a source: the features of a frame are checked, become a clone with tracks, and tracks that end update
// the filter. docs/filter.md, "Features", "Window", "Poor light".
#pragma once

#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/imu_displacement.h"
#include "filter/ekf/iterated_update.h"
#include "filter/ekf/records.h"
#include "filter/sources/cameras/earlier_views.h"
#include "filter/sources/cameras/frame_check.h"
#include "filter/sources/cameras/stereo_motion.h"
#include "filter/sources/cameras/track_update.h"
#include "filter/sources/cameras/tracks.h"
#include "filter/sources/cameras/window_rule.h"

namespace ear {

/// The last image that was used.
struct LastImage {
  TimeNs t_ns = 0;                     ///< its camera stamp
  std::optional<Pose> T_WB;            ///< the body then, as it was estimated then; nothing without a state
  std::optional<std::uint64_t> clone;  ///< Clone::frame of the newest clone then
  Pose in_clone;                       ///< the body then, in that clone
};

class Cameras {
 public:
  Cameras(const FilterConfig& config, const Calibration& calibration);

  [[nodiscard]] std::size_t count() const { return count_; }
  /// Keeps no more than so many clones from the next frame on.
  void set_window(int clones) { window_.set_size(clones); }
  [[nodiscard]] int window() const { return static_cast<int>(window_.size()); }

  /// A new frame: how exact are its features? For all that is done with it.
  void measure_noise(const FeatureFrame& frame, const CameraState& cameras);
  /// p^c of (13). `motion`: by the inertial samples, from where the state is to the frame at `t_ns` (IMU time).
  [[nodiscard]] Displacement displacement(const FeatureFrame& frame, TimeNs t_ns, const ImuMotion& motion,
                                          const Ekf& ekf);
  /// The motion that it is of.
  [[nodiscard]] const std::optional<StereoMotion>& seen() const { return compared_.seen; }

  /// Where the inertial samples since the last image may be wrong by more than noise (clipped, missing, stamps that
  /// jumped), the two images show how the body moved, roughly: later, the features of both will show it in full, around
  /// a state that is near enough to be linear. False if they did not: with two cameras, clones and tracks of before are
  /// gone then.
  bool bridge(const FeatureFrame& frame, Ekf& ekf);
  /// At the state's time, which is the frame's, before the frame changes it: does it show the motion since the last
  /// image that the other sensors predict?
  [[nodiscard]] FrameAgreement compare(const FeatureFrame& frame, const Ekf& ekf);

  /// The body's pose joins the window, with what was seen from it (`weight`: (15)); tracks that end update the state.
  void update(const FeatureFrame& frame, double weight, CameraUpdate calibration, Ekf& ekf, Records& records);
  /// The body's pose joins the window, without an image.
  void clone_without_image(double weight, Ekf& ekf);
  /// Did an image with features enough come not long ago, and agree with the state?
  [[nodiscard]] bool show_motion(const State& x) const;
  /// The state is as well known as if features had updated it.
  void set_updated(TimeNs t_ns) { window_.set_updated(t_ns); }

  /// Standard deviation, relative, of all lengths by errors of the lenses that no number of features averages out.
  [[nodiscard]] double scale_sigma() const { return track_update_.lens_pattern().scale_sigma(); }

  /// The frame was used; the next one is compared with it.
  void remember(const FeatureFrame& frame, const Ekf& ekf);
  [[nodiscard]] const std::optional<LastImage>& last_image() const { return last_; }
  /// Where the body was at the last image, by all that was measured since: what wheels and lasers measure until the
  /// next image corrects clone and state alike, and is no motion. Nothing if there was no image, or no state then.
  [[nodiscard]] std::optional<Pose> image_pose(const State& x) const;

  /// The state begins anew.
  void reset();

 private:
  /// The frame at hand against one before: for displacement() the last that came, for all else the last that was used.
  struct Compared {
    FeatureFrame before;               ///< that displacement() last saw,
    TimeNs t_ns = 0;                   ///< at this IMU time
    std::optional<TimeNs> matched_ns;  ///< stamp of the frame that matches_ holds the features of, and of this one
    std::optional<StereoMotion> seen;  ///< between these two
    bool agrees = true;                ///< most features were where the state expected them
  };

  /// From the newest clone to the frame, by one camera.
  [[nodiscard]] std::optional<StereoMotion> motion_by_one(const FeatureFrame& frame, const Pose& start, const Ekf& ekf);
  /// Of the last image that was used with the frame at hand.
  const std::vector<StereoMatch>& matches_with(const FeatureFrame& frame, const CameraState& cameras);
  void apply_bridge(const StereoMotion& motion, Ekf& ekf);
  void marginalise(std::optional<std::size_t> clone, Ekf& ekf);

  FilterConfig config_;
  std::size_t count_;
  double focal_px_;
  TrackTable tracks_;
  EarlierViews views_;  ///< of one camera
  TrackUpdate track_update_;
  WindowRule window_;
  FrameCheck frame_check_;
  StereoMatches matches_;
  Compared compared_;
  std::optional<LastImage> last_;
  FeatureFrame last_features_;
  bool gap_is_wide_ = false;  ///< the motion since the newest clone is known too little for the first order
  // Memory that is used again.
  Eigen::MatrixXd rows_;
  IteratedUpdate iterated_;
};

}  // namespace ear
