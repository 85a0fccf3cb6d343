#include <doctest/doctest.h>

#include <functional>
#include <limits>

#include "filter/sources/ground/ground_tracker.h"
#include "tests/support/about.h"
#include "tests/support/flat_ground.h"

using namespace ear;
using namespace ear::test;

namespace {

const double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr double kUp = 9.81;

/// A body that pitches by 8 degrees at 1 Hz, tracked at 200 Hz with readings at 50 Hz.
class Flight {
 public:
  int step(double height, const std::function<void(LaserSample&)>& change = {}) {
    for (int i = 0; i < 4; ++i) {
      const VehiclePose before = pose;
      t_ += 0.005;
      pose.pitch = 0.14 * std::sin(2.0 * M_PI * t_);
      const Eigen::Vector3d angle_B(0.0, pose.pitch - before.pitch, 0.0);
      tracker.turn(angle_B, pose.R_WB().transpose() * Eigen::Vector3d(0.0, 0.0, kUp), 0.005);
    }
    pose.height = height;
    LaserSample sample = read_beams(calibration, std::llround(1e9 * t_), pose, 0.004, rng_);
    if (change) change(sample);
    return tracker.update(sample);
  }

  [[nodiscard]] double normal_error() const {
    return (tracker.n_B() - pose.R_WB().transpose() * Eigen::Vector3d::UnitZ()).norm();
  }

  Calibration calibration = vehicle_with_beams();
  GroundTracker tracker{*calibration.lasers, *calibration.encoder, OdometerConfig{}};
  VehiclePose pose;

 private:
  std::mt19937_64 rng_{11};
  double t_ = 0.0;
};

}  // namespace

TEST_CASE("ground tracker: height and normal, and their standard deviations") {
  Flight flight;
  for (int i = 0; i < 10; ++i) flight.step(0.3);
  double squares = 0.0;
  constexpr int kReadings = 500;
  for (int i = 0; i < kReadings; ++i) {
    flight.step(0.3 + 0.05 * std::sin(0.06 * i));  // up and down by 0.15 m/s
    const double error = flight.tracker.height() - flight.pose.height;
    CHECK(std::abs(error) < 0.015);
    CHECK(flight.normal_error() < 0.05);
    squares += error * error / std::pow(flight.tracker.height_sigma(), 2);
  }
  CHECK(squares / kReadings < 1.2);  // the ground's unevenness, which this floor has not, is part of sigma
  CHECK(squares / kReadings > 0.2);
}

TEST_CASE("ground tracker: two beams and the gyroscope go on when the third is lost, stuck or wrong") {
  for (std::size_t beam = 0; beam < 3; ++beam) {
    CAPTURE(beam);
    Flight lost, stuck, wrong;
    for (int i = 0; i < 50; ++i) {
      lost.step(0.0);
      stuck.step(0.0);
      wrong.step(0.0);
    }
    for (int i = 0; i < 100; ++i) {
      CAPTURE(i);
      CHECK(lost.step(0.0, [&](LaserSample& s) { s.range[beam] = kNothing; }) == 2);
      stuck.step(0.0, [&](LaserSample& s) { s.range[beam] = 0.097; });
      CHECK(wrong.step(0.0, [&](LaserSample& s) { s.range[beam] -= 0.06; }) == 2);
      for (const Flight* flight : {&lost, &stuck, &wrong}) {
        CHECK(std::abs(flight->tracker.height()) < 0.02);
        CHECK(flight->normal_error() < 0.12);
      }
    }
  }
}

TEST_CASE("ground tracker: one wrong reading is not used, and its beam must agree for a while before it is again") {
  Flight flight;
  for (int i = 0; i < 50; ++i) flight.step(0.0);
  CHECK(flight.step(0.0, [](LaserSample& s) { s.range[2] += 0.3; }) == 2);
  CHECK(flight.step(0.0) == 2);
  for (int i = 0; i < 20; ++i) flight.step(0.0);
  CHECK(flight.step(0.0) == 3);
}

TEST_CASE("ground tracker: a floor that is suddenly another one is found again") {
  Flight flight;
  for (int i = 0; i < 50; ++i) flight.step(1.0);
  for (int i = 0; i < 6; ++i) flight.step(0.4);  // over a table
  CHECK(flight.tracker.height() == about(0.4, 0.05));
}

TEST_CASE("ground tracker: without readings it does not know, and afterwards it does again") {
  Flight flight;
  for (int i = 0; i < 50; ++i) flight.step(1.0);
  for (int i = 0; i < 100; ++i) flight.step(6.0);  // too high for the beams
  for (int i = 0; i < 6; ++i) flight.step(2.0);
  CHECK(flight.tracker.height() == about(2.0, 0.02));
  CHECK(flight.tracker.height_sigma() < 0.02);
}

TEST_CASE("ground tracker: a reading that was ahead of time takes nothing from those after it") {
  Flight flight;
  flight.step(0.3, [](LaserSample& sample) { sample.t_ns += 3'600'000'000'000; });
  for (int i = 0; i < 10; ++i) CHECK(flight.step(0.3) == 3);
  CHECK(flight.tracker.height() == about(0.3, 0.05));
}
