// Pre-integrated displacements against the simulator's truth: sensors without noise, the true calibration.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "filter/ingest/imu_buffer.h"
#include "smoother/wheel_preintegration.h"
#include "tools/simulator/simulation.h"

using namespace ear;
using namespace ear::smoother;

namespace {

constexpr std::size_t kReadings = 100;  // per displacement: 1 s

simulator::Simulation simulate(const std::string& sequence) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = 8201;
  options.calibration_error = 0.0;
  options.sensor_noise = false;
  options.tracks = false;
  return simulator::Simulation(options);
}

/// Mean rate between two instants.
Eigen::Vector3d mean_rate(const ImuBuffer& imu, TimeNs from_ns, TimeNs to_ns) {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  imu.for_each_piece(from_ns, to_ns,
                     [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt) { turn += gyro_B * dt; });
  return turn / seconds_between(from_ns, to_ns);
}

/// How far the wheels turned between two readings [rad].
Eigen::Vector2d wheel_turn(const EncoderSample& from, const EncoderSample& to, std::int64_t resolution) {
  const auto turn = [resolution](std::int64_t a, std::int64_t b) {
    const auto revolution = static_cast<double>(resolution);
    return 2.0 * M_PI * std::remainder(static_cast<double>(b - a), revolution) / revolution;
  };
  return {turn(from.left_count, to.left_count), turn(from.right_count, to.right_count)};
}

/// What the ground's normal is taken to be.
enum class Normal {
  travelled,  ///< that of the plane in which the axle and its velocity lie: the direction is right, the way is tested
  wheels,     ///< mean of the ground's normals where the wheels touch it
  middle,     ///< that of the ground below the middle of the axle
};

Eigen::Vector3d normal_of_travel_W(const simulator::Truth& truth, const Eigen::Isometry3d& T_BO) {
  const Eigen::Matrix3d R_WO = truth.R_WB * T_BO.linear();
  const Eigen::Vector3d v_O_W = truth.v_W + truth.R_WB * truth.omega_B.cross(T_BO.translation());
  const Eigen::Vector3d across_W = v_O_W.cross(R_WO.col(1));
  if (across_W.norm() < 1e-6) return truth.n_W;
  return (across_W.dot(R_WO.col(2)) > 0.0 ? across_W : Eigen::Vector3d(-across_W)).normalized();
}

Eigen::Vector3d normal_at_wheels_W(const simulator::Truth& truth, const EncoderCalibration& axle,
                                   const simulator::Terrain& terrain) {
  const Eigen::Vector3d y_W = truth.R_WB * axle.T_BO.linear().col(1);
  const Eigen::Vector3d p_WO = truth.p_WB + truth.R_WB * axle.T_BO.translation();
  Eigen::Vector3d sum_W = Eigen::Vector3d::Zero();
  for (const double side : {0.5, -0.5}) {
    const Eigen::Vector3d centre_W = p_WO + side * axle.track_width * y_W;
    Eigen::Vector3d n_W = truth.n_W;
    for (int i = 0; i < 5; ++i) {  // the contact lies below the centre, along the normal in the wheel's own plane
      const Eigen::Vector3d up_W = (n_W - n_W.dot(y_W) * y_W).normalized();
      const Eigen::Vector3d contact_W = centre_W - axle.wheel_radius[0] * up_W;
      n_W = terrain.normal(contact_W.x(), contact_W.y());
    }
    sum_W += n_W;
  }
  return sum_W.normalized();
}

Eigen::Vector3d normal_W(const simulator::Simulation& simulation, TimeNs t_ns, Normal normal) {
  const EncoderCalibration& axle = *simulation.true_calibration().encoder;
  const simulator::Truth truth = simulation.truth(t_ns);
  if (normal == Normal::travelled) return normal_of_travel_W(truth, axle.T_BO);
  if (normal == Normal::wheels) return normal_at_wheels_W(truth, axle, simulation.scene().terrain);
  return truth.n_W;
}

/// Errors of the displacements, one per second of the sequence.
struct Errors {
  double rms = 0.0, worst = 0.0;  ///< [m]
  double ahead = 0.0;             ///< along the displacements, all together, relative to their length
};

Errors displacement_errors(const simulator::Simulation& simulation, Normal normal, bool with_roll = true) {
  const EncoderCalibration& axle = *simulation.calibration().encoder;
  ImuBuffer imu(simulation.imu().size());
  for (const ImuSample& sample : simulation.imu()) imu.push(sample);
  WheelModel wheels;
  wheels.radius = {axle.wheel_radius[0], axle.wheel_radius[1]};
  wheels.track_width = with_roll ? axle.track_width : 0.0;
  wheels.y_B = axle.T_BO.linear().col(1);
  WheelPreintegration integration(wheels, WheelNoise{});

  Errors errors;
  double squares = 0.0, length = 0.0;
  int count = 0;
  const std::vector<EncoderSample>& readings = simulation.encoders();
  for (std::size_t first = 0; first + kReadings < readings.size(); first += kReadings) {
    for (std::size_t k = first; k < first + kReadings; ++k) {
      const TimeNs from_ns = readings[k].t_ns;
      const TimeNs to_ns = readings[k + 1].t_ns;
      const Eigen::Vector3d n_B =
          simulation.truth(from_ns).R_WB.transpose() * normal_W(simulation, from_ns + (to_ns - from_ns) / 2, normal);
      if (k == first) integration.start(n_B, Eigen::Vector3d::Zero());
      integration.set_normal(n_B, 0.0);
      integration.add_interval(mean_rate(imu, from_ns, to_ns), seconds_between(from_ns, to_ns),
                               wheel_turn(readings[k], readings[k + 1], axle.resolution));
    }
    const simulator::Truth start = simulation.truth(readings[first].t_ns);
    const simulator::Truth end = simulation.truth(readings[first + kReadings].t_ns);
    const Eigen::Vector3d p_BO = axle.T_BO.translation();
    const Eigen::Vector3d expected_Bi = start.R_WB.transpose() * (end.p_WB + end.R_WB * p_BO - start.p_WB) - p_BO;
    const Eigen::Vector3d error_Bi = integration.result().alpha_Bi - expected_Bi;
    squares += error_Bi.squaredNorm();
    errors.worst = std::max(errors.worst, error_Bi.norm());
    if (expected_Bi.norm() > 0.0) errors.ahead += error_Bi.dot(expected_Bi.normalized());
    length += expected_Bi.norm();
    ++count;
  }
  errors.rms = std::sqrt(squares / count);
  errors.ahead /= length;
  return errors;
}

void show(const std::string& name, const Errors& errors) {
  MESSAGE(name << ": rms " << 1e3 * errors.rms << " mm, worst " << 1e3 * errors.worst << " mm, ahead "
               << 100.0 * errors.ahead << " %");
}

}  // namespace

TEST_CASE("wheel_preintegration: the displacement over a second is the simulator's") {
  for (const std::string sequence : {"flat1", "wave1", "slope", "lawn"}) {
    CAPTURE(sequence);
    const simulator::Simulation simulation = simulate(sequence);
    const Errors travelled = displacement_errors(simulation, Normal::travelled);
    show(sequence + ", normal of the plane travelled", travelled);
    CHECK(travelled.rms < 1e-5);
    CHECK(travelled.worst < 2e-5);
    CHECK(std::abs(travelled.ahead) < 2e-6);
    const Errors wheels = displacement_errors(simulation, Normal::wheels);
    show(sequence + ", normal at the wheels", wheels);
    CHECK(wheels.rms < 2e-3);
    CHECK(std::abs(wheels.ahead) < 2e-5);
    const Errors middle = displacement_errors(simulation, Normal::middle);
    show(sequence + ", normal below the middle", middle);
    CHECK(middle.rms < 1e-2);
  }
}

TEST_CASE("wheel_preintegration: without the roll of the axle the way over waves is too long") {
  const Errors errors = displacement_errors(simulate("wave1"), Normal::travelled, false);
  show("wave1, without roll", errors);
  CHECK(errors.ahead > 3e-4);
}
