// The estimator: inertial samples and feature tracks in, state and covariance out. An MSCKF with right-invariant error.
//
// Per frame (Filter::process): propagate to the frame's time; if the vehicle stands, hold it; else clone the pose, take
// in the frame's observations, update once with all features that ended or fill the window, and make room in the
// window.
#pragma once

#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/odometry.h"
#include "ear/types.h"
#include "filter/chi_squared.h"
#include "filter/covariance.h"
#include "filter/feature_update.h"
#include "filter/imu_buffer.h"
#include "filter/standstill.h"
#include "filter/state.h"
#include "filter/tracks.h"

namespace ear {

/// How the body moved between two frames.
struct RelativeMotion {
  Eigen::Matrix3d R_B1B0 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0B1 = Eigen::Vector3d::Zero();  ///< [m]
  bool translation_known = false;
};

/// What IMU-side problems there were; see InputCounts.
struct ImuCounts {
  std::uint64_t rejected = 0;
  std::uint64_t gaps = 0;
};

class Filter {
 public:
  /// Throws std::invalid_argument, naming the field, if a setting or the calibration is unusable.
  Filter(const FilterConfig& config, const Calibration& calibration);

  /// Takes a sample in time order. One that is not finite, or not later than the one before, is refused and counted.
  void add_imu(const ImuSample& sample);

  /// How the body moved from the last processed frame to a frame stamped `t_ns`: for a front end to track with. Before
  /// the start only the rotation is known. Nothing if no frame came yet, or no samples.
  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const;

  /// Takes the features of one frame. The estimate at the frame's time, or nothing while it cannot start.
  std::optional<Estimate> process(const FeatureFrame& frame);

  /// The newest state carried on by the samples to `t_ns` (IMU time). Nothing before the start.
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const;

  [[nodiscard]] Status status() const { return status_; }
  [[nodiscard]] const ImuCounts& imu_counts() const { return imu_counts_; }
  [[nodiscard]] bool covers(TimeNs t_ns) const;  ///< are there inertial samples (nearly) up to the frame's time?
  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const Covariance& covariance() const { return covariance_; }

 private:
  [[nodiscard]] TimeNs imu_time(TimeNs camera_time_ns) const;
  bool try_start(const FeatureFrame& frame, const ImuStatistics& imu, bool still);
  void advance(TimeNs t_ns);
  void hold_still();
  void append_clone();
  void update_with_features(const FeatureFrame& frame);
  bool add_track(const Track& track);
  void select_tracks(const FeatureFrame& frame, std::optional<std::uint64_t> leaving);
  [[nodiscard]] std::optional<std::size_t> clone_to_leave() const;
  [[nodiscard]] double median_parallax_px(const Clone& from, const Clone& to) const;
  void update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column, const Eigen::Ref<const Eigen::VectorXd>& r);
  [[nodiscard]] int clone_index(std::uint64_t frame) const;
  [[nodiscard]] Estimate make_estimate() const;

  FilterConfig config_;
  Calibration calibration_;
  double focal_px_;
  ChiSquaredGate gate_;

  Status status_ = Status::waiting_for_imu;
  State state_;
  Covariance covariance_;
  ImuBuffer imu_;
  ImuCounts imu_counts_;
  Eigen::Vector3d rate_B_ = Eigen::Vector3d::Zero();  ///< mean rate of the last piece integrated, bias removed [rad/s]
  StandstillDetector standstill_;
  TrackTable tracks_;
  std::uint64_t next_frame_ = 0;
  TimeNs last_frame_ns_ = 0;  ///< camera stamp of the last frame processed
  bool any_frame_ = false;
  bool learn_calibration_ = false;  ///< standing tells nothing about it
  FrameStatistics statistics_;

  FeatureInformation information_;
  std::vector<CameraPose> cameras_;
  std::vector<Sighting> sightings_;
  std::vector<LinearizedObservation> observations_;
  std::vector<std::size_t> selected_;
  std::vector<std::uint64_t> frame_ids_;
  mutable std::vector<double> parallax_;
};

}  // namespace ear
