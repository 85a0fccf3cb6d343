// Standing as a source: while the vehicle stands, the body is where it was at the newest clone, and its velocity is
// zero. docs/filter.md, "Standing".
#pragma once

#include <optional>

#include "ear/filter_config.h"
#include "filter/ekf/ekf.h"
#include "filter/sources/standstill/standstill_detector.h"

namespace ear {

class Standstill {
 public:
  /// `focal_px`: pixels per unit of normalized image coordinates. `window`: the most clones.
  Standstill(const StandstillConfig& config, double focal_px, int window);

  void add(const WheelIncrement& increment) { wheel_rest_.add(increment); }

  /// What shows whether the vehicle stands, at a frame.
  struct Evidence {
    const FeatureFrame& frame;
    TimeNs t_ns = 0;  ///< IMU time
    const ImuBuffer& imu;
    std::optional<Eigen::Vector3d> b_g;  ///< nothing before the start
    bool on_ground = false;              ///< the wheels show whether they turn
  };
  /// Has the vehicle stood for config.duration?
  bool update(const Evidence& evidence);
  [[nodiscard]] bool stands() const { return stands_; }
  /// Samples of the last config.duration seconds before `t_ns`.
  [[nodiscard]] ImuStatistics recent(const ImuBuffer& imu, TimeNs t_ns) const;

  /// Was the newest clone made where the vehicle is, if it stands? Not if the vehicle moved on without one.
  [[nodiscard]] bool clone_is_here() const { return clone_is_here_; }
  void set_clone_here(bool here) { clone_is_here_ = here; }
  /// Nine rows: rotation and position of the newest clone, velocity zero. Of the cameras this shows nothing.
  void hold(Ekf& ekf);

 private:
  StandstillConfig config_;
  StandstillDetector detector_;
  WheelRest wheel_rest_;
  bool stands_ = false;
  bool clone_is_here_ = false;
  Eigen::MatrixXd rows_;  // memory that is used again
};

}  // namespace ear
