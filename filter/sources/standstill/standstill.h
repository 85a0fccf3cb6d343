// Does the vehicle stand? The IMU must be quiet, and the features must stay where they were when it stopped, or the
// wheels must not turn: a vehicle that glides at constant speed has a quiet IMU too. While it stands, the body is where
// it was at the newest clone, and its velocity is zero. docs/filter.md, "Standing".
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ekf/ekf.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

/// Since when have the wheels not turned relative to the body?
class WheelRest {
 public:
  void add(const WheelIncrement& turn);
  /// Do they rest now, and since when? Nothing if the readings have been silent for too long.
  [[nodiscard]] std::optional<double> duration(TimeNs t_ns) const;

 private:
  bool any_ = false;
  TimeNs since_ns_ = 0;
  TimeNs newest_ns_ = 0;
  double interval_ = 0.0;                            ///< [s] between the last two readings
  Eigen::Vector2d moved_ = Eigen::Vector2d::Zero();  // since since_ns_ [rad]
};

class Standstill {
 public:
  /// `focal_px`: pixels per unit of normalized image coordinates. `window`: the most clones.
  Standstill(const StandstillConfig& config, double focal_px, int window);

  void add(const WheelIncrement& increment) { wheel_rest_.add(increment); }

  struct GyroBias {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();  ///< [rad/s]
    double sigma = 0.0;                              ///< standard deviation, largest axis [rad/s]
  };

  /// What shows whether the vehicle stands, at a frame.
  struct Evidence {
    const FeatureFrame& frame;
    TimeNs t_ns = 0;               ///< IMU time
    ImuStatistics recent;          ///< recent() then
    std::optional<GyroBias> bias;  ///< nothing before the start
    bool on_ground = false;        ///< the wheels show whether they turn
  };
  void update(const Evidence& evidence);
  /// Has the vehicle stood for config.duration?
  [[nodiscard]] bool stands() const { return stands_; }
  /// Do the wheels not turn, whether the vehicle stands or not?
  [[nodiscard]] bool wheels_rest(TimeNs t_ns) const;
  /// Samples of the last config.duration seconds before `t_ns`.
  [[nodiscard]] ImuStatistics recent(const ImuBuffer& imu, TimeNs t_ns) const;

  /// Nine rows: rotation and position of the newest clone, velocity zero. Of the cameras this shows nothing.
  void hold(Ekf& ekf);

 private:
  void restart(const FeatureFrame& frame);
  void renew_reference(const FeatureFrame& frame);
  void sort_reference();
  [[nodiscard]] const FeatureObservation* find_in_reference(std::uint64_t id) const;
  [[nodiscard]] std::optional<double> common_flow_px(const FeatureFrame& frame);

  StandstillConfig config_;
  double focal_px_;
  WheelRest wheel_rest_;
  bool stands_ = false;
  std::optional<TimeNs> since_ns_;             ///< first frame of the present stillness
  std::vector<FeatureObservation> reference_;  ///< features where they were then, by ascending id
  std::vector<FeatureObservation> renewed_;
  std::array<std::vector<double>, 4> flow_;
  Eigen::MatrixXd rows_;  // memory that is used again
};

}  // namespace ear
