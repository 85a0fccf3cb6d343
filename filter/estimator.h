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

/// How the body moved between two frames, as the inertial samples tell.
struct RelativeMotion {
  Eigen::Matrix3d R_B1B0 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0B1 = Eigen::Vector3d::Zero();  ///< [m]
  bool rotation_known = false;  ///< false before a start: the turn holds what the gyroscope's bias adds
  bool translation_known = false;
};

/// The calibration in use: what was given, with what was learned.
struct CalibrationState {
  CameraState camera;
  OdometerState odometer;
};

/// Can a frame with this stamp be used?
enum class FrameStamp : std::uint8_t {
  usable,
  not_later,   ///< than the frame before
  no_samples,  ///< no inertial samples reach (nearly) up to it yet
};

class Estimator {
 public:
  virtual ~Estimator() = default;

  /// Begins at a state that is given: see Odometry::start_at.
  virtual void start_at(const GivenStart& start) = 0;

  /// Takes a sample in time order. One that is not finite, implausible or not later than the one before is refused and
  /// counted. Its stamps are the clock: after a gap of 2 s, or when they go on from an earlier time, all begins anew.
  virtual void add_imu(const ImuSample& sample) = 0;

  /// Takes a reading in time order; it is used at its own time when the state passes it. One that is not later than the
  /// one before, far behind the state or far ahead of the inertial samples, is refused and counted. Without a
  /// calibration of its sensor it is ignored.
  virtual void add_encoder(const EncoderSample& sample) = 0;
  virtual void add_laser(const LaserSample& sample) = 0;

  /// How the body moved from the last image to a frame stamped `t_ns`: for a front end to track with. Before the start
  /// only the rotation is known. Nothing if no image came yet, or no samples.
  [[nodiscard]] virtual std::optional<RelativeMotion> motion_to(TimeNs t_ns) const = 0;

  /// A camera's stamp by the common clock, should the camera's own have jumped; nothing for a frame that is not to be
  /// used, as this is not known yet. For who has the stamps as the driver gives them, once for each frame as it comes.
  [[nodiscard]] virtual std::optional<TimeNs> common_stamp(TimeNs camera_stamp_ns) = 0;

  /// Takes the features of one frame. The estimate at the frame's time, or nothing while it cannot start. Features that
  /// are not finite, that no camera can see, or that come twice are left out and counted. A frame that no inertial
  /// samples reach is reported; the filter keeps it until they do, for what it shows of the frames after it.
  virtual std::optional<Estimate> process(const FeatureFrame& frame) = 0;

  /// The same at a time without an image, from all other sensors; a camera's stamp. Tracks go on over it. Nothing where
  /// these show nothing: with cameras, off the ground. Images that come late can then still be used. Nothing either
  /// while the newest inertial samples may be a spike.
  virtual std::optional<Estimate> process_without_image(TimeNs t_ns) = 0;

  /// The newest state carried on by the samples to `t_ns` (IMU time). Nothing before the start, while lost, and later
  /// than 0.5 s after the newest sample.
  [[nodiscard]] virtual std::optional<NavState> predict(TimeNs t_ns) const = 0;

  [[nodiscard]] virtual Status status() const = 0;
  [[nodiscard]] virtual const Health& health() const = 0;
  /// Reports a frame that no inertial samples reach.
  virtual void refuse_frame() = 0;
  /// Keeps no more than so many clones from the next frame on, at least 3 and at most FilterConfig::window.
  virtual void set_window(int clones) = 0;
  [[nodiscard]] virtual InputCounts input_counts() const = 0;  ///< of samples
  [[nodiscard]] virtual FrameStamp check_stamp(TimeNs t_ns) const = 0;
  [[nodiscard]] virtual CalibrationState calibration() const = 0;
  /// The time of a frame with this stamp.
  [[nodiscard]] TimeNs frame_time(TimeNs stamp_ns) const { return imu_time(stamp_ns, calibration().camera); }
  /// The stamp that the camera has at that time.
  [[nodiscard]] TimeNs camera_time(TimeNs imu_time_ns) const {
    return ear::camera_time(imu_time_ns, calibration().camera);
  }

  /// From now on each frame leaves in `outcomes`, which must outlive this, what became of the tracks that it tested;
  /// an estimator that does not know leaves nothing. Null: no longer.
  virtual void report_tracks(std::vector<TrackOutcome>* /*outcomes*/) {}
};

}  // namespace ear
