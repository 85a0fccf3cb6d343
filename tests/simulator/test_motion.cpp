// The simulated motion against itself and against physics: wheels on the ground, no side slip, IMU that integrates
// back.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/simulator/support.h"
#include "tests/support/about.h"
#include "tools/simulator/constants.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/simulation.h"

namespace ear::simulator {
namespace {

using test::about;

// How deep a disc's rim lies below the ground, by trying every point: independent of the simulator's contact solver.
double deepest_by_search(const Terrain& terrain, const Eigen::Vector3d& centre_W, const Eigen::Vector3d& axle_W,
                         double radius) {
  const Eigen::Vector3d a = axle_W.unitOrthogonal();
  const Eigen::Vector3d b = axle_W.cross(a);
  double deepest = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 720; ++i) {
    const double angle = kPi / 360.0 * i;
    const Eigen::Vector3d q_W = centre_W + radius * (std::cos(angle) * a + std::sin(angle) * b);
    deepest = std::max(deepest, terrain.height(q_W.x(), q_W.y()) - q_W.z());
  }
  return deepest;
}

Eigen::Quaterniond exponential(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle < 1e-15) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation / angle));
}

// Strapdown integration of interval means. Within an interval the rate and the force are taken as linear, with the
// slope of the neighbouring means (second-order coning and sculling corrections).
struct Integrated {
  Eigen::Vector3d p_W;
  Eigen::Quaterniond q_WB;
};

Integrated integrate(const Simulation& simulation) {
  const std::vector<ear::ImuSample>& imu = simulation.imu();
  const double dt = 0.005;
  const Eigen::Vector3d gravity_W(0.0, 0.0, -9.81);
  // Samples are centred on their stamps: integration runs from the middle between two stamps to the next one.
  const TimeNs half = 2'500'000;
  const Truth start = simulation.truth(imu.front().t_ns + half);
  Eigen::Quaterniond q_WB(start.R_WB);
  Eigen::Vector3d v_W = start.v_W;
  Eigen::Vector3d p_W = start.p_WB;
  for (std::size_t i = 1; i + 1 < imu.size(); ++i) {
    const Eigen::Vector3d turn = imu[i].gyro_B * dt;
    const Eigen::Vector3d push = imu[i].accel_B * dt;
    const Eigen::Vector3d turn_slope = 0.5 * dt * (imu[i + 1].gyro_B - imu[i - 1].gyro_B);
    const Eigen::Vector3d push_slope = 0.5 * dt * (imu[i + 1].accel_B - imu[i - 1].accel_B);
    // With rate w0 + w1 s and force f0 + f1 s, s in [-1/2, 1/2]: coning and sculling of one interval.
    const Eigen::Vector3d rotation = turn + turn_slope.cross(turn) / -12.0;
    const Eigen::Vector3d push_start = push + 0.5 * turn.cross(push) + turn.cross(turn.cross(push)) / 6.0 +
                                       (turn.cross(push_slope) - turn_slope.cross(push)) / 12.0;
    const Eigen::Vector3d dv_W = q_WB * push_start + gravity_W * dt;
    // Second integral of a linear acceleration.
    const Eigen::Vector3d lean = q_WB * Eigen::Vector3d(push_slope + turn.cross(push)) * (-dt / 12.0);
    p_W += v_W * dt + 0.5 * dv_W * dt + lean;
    v_W += dv_W;
    q_WB = (q_WB * exponential(rotation)).normalized();
  }
  return {p_W, q_WB};
}

}  // namespace

TEST_CASE("motion: noise-free IMU integrates back to the truth, < 1 cm in 60 s") {
  for (const std::string name : {"static", "flat1", "fly1", "sway3"}) {
    for (const std::uint64_t seed : {1U, 2U}) {
      if (name != "fly1" && seed > 1) continue;
      CAPTURE(name);
      CAPTURE(seed);
      Options options = ideal(name, seed);
      options.duration = 60.0;
      const Simulation simulation(options);
      const Integrated end = integrate(simulation);
      const Truth truth = simulation.truth(simulation.imu()[simulation.imu().size() - 2].t_ns + 2'500'000);
      MESSAGE(name << ": " << (end.p_W - truth.p_WB).norm() << " m, "
                   << end.q_WB.angularDistance(Eigen::Quaterniond(truth.R_WB)) << " rad");
      CHECK((end.p_W - truth.p_WB).norm() < 0.01);
      CHECK(end.q_WB.angularDistance(Eigen::Quaterniond(truth.R_WB)) < 1e-5);
    }
  }
}

TEST_CASE("motion: velocity, rate and acceleration are derivatives of the pose") {
  const Simulation simulation(ideal("fly1", 3));
  const Trajectory& trajectory = simulation.plan().trajectory;
  const double h = 1e-5;
  for (double t = 1.0; t < 50.0; t += 0.317) {
    CAPTURE(t);
    const Kinematics now = trajectory.at(t);
    const Kinematics before = trajectory.at(t - h);
    const Kinematics after = trajectory.at(t + h);
    CHECK(((after.p_WB - before.p_WB) / (2 * h) - now.v_W).norm() < 1e-6);
    CHECK(((after.v_W - before.v_W) / (2 * h) - now.a_W).norm() < 1e-4);
    CHECK(((after.p_WO - before.p_WO) / (2 * h) - now.v_O_W).norm() < 1e-6);
    const Eigen::AngleAxisd turned(Eigen::Matrix3d(before.R_WB.transpose() * after.R_WB));
    CHECK((turned.angle() * turned.axis() / (2 * h) - now.omega_B).norm() < 1e-6);
  }
}

namespace {

// Greatest distance of a rim from the ground, either way, while the wheels drive.
double worst_contact(const Simulation& simulation) {
  const ear::EncoderCalibration& axle = *simulation.true_calibration().encoder;
  double worst = 0.0;
  for (std::size_t i = 0; i < simulation.imu().size(); i += 97) {
    const TimeNs t_ns = simulation.imu()[i].t_ns;
    if (simulation.truth(t_ns).mode == Mode::air) continue;
    const Kinematics motion = simulation.plan().trajectory.at(motion_time(t_ns));
    for (const double side : {0.5, -0.5}) {
      const Eigen::Vector3d axle_W = motion.R_WO.col(1);
      const Eigen::Vector3d centre_W = motion.p_WO + side * axle.track_width * axle_W;
      worst = std::max(worst,
                       std::abs(deepest_by_search(simulation.scene().terrain, centre_W, axle_W, axle.wheel_radius[0])));
    }
  }
  return worst;
}

struct Speeds {
  double sideways = 0.0, fastest = 0.0;  // of the axle on the ground [m/s]
};

Speeds axle_speeds(const Simulation& simulation) {
  Speeds speeds;
  for (const ear::ImuSample& sample : simulation.imu()) {
    if (simulation.truth(sample.t_ns).mode == Mode::air) continue;
    const Kinematics motion = simulation.plan().trajectory.at(motion_time(sample.t_ns));
    speeds.sideways = std::max(speeds.sideways, std::abs(motion.R_WO.col(1).dot(motion.v_O_W)));
    speeds.fastest = std::max(speeds.fastest, motion.v_O_W.norm());
  }
  return speeds;
}

// Distance to walls and furniture; outdoors there is room enough.
double room_clearance(const Simulation& simulation) {
  double clearance = std::numeric_limits<double>::infinity();
  if (simulation.scene().ground != Material::floor) return clearance;
  for (std::size_t i = 0; i < simulation.imu().size(); i += 20) {
    const Eigen::Vector3d p_W = simulation.truth(simulation.imu()[i].t_ns).p_WB;
    clearance = std::min({clearance, p_W.x(), p_W.y(), simulation.scene().size.x() - p_W.x(),
                          simulation.scene().size.y() - p_W.y(), 3.5 - p_W.z()});
    for (const Eigen::Vector4d& box : room_footprints()) {
      const Eigen::Array2d outside =
          (box.head<2>() - p_W.head<2>()).array().max((p_W.head<2>() - box.tail<2>()).array()).max(0.0);
      clearance = std::min(clearance, outside.matrix().norm());
    }
  }
  return clearance;
}

// Steepest uphill, downhill and across [rad].
Eigen::Vector3d steepest(const Simulation& simulation) {
  Eigen::Vector3d angles = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < simulation.imu().size(); i += 10) {
    const Truth truth = simulation.truth(simulation.imu()[i].t_ns);
    angles = angles.cwiseMax(Eigen::Vector3d(truth.slope_along, -truth.slope_along, std::abs(truth.slope_across)));
  }
  return angles;
}

}  // namespace

TEST_CASE("motion: wheels stay on the ground and roll straight ahead, clear of everything, as far as the table says") {
  struct Expected {
    std::string name;
    double length, uphill, downhill, across;  // [m], and the steepest slopes [deg]
  };
  const std::vector<Expected> table{{"flat1", 46.0, 0, 0, 0},    {"flat2", 46.0, 0, 0, 0},
                                    {"flat3", 45.5, 0, 0, 0},    {"fly1", 34.0, 0, 0, 0},
                                    {"fly2", 59.0, 0, 0, 0},     {"wave1", 41.0, 12, 12, 12},
                                    {"wave2", 31.0, 11, 11, 11}, {"wave3", 28.5, 12, 12, 12},
                                    {"slope", 52.0, 24, 24, 20}, {"lawn", 64.0, 10, 10, 10}};
  for (const Expected& expected : table) {
    CAPTURE(expected.name);
    const Simulation simulation(ideal(expected.name, 4));
    CHECK(simulation.path_length() == about(expected.length, 0.03));
    const Integrated end = integrate(simulation);
    const Truth truth = simulation.truth(simulation.imu()[simulation.imu().size() - 2].t_ns + 2'500'000);
    CHECK((end.p_W - truth.p_WB).norm() < 0.01);
    const double contact = worst_contact(simulation);
    CHECK(contact < 1e-4);
    const Speeds speeds = axle_speeds(simulation);
    CHECK(speeds.sideways < 1e-4);
    CHECK(speeds.fastest > 0.5);
    CHECK(room_clearance(simulation) > 0.3);
    const Eigen::Vector3d slopes = steepest(simulation) / kDegree;
    CHECK((slopes - Eigen::Vector3d(expected.uphill, expected.downhill, expected.across)).cwiseAbs().maxCoeff() < 3.5);
    MESSAGE(expected.name << ": contact " << contact << " m, sideways " << speeds.sideways << " m/s, slopes "
                          << slopes.transpose() << " deg");
  }
}

TEST_CASE("motion: a standing axle does not move, however the body swings and the wheels spin") {
  for (const std::string name : {"static", "sway1", "sway2", "sway3"}) {
    CAPTURE(name);
    const Simulation simulation(ideal(name, 5));
    CHECK(axle_speeds(simulation).fastest < 1e-9);
  }
}

TEST_CASE("motion: the paths keep clear of the furniture, inside the room, on every seed") {
  for (const std::string name : {"flat1", "flat2", "flat3", "fly1", "fly2"}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      CAPTURE(name);
      CAPTURE(seed);
      CHECK(room_clearance(Simulation(ideal(name, seed))) > 0.3);
    }
  }
}

TEST_CASE("motion: the body pitches freely about the axle, and stands still when it stands") {
  const Simulation simulation(ideal("flat1", 6));
  double lowest = 0.0;
  double highest = 0.0;
  for (const ear::ImuSample& sample : simulation.imu()) {
    const Kinematics motion = simulation.plan().trajectory.at(motion_time(sample.t_ns));
    const double pitch = std::atan2(-motion.R_WO(2, 0), motion.R_WO(2, 2));
    lowest = std::min(lowest, pitch);
    highest = std::max(highest, pitch);
  }
  CHECK(highest - lowest > 8.0 * kPi / 180.0);
  CHECK(highest < 20.0 * kPi / 180.0);
  CHECK(lowest > -20.0 * kPi / 180.0);

  for (int i = 0; i < 300; ++i) {  // the first 1.5 s
    CHECK(simulation.imu()[static_cast<std::size_t>(i)].gyro_B.norm() < 1e-6);
    CHECK(simulation.imu()[static_cast<std::size_t>(i)].accel_B.norm() == doctest::Approx(9.81).epsilon(1e-7));
  }
}

TEST_CASE("motion: a landing stops within 20 ms and hits with 3 to 6 g") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CAPTURE(seed);
    const Simulation simulation(ideal("fly1", seed));
    REQUIRE(simulation.plan().touchdowns.size() == 2);
    for (const double touchdown : simulation.plan().touchdowns) {
      const double before = simulation.plan().trajectory.at(touchdown - 0.005).v_O_W.z();
      const double after = simulation.plan().trajectory.at(touchdown + 0.018).v_O_W.z();
      CHECK(before < -0.3);
      CHECK(before > -0.52);
      CHECK(after > -0.05);
      double peak = 0.0;
      for (const ear::ImuSample& sample : simulation.imu()) {
        if (std::abs(motion_time(sample.t_ns) - touchdown) < 0.1) peak = std::max(peak, sample.accel_B.norm());
      }
      CAPTURE(before);
      CHECK(peak > 2.5 * 9.81);
      CHECK(peak < 6.0 * 9.81);
    }
  }
}

}  // namespace ear::simulator
