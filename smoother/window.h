// The frames that are estimated together, and everything that ties them: a bundle adjustment over the last keyframes,
// (1). docs/smoother.md.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/ordered_groups.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/gate.h"
#include "filter/ekf/state.h"
#include "filter/sources/cameras/tracks.h"
#include "filter/sources/cameras/triangulation.h"
#include "filter/sources/wheels/wheel_preintegration.h"
#include "smoother/blocks.h"
#include "smoother/factor.h"
#include "smoother/imu_preintegration.h"
#include "smoother/normal_equations.h"

namespace ear::smoother {

/// From one frame to the next.
struct Interval {
  ImuPreintegration imu{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::optional<WheelDisplacement> wheels;  ///< where they tell something
  bool still = false;                       ///< the vehicle stood all the time
};

/// A frame as it comes in.
struct NewFrame {
  TimeNs t_ns = 0;                                   ///< IMU time, by the time offset of now
  Interval since;                                    ///< the frame before
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< [rad/s] at its time, bias removed
  double feature_noise = 1.0;                        ///< standard deviation of its features, times the usual
};

/// How well the newest frame is known: its ordinary errors (estimate_error), and the wheels.
struct NewestCovariance {
  Eigen::Matrix<double, 15, 15> state;
  Eigen::Matrix<double, 6, 6> wheels;
};

class Window {
 public:
  /// Begins with one frame without features: a state, its calibration, and the covariance of all that in the order of
  /// the filter's error vector (err::).
  Window(const FilterConfig& config, double focal_px, const State& x, const Eigen::Ref<const Eigen::MatrixXd>& P);

  Window(const Window&) = delete;  // blocks do not move
  Window& operator=(const Window&) = delete;

  /// Appends a frame, where the inertial samples put it.
  void add(const NewFrame& frame, const std::vector<FeatureObservation>& features);

  /// Minimises (1), and drops features that do not fit. False, and as before, if that comes to nothing.
  [[nodiscard]] bool optimize();

  /// Of the newest frame, around the present values; nothing if it cannot be computed.
  [[nodiscard]] std::optional<NewestCovariance> covariance() const;

  /// With a full window, makes a prior of the oldest frame, or lets the one before the newest go.
  void make_room();

  /// What the wheels told during the last `duration` seconds is wrong.
  void forget_wheels(double duration);

  [[nodiscard]] ImuState newest() const;
  [[nodiscard]] CameraState cameras() const;
  [[nodiscard]] OdometerState odometer() const;
  [[nodiscard]] std::size_t size() const { return frames_.size(); }
  [[nodiscard]] int features_used() const { return static_cast<int>(points_used_.size()); }
  [[nodiscard]] int features_rejected() const { return features_rejected_; }

 private:
  struct Frame {
    std::uint64_t number = 0;
    TimeNs t_ns = 0;
    PoseBlock pose{};
    MotionBlock motion{};
    Interval since;
    Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_B = Eigen::Vector3d::Zero();
    double time_offset = 0.0;
    double feature_noise = 1.0;
    bool image = false;
  };
  /// A feature as an unknown.
  struct Point {
    InverseDepthPoint anchor;
    PointBlock block{};
  };
  /// All observations of a feature, as factors.
  struct PointTerm {
    std::uint64_t id = 0;
    PointBlock* block = nullptr;
    std::vector<Factor> factors;
  };

  // window_terms.cpp
  void collect();
  void collect_between();
  void collect_points();
  void collect_leaving_points(std::uint64_t leaving);
  bool add_point(const Track& track);
  [[nodiscard]] std::optional<InverseDepthPoint> triangulated(const Track& track) const;
  [[nodiscard]] bool fits(const PointTerm& term) const;
  void drop_outliers();

  // window_solve.cpp
  [[nodiscard]] bool solve();
  [[nodiscard]] std::shared_ptr<ceres::ParameterBlockOrdering> points_first() const;
  [[nodiscard]] std::vector<Eigen::VectorXd> values() const;
  void set_values(const std::vector<Eigen::VectorXd>& values);

  // window.cpp
  [[nodiscard]] std::vector<PriorBlock> blocks() const;
  [[nodiscard]] Pose pose(std::size_t frame) const { return to_pose(frames_[frame]->pose.data()); }
  [[nodiscard]] double parallax_px(std::size_t from, std::size_t to) const;
  [[nodiscard]] std::size_t index_of(std::uint64_t number) const;

  // window_room.cpp
  [[nodiscard]] std::size_t frame_to_leave() const;
  void marginalize_oldest();
  void skip_frame(std::size_t index);
  [[nodiscard]] std::pair<std::vector<PriorBlock>, std::vector<PriorBlock>> divided(
      const std::vector<const double*>& touched, const Frame& frame) const;
  void erase_frame(std::size_t index);
  void set_prior(std::unique_ptr<PriorFactor> prior);
  void forget_points_without_tracks();

  FilterConfig config_;
  double focal_px_;
  double sigma_;  ///< of an observation, normalized
  Gate gate_;
  mutable PoseManifold pose_manifold_;
  mutable ceres::HuberLoss huber_;
  std::vector<std::unique_ptr<Frame>> frames_;  ///< oldest first; blocks do not move
  PoseBlock camera_{}, stereo_{};
  OffsetBlock offset_{};
  WheelBlock wheels_{};
  OdometerState given_;  ///< that the wheels block is relative to
  TrackTable tracks_;
  std::unordered_map<std::uint64_t, Point> points_;
  Factor prior_;
  std::vector<Factor> between_;  ///< frames, and the prior; the last one collected
  std::vector<PointTerm> point_terms_;
  std::vector<std::uint64_t> points_used_;
  std::uint64_t next_number_ = 0;
  int features_rejected_ = 0;
  mutable std::vector<double> parallax_;
};

}  // namespace ear::smoother
