// What a front end, and whoever adds samples, needs of an estimator: the filter, or another to compare it with.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "ear/estimate.h"
#include "ear/given_start.h"
#include "ear/types.h"
#include "filter/ekf/records.h"
#include "filter/ekf/state.h"

namespace ear {

/// How the body moved between two frames.
struct RelativeMotion {
  Eigen::Matrix3d R_B1B0 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0B1 = Eigen::Vector3d::Zero();  ///< [m]
  bool translation_known = false;
};

/// From where the body was at one frame to where it is at the next.
[[nodiscard]] inline RelativeMotion motion_between(const Pose& T_WB0, const NavState& next) {
  RelativeMotion motion;
  motion.R_B1B0 = next.q_WB.toRotationMatrix().transpose() * T_WB0.R;
  motion.p_B0B1 = T_WB0.R.transpose() * (next.p_WB - T_WB0.p);
  motion.translation_known = true;
  return motion;
}

/// The calibration in use: what was given, with what was learned.
struct CalibrationState {
  CameraState camera;
  OdometerState odometer;
};

/// Can a frame with this stamp be used?
enum class FrameStamp : std::uint8_t {
  usable,
  not_later,   ///< than the frame before
  no_samples,  ///< no inertial samples reach (nearly) up to it
};

/// How far Estimator::predict goes beyond the newest inertial sample [s], chosen.
inline constexpr double kLongestPredict = 0.5;

/// Meanings, and what is refused: class Filter.
class Estimator {
 public:
  virtual ~Estimator() = default;

  virtual void start_at(const GivenStart& start) = 0;
  virtual void add_imu(const ImuSample& sample) = 0;
  virtual void add_encoder(const EncoderSample& sample) = 0;
  virtual void add_laser(const LaserSample& sample) = 0;

  [[nodiscard]] virtual std::optional<RelativeMotion> motion_to(TimeNs t_ns) const = 0;
  [[nodiscard]] virtual std::optional<TimeNs> common_stamp(TimeNs camera_stamp_ns) = 0;
  virtual std::optional<Estimate> process(const FeatureFrame& frame) = 0;
  virtual std::optional<Estimate> process_without_image(TimeNs t_ns) = 0;
  [[nodiscard]] virtual std::optional<NavState> predict(TimeNs t_ns) const = 0;

  [[nodiscard]] virtual Status status() const = 0;
  [[nodiscard]] virtual const Health& health() const = 0;
  virtual void refuse_frame() = 0;
  virtual void set_window(int clones) = 0;
  [[nodiscard]] virtual InputCounts input_counts() const = 0;
  [[nodiscard]] virtual FrameStamp check_stamp(TimeNs t_ns) const = 0;
  [[nodiscard]] virtual TimeNs camera_time(TimeNs imu_time_ns) const = 0;

  [[nodiscard]] virtual CalibrationState calibration() const = 0;

  /// From now on each frame leaves in `outcomes`, which must outlive this, what became of the tracks that it tested;
  /// an estimator that does not know leaves nothing. Null: no longer.
  void report_tracks(std::vector<TrackOutcome>* outcomes) { outcomes_ = outcomes; }

 protected:
  [[nodiscard]] std::vector<TrackOutcome>* outcomes() const { return outcomes_; }

 private:
  std::vector<TrackOutcome>* outcomes_ = nullptr;
};

}  // namespace ear
