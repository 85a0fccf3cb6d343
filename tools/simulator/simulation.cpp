#include "tools/simulator/simulation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tools/simulator/calibration_error.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/sensor_faults.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/track_faults.h"
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
  for (const Fault& fault : options.faults) require_valid(fault);
  const double calibration_error = options.calibration_error.value_or(0.0);
  if (!(calibration_error >= 0.0 && std::isfinite(calibration_error))) {
    throw std::invalid_argument("the calibration error must be a factor of zero or more");
  }
  if (options.k3 != 0.0 && options.lens != LensModel::radial_tangential) {
    throw std::invalid_argument("k3: of radial-tangential lenses only");
  }
  return options;
}

void require_within(const std::vector<Fault>& faults, double end) {
  for (const Fault& fault : faults) {
    if (!fault.begun(end)) {
      throw std::invalid_argument("fault '" + to_string(fault) + "': the recording ends at " + std::to_string(end) +
                                  " s");
    }
  }
}

Sequence varied_sequence(const Options& options) {
  Rng rng = make_rng(options.seed, Stream::sequence);
  return vary(find_sequence(options.sequence), rng);
}

Calibration told_calibration(const Options& options, const Calibration& truth) {
  if (!options.calibration_error) {
    Rng rng = make_rng(options.seed, Stream::calibration);
    return with_fixed_errors(truth, rng);
  }
  if (*options.calibration_error == 0.0) return truth;
  return with_errors(truth, draw_calibration_errors(options.seed, *options.calibration_error));
}

std::shared_ptr<const MotionPlan> planned(const Options& options, const Sequence& sequence,
                                          const EncoderCalibration& axle) {
  std::vector<HardLanding> hard_landings;
  for (const Fault& fault : options.faults) {
    if (fault.kind == FaultKind::hard_landing) hard_landings.push_back({fault.start, fault.end(), fault.parameter});
  }
  Rng rng = make_rng(options.seed, Stream::motion);
  auto plan = std::make_shared<const MotionPlan>(plan_motion(sequence, axle, rng, hard_landings));
  for (const HardLanding& landing : hard_landings) {
    const auto within = [&landing](double t) { return landing.begin <= t && t < landing.end; };
    if (std::none_of(plan->touchdowns.begin(), plan->touchdowns.end(), within)) {
      std::string message = "fault 'hard_landing': nothing lands within " + std::to_string(landing.begin) + " to " +
                            std::to_string(landing.end) + " s; touchdowns:";
      for (const double touchdown : plan->touchdowns) message += ' ' + std::to_string(touchdown);
      throw std::invalid_argument(message + (plan->touchdowns.empty() ? " none" : " s"));
    }
  }
  return plan;
}

std::vector<Passerby> people_in(const Options& options, const Trajectory& trajectory, const Scene& scene) {
  std::vector<Passerby> people;
  for (const Fault& fault : options.faults) {
    if (fault.kind == FaultKind::people) people.emplace_back(fault, trajectory, scene);
  }
  return people;
}

std::optional<HeldBoard> board_in(const Options& options, const Sequence& sequence, const MotionPlan& plan,
                                  const CameraCalibration& camera) {
  if (!sequence.board) return std::nullopt;
  Rng rng = make_rng(options.seed, Stream::board);
  return HeldBoard(*sequence.board, plan.trajectory, camera, rng);
}

Options without_faults(Options options) {
  options.faults.clear();
  return options;
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

std::vector<ImuBias> drawn_biases(const Options& options, const ImuCalibration& imu, std::size_t count, Rng& rng) {
  std::vector<ImuBias> biases = draw_imu_biases(imu, count, rng);
  const CalibrationErrors errors = draw_calibration_errors(options.seed, options.calibration_error.value_or(0.0));
  for (ImuBias& bias : biases) bias.accel += errors.accel_bias;
  return biases;
}

Calibration vehicle_of(const Options& options) {
  Calibration vehicle = make_vehicle(options.camera_rate_hz, options.lens);
  for (CameraCalibration& camera : vehicle.cameras) camera.distortion[4] = options.k3;
  if (options.sensor_noise && options.calibration_error) {
    vehicle.imu.gyro_matrix += draw_calibration_errors(options.seed, *options.calibration_error).gyro_matrix;
  }
  return vehicle;
}

// Samples arrive when they are stamped, by a clock that does not jump.
template <typename Sample>
void append_deliveries(std::vector<Delivery>& deliveries, const std::vector<Sample>& samples, SensorStream stream) {
  for (std::size_t i = 0; i < samples.size(); ++i) deliveries.push_back({samples[i].t_ns, stream, i});
}

}  // namespace

Simulation::Simulation(const Options& options) : Simulation(checked(options), varied_sequence(options)) {}

Simulation::Simulation(const Options& options, const Sequence& sequence)
    : options_(options),
      true_calibration_(vehicle_of(options)),
      calibration_(told_calibration(options, true_calibration_)),
      scene_(make_scene(sequence.place, sequence.terrain)),
      plan_(planned(options, sequence, *true_calibration_.encoder)),
      wheels_(*plan_, sequence.terrain, *true_calibration_.encoder),
      wheel_faults_(options.faults, *plan_, wheels_, *true_calibration_.encoder),
      obstruction_(drawn_obstruction(options, sequence, plan_->trajectory.duration())),
      passersby_(people_in(options, plan_->trajectory, scene_)),
      board_(board_in(options, sequence, *plan_, true_calibration_.cameras[0])),
      duration_(options.duration.value_or(plan_->trajectory.duration() - 0.2)) {
  const double end = kImuPhase + duration_;
  require_within(options.faults, end);
  const Calibration sensors = sensors_of(options, true_calibration_);
  const Trajectory& trajectory = plan_->trajectory;

  Rng imu_rng = make_rng(options.seed, Stream::imu);
  truth_times_ = regular_stamps(sensors.imu.rate_hz, kImuPhase, end);
  imu_ = ideal_imu(trajectory, truth_times_, sensors.imu.rate_hz);
  biases_.assign(truth_times_.size(), ImuBias{});
  if (options.sensor_noise) {
    biases_ = drawn_biases(options, sensors.imu, truth_times_.size(), imu_rng);
    corrupt_imu(imu_, sensors.imu, biases_, imu_rng);
  }
  fault_imu(imu_, biases_, options.faults, options.seed);
  append_deliveries(deliveries_, imu_, SensorStream::imu);
  fault_clock(imu_, options.faults, SensorStream::imu);

  Rng encoder_rng = make_rng(options.seed, Stream::encoder);
  encoders_ = read_encoders(wheels_, *sensors.encoder, regular_stamps(sensors.encoder->rate_hz, kEncoderPhase, end),
                            encoder_rng);
  fault_encoders(encoders_, *sensors.encoder, wheel_faults_, options.faults);
  append_deliveries(deliveries_, encoders_, SensorStream::encoder);
  fault_clock(encoders_, options.faults, SensorStream::encoder);

  Rng laser_rng = make_rng(options.seed, Stream::laser);
  lasers_ = read_lasers(trajectory, sequence.terrain, *sensors.lasers,
                        regular_stamps(sensors.lasers->rate_hz, kLaserPhase, end), laser_rng);
  if (options.sensor_noise) {
    Rng laser_fault_rng = make_rng(options.seed, Stream::laser_faults);
    corrupt_lasers(lasers_, *sensors.lasers, sequence.laser_faults, laser_fault_rng);
  }
  fault_lasers(lasers_, *sensors.lasers, options.faults);
  append_deliveries(deliveries_, lasers_, SensorStream::laser);
  fault_clock(lasers_, options.faults, SensorStream::laser);

  exposures_ = regular_stamps(options.camera_rate_hz, kCameraPhase, end);
  take_frames(sequence);
}

void Simulation::take_frames(const Sequence& sequence) {
  const Options& options = options_;
  frames_ = deliver(exposures_, options.faults, options.seed);
  for (const Frame& frame : frames_) frame_times_.push_back(frame.t_ns);
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    deliveries_.push_back({frames_[i].arrival_ns, SensorStream::camera, i});
  }
  std::stable_sort(deliveries_.begin(), deliveries_.end(),
                   [](const Delivery& a, const Delivery& b) { return a.arrival_ns < b.arrival_ns; });
  if (!options.tracks) return;
  const bool lands_hard = std::any_of(options.faults.begin(), options.faults.end(),
                                      [](const Fault& fault) { return fault.kind == FaultKind::hard_landing; });
  const auto clean_plan = lands_hard ? planned(without_faults(options), sequence, *true_calibration_.encoder) : plan_;
  Rng track_rng = make_rng(options.seed, Stream::tracks);
  const std::vector<CameraCalibration>& cameras = true_calibration_.cameras;
  Tracks clean =
      generate_tracks(scene_, clean_plan->trajectory, cameras, exposures_, obstruction_, options.track, track_rng);
  if (options.faults.empty()) {
    tracks_ = std::move(clean.frames);
  } else {
    tracks_ = fault_tracks(
        clean, frames_,
        {options.faults, cameras, clean_plan->trajectory, plan_->trajectory, passersby_, options.track, options.seed});
  }
  for (FeatureFrame& frame : tracks_) change_lenses(cameras, calibration_.cameras, frame);
}

Truth Simulation::truth(TimeNs t_ns) const {
  const double t = motion_time(t_ns);
  const Kinematics motion = plan_->trajectory.at(t);
  Truth truth;
  truth.t_ns = t_ns;
  truth.R_WB = motion.R_WB;
  truth.p_WB = motion.p_WB;
  truth.v_W = motion.v_W;
  truth.omega_B = motion.omega_B;

  const double position = std::clamp(seconds_between(truth_times_.front(), t_ns) * true_calibration_.imu.rate_hz, 0.0,
                                     static_cast<double>(biases_.size() - 1));
  const auto before = static_cast<std::size_t>(position);
  const std::size_t after = std::min(before + 1, biases_.size() - 1);
  const double f = position - static_cast<double>(before);
  truth.b_g = (1.0 - f) * biases_[before].gyro + f * biases_[after].gyro;
  truth.b_a = (1.0 - f) * biases_[before].accel + f * biases_[after].accel;

  const auto knot = static_cast<std::size_t>(std::lround(std::max(0.0, t / plan_->trajectory.period())));
  truth.mode = plan_->mode[std::min(knot, plan_->mode.size() - 1)];
  truth.n_W = scene_.terrain.normal(motion.p_WO.x(), motion.p_WO.y());
  const Eigen::Vector3d axle_W = motion.R_WO.col(1);
  const Eigen::Vector3d forward_W = axle_W.cross(truth.n_W).normalized();
  const Eigen::Vector3d left_W = truth.n_W.cross(forward_W);
  truth.slope_along = std::asin(forward_W.z());
  truth.slope_across = std::asin(left_W.z());
  truth.axle_speed = forward_W.dot(motion.v_O_W);
  truth.slip = wheels_.slip(t) + wheel_faults_.slip(t);
  return truth;
}

double Simulation::path_length() const {
  double length = 0.0;
  for (std::size_t i = 1; i < truth_times_.size(); ++i) {
    const Eigen::Vector3d before = plan_->trajectory.at(motion_time(truth_times_[i - 1])).p_WB;
    length += (plan_->trajectory.at(motion_time(truth_times_[i])).p_WB - before).norm();
  }
  return length;
}

}  // namespace ear::simulator
