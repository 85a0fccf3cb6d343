// Does the vehicle stand? The IMU must be quiet, and the features must stay where they were when it stopped, or the
// wheels must not turn: a vehicle that glides at constant speed has a quiet IMU too.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "ear/filter_config.h"
#include "ear/types.h"
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

class StandstillDetector {
 public:
  /// `focal_px`: pixels per unit of normalized image coordinates.
  StandstillDetector(const StandstillConfig& config, double focal_px);

  /// Looks at one frame. `imu`: the samples of the last config.duration seconds. `gyro_bias` [rad/s]; `max_gyro`
  /// [rad/s]: how far the mean rate may be from it. `wheel_rest`: for how long the wheels have not turned [s], nothing
  /// where they show nothing. True if the vehicle has stood for config.duration.
  bool update(const FeatureFrame& frame, const ImuStatistics& imu, const Eigen::Vector3d& gyro_bias, double max_gyro,
              std::optional<double> wheel_rest);

 private:
  void restart(const FeatureFrame& frame);
  void renew_reference(const FeatureFrame& frame);
  void sort_reference();
  [[nodiscard]] const FeatureObservation* find_in_reference(std::uint64_t id) const;
  [[nodiscard]] std::optional<double> common_flow_px(const FeatureFrame& frame);

  StandstillConfig config_;
  double focal_px_;
  bool standing_ = false;
  std::optional<TimeNs> since_ns_;             ///< first frame of the present stillness
  std::vector<FeatureObservation> reference_;  ///< features where they were then, by ascending id
  std::vector<FeatureObservation> renewed_;
  std::array<std::vector<double>, 4> flow_;
};

}  // namespace ear
