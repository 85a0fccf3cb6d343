// One simulated drive or flight in memory: truth, calibration, samples of all sensors and feature tracks.
//
//   const ear::simulator::Simulation simulation({"flat1", 7});
//   for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) use(simulation.tracks(i));
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "tools/simulator/camera_faults.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/held_board.h"
#include "tools/simulator/motion_plan.h"
#include "tools/simulator/obstruction.h"
#include "tools/simulator/passerby.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/sensor_faults.h"
#include "tools/simulator/sensors.h"
#include "tools/simulator/track_generator.h"
#include "tools/simulator/wheel_faults.h"
#include "tools/simulator/wheel_motion.h"

namespace ear::simulator {

struct Options {
  std::string sequence = "flat1";
  std::uint64_t seed = 1;          ///< varies noise, biases, landmarks, calibration errors and details of the motion
  std::optional<double> duration;  ///< [s] stop earlier, or keep standing at the end for longer
  double camera_rate_hz = 30.0;
  LensModel lens = LensModel::radial_tangential;
  bool sensor_noise = true;  ///< false: IMU without noise and biases, encoders and lasers without noise and faults
  bool tracks = true;        ///< false: no feature tracks, for recordings of images
  TrackOptions track;
  std::vector<Fault> faults = {};  ///< what else goes wrong; all that they do not hit stays, sample for sample
  double k3 = 0.0;                 ///< of both lenses, which must be radial-tangential then
  /// How wrong calibration() is, in the sizes of draw_calibration_errors(): 0 is the true one. The accelerometer's true
  /// bias grows with it; all other samples, the motion and the truth stay. Without it: with_fixed_errors().
  std::optional<double> calibration_error = std::nullopt;
};

/// The truth at one instant. World W: z up, the origin in a corner of the room.
struct Truth {
  TimeNs t_ns = 0;
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d omega_B = Eigen::Vector3d::Zero();  ///< [rad/s]
  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();      ///< [rad/s]
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();      ///< [m/s^2]
  Mode mode = Mode::ground;
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();  ///< ground's normal below the axle's middle
  double slope_along = 0.0;                        ///< of the ground along the heading, uphill positive [rad]
  double slope_across = 0.0;                       ///< to the left of the heading, uphill positive [rad]
  double axle_speed = 0.0;                         ///< forward speed of the axle's middle [m/s]
  double slip = 0.0;                               ///< speed of the rims over the ground, mean of both wheels [m/s]
};

/// One sample on its way to the estimator.
struct Delivery {
  TimeNs arrival_ns = 0;  ///< in true time, whatever its stamp says; a frame comes 10 ms after it is taken, or later
  SensorStream stream = SensorStream::imu;
  std::size_t index = 0;  ///< in imu(), encoders(), lasers() or frames()
};

class Simulation {
 public:
  /// Throws std::invalid_argument for a sequence that does not exist, a duration or rate that is not positive, a
  /// calibration error below zero, or a fault that cannot be.
  explicit Simulation(const Options& options);

  /// What the estimator is given, as wrong as Options::calibration_error says.
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  [[nodiscard]] const Calibration& true_calibration() const { return true_calibration_; }

  /// At any time of the motion, true time: a clock that jumps does not change it.
  [[nodiscard]] Truth truth(TimeNs t_ns) const;
  /// Where truth is recorded: the true times of all IMU samples, also of those that a fault takes away.
  [[nodiscard]] const std::vector<TimeNs>& truth_times() const { return truth_times_; }
  /// Distance that the body travels from the first to the last stamp [m].
  [[nodiscard]] double path_length() const;

  /// Samples in the order in which they arrive.
  [[nodiscard]] const std::vector<ImuSample>& imu() const { return imu_; }
  [[nodiscard]] const std::vector<EncoderSample>& encoders() const { return encoders_; }
  [[nodiscard]] const std::vector<LaserSample>& lasers() const { return lasers_; }
  /// The middle of the exposure of every stereo frame, also of those that a fault takes away.
  [[nodiscard]] const std::vector<TimeNs>& exposures() const { return exposures_; }
  /// The frames that arrive.
  [[nodiscard]] const std::vector<Frame>& frames() const { return frames_; }
  /// Their stamps.
  [[nodiscard]] const std::vector<TimeNs>& frame_times() const { return frame_times_; }
  /// Features of one of these frames, normalized with the lenses of calibration(). Throws std::out_of_range; without
  /// Options::tracks there are none.
  [[nodiscard]] const FeatureFrame& tracks(std::size_t frame) const { return tracks_.at(frame); }

  /// All samples of all sensors in the order in which they arrive; at the same time IMU, encoder, laser, camera.
  [[nodiscard]] const std::vector<Delivery>& deliveries() const { return deliveries_; }

  [[nodiscard]] const Scene& scene() const { return scene_; }
  /// What is before the lenses.
  [[nodiscard]] const Obstruction& obstruction() const { return obstruction_; }
  /// Who crosses the view.
  [[nodiscard]] const std::vector<Passerby>& passersby() const { return passersby_; }
  /// What somebody holds before the cameras; nothing but in `board`.
  [[nodiscard]] const std::optional<HeldBoard>& board() const { return board_; }
  [[nodiscard]] const MotionPlan& plan() const { return *plan_; }
  [[nodiscard]] const Options& options() const { return options_; }

 private:
  Simulation(const Options& options, const Sequence& sequence);
  void take_frames(const Sequence& sequence);

  Options options_;
  Calibration true_calibration_;
  Calibration calibration_;
  Scene scene_;
  std::shared_ptr<const MotionPlan> plan_;  // shared: the passers-by refer to it
  WheelMotion wheels_;
  WheelFaults wheel_faults_;
  Obstruction obstruction_;
  std::vector<Passerby> passersby_;
  std::optional<HeldBoard> board_;
  double duration_;
  std::vector<TimeNs> truth_times_;
  std::vector<ImuSample> imu_;
  std::vector<ImuBias> biases_;  // at truth_times_
  std::vector<EncoderSample> encoders_;
  std::vector<LaserSample> lasers_;
  std::vector<TimeNs> exposures_;
  std::vector<Frame> frames_;
  std::vector<TimeNs> frame_times_;  // of frames_
  std::vector<FeatureFrame> tracks_;
  std::vector<Delivery> deliveries_;
};

}  // namespace ear::simulator
