#include "tools/simulator/simulation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tools/simulator/sequence.h"
#include "tools/simulator/vehicle.h"

namespace ear::simulator {
namespace {

// First stamps of the streams [s]: the sensors do not tick together.
constexpr double kImuPhase = 0.1;
constexpr double kEncoderPhase = 0.1033;
constexpr double kLaserPhase = 0.1017;
constexpr double kCameraPhase = 0.1083;

Options checked(const Options& options) {
  if (!(options.camera_rate_hz > 0.0)) throw std::invalid_argument("the camera rate must be positive");
  if (options.duration && !(*options.duration > 0.0)) throw std::invalid_argument("the duration must be positive");
  return options;
}

Sequence varied_sequence(const Options& options) {
  Rng rng = make_rng(options.seed, Stream::sequence);
  return vary(find_sequence(options.sequence), rng);
}

Calibration told_calibration(const Options& options, const Calibration& truth) {
  if (options.perfect_calibration) return truth;
  Rng rng = make_rng(options.seed, Stream::calibration);
  return miscalibrate(truth, rng);
}

MotionPlan planned(const Options& options, const Sequence& sequence, const EncoderCalibration& axle) {
  Rng rng = make_rng(options.seed, Stream::motion);
  return plan_motion(sequence, axle, rng);
}

Obstruction drawn_obstruction(const Options& options, const Sequence& sequence, double duration) {
  Rng rng = make_rng(options.seed, Stream::obstruction);
  return {sequence.hindrance, duration, rng};
}

Scene make_scene(Place place, const Terrain& terrain) {
  return place == Place::room ? make_room(terrain) : make_outdoors(place, terrain);
}

// The sensors as they are, or without their noise.
Calibration sensors_of(const Options& options, Calibration calibration) {
  if (!options.sensor_noise) {
    calibration.encoder->noise_counts = 0.0;
    calibration.lasers->noise = 0.0;
  }
  return calibration;
}

}  // namespace

Simulation::Simulation(const Options& options) : Simulation(checked(options), varied_sequence(options)) {}

Simulation::Simulation(const Options& options, const Sequence& sequence)
    : options_(options),
      true_calibration_(make_vehicle(options.camera_rate_hz, options.lens)),
      calibration_(told_calibration(options, true_calibration_)),
      scene_(make_scene(sequence.place, sequence.terrain)),
      plan_(planned(options, sequence, *true_calibration_.encoder)),
      wheels_(plan_, sequence.terrain, *true_calibration_.encoder),
      obstruction_(drawn_obstruction(options, sequence, plan_.trajectory.duration())),
      duration_(options.duration.value_or(plan_.trajectory.duration() - 0.2)) {
  const double end = kImuPhase + duration_;
  const Calibration sensors = sensors_of(options, true_calibration_);
  const Trajectory& trajectory = plan_.trajectory;

  Rng imu_rng = make_rng(options.seed, Stream::imu);
  const std::vector<TimeNs> imu_stamps = regular_stamps(sensors.imu.rate_hz, kImuPhase, end);
  imu_ = ideal_imu(trajectory, imu_stamps, sensors.imu.rate_hz);
  biases_.assign(imu_stamps.size(), ImuBias{});
  if (options.sensor_noise) {
    biases_ = draw_imu_biases(sensors.imu, imu_stamps.size(), imu_rng);
    corrupt_imu(imu_, sensors.imu, biases_, imu_rng);
  }

  Rng encoder_rng = make_rng(options.seed, Stream::encoder);
  encoders_ = read_encoders(wheels_, *sensors.encoder, regular_stamps(sensors.encoder->rate_hz, kEncoderPhase, end),
                            encoder_rng);

  Rng laser_rng = make_rng(options.seed, Stream::laser);
  lasers_ = read_lasers(trajectory, sequence.terrain, *sensors.lasers,
                        regular_stamps(sensors.lasers->rate_hz, kLaserPhase, end), laser_rng);
  if (options.sensor_noise) {
    Rng fault_rng = make_rng(options.seed, Stream::laser_faults);
    corrupt_lasers(lasers_, *sensors.lasers, sequence.laser_faults, fault_rng);
  }

  frame_times_ = regular_stamps(options.camera_rate_hz, kCameraPhase, end);
  if (options.tracks) {
    Rng track_rng = make_rng(options.seed, Stream::tracks);
    tracks_ =
        generate_tracks(scene_, trajectory, sensors.cameras, frame_times_, obstruction_, options.track, track_rng);
  }
}

Truth Simulation::truth(TimeNs t_ns) const {
  const double t = motion_time(t_ns);
  const Kinematics motion = plan_.trajectory.at(t);
  Truth truth;
  truth.t_ns = t_ns;
  truth.R_WB = motion.R_WB;
  truth.p_WB = motion.p_WB;
  truth.v_W = motion.v_W;
  truth.omega_B = motion.omega_B;

  const double position = std::clamp(seconds_between(imu_.front().t_ns, t_ns) * true_calibration_.imu.rate_hz, 0.0,
                                     static_cast<double>(biases_.size() - 1));
  const auto before = static_cast<std::size_t>(position);
  const std::size_t after = std::min(before + 1, biases_.size() - 1);
  const double f = position - static_cast<double>(before);
  truth.b_g = (1.0 - f) * biases_[before].gyro + f * biases_[after].gyro;
  truth.b_a = (1.0 - f) * biases_[before].accel + f * biases_[after].accel;

  const auto knot = static_cast<std::size_t>(std::lround(std::max(0.0, t / plan_.trajectory.period())));
  truth.mode = plan_.mode[std::min(knot, plan_.mode.size() - 1)];
  truth.n_W = scene_.terrain.normal(motion.p_WO.x(), motion.p_WO.y());
  const Eigen::Vector3d axle_W = motion.R_WO.col(1);
  const Eigen::Vector3d forward_W = axle_W.cross(truth.n_W).normalized();
  const Eigen::Vector3d left_W = truth.n_W.cross(forward_W);
  truth.slope_along = std::asin(forward_W.z());
  truth.slope_across = std::asin(left_W.z());
  truth.axle_speed = forward_W.dot(motion.v_O_W);
  truth.slip = wheels_.slip(t);
  return truth;
}

double Simulation::path_length() const {
  double length = 0.0;
  for (std::size_t i = 1; i < imu_.size(); ++i) {
    const Eigen::Vector3d before = plan_.trajectory.at(motion_time(imu_[i - 1].t_ns)).p_WB;
    length += (plan_.trajectory.at(motion_time(imu_[i].t_ns)).p_WB - before).norm();
  }
  return length;
}

}  // namespace ear::simulator
