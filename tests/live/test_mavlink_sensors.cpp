#include "src/live/mavlink_sensors.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace ear;
using namespace ear::live;

namespace {

/// A vehicle with wheels and two beams, and what its intake was given.
struct Vehicle {
  static Calibration calibration() {
    Calibration calibration;
    calibration.encoder.emplace();
    calibration.encoder->wheel_radius = {0.05, 0.1};
    calibration.encoder->resolution = 1000;
    calibration.lasers.emplace();
    calibration.lasers->beams.resize(2);
    return calibration;
  }

  void take(const mavlink::Payload& payload) { sensors.take({{1, 1}, 0, payload}); }
  void synchronise() {
    for (int i = 0; i < 20; ++i) {
      const TimeNs now = clock.now();
      take(to_payload(mavlink::TimeSync{now - boot_ns, now, 1, 197}));
    }
  }
  [[nodiscard]] std::int64_t remote_us() const { return (clock.now() - boot_ns) / 1000; }

  LiveClock clock;
  TimeNs boot_ns = clock.now() - 1'000'000'000'000;  ///< when the sender started
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> wheels;
  std::vector<QueuedOdometry::Ranges> ranges;
  LiveEstimator estimator{Config{}, calibration(), {}, {}};
  Intake intake{estimator,
                calibration(),
                clock,
                {[this](const ImuSample& s, const std::optional<NavState>&) { imu.push_back(s); },
                 [this](const EncoderSample& s) { wheels.push_back(s); },
                 [this](const QueuedOdometry::Ranges& s) { ranges.push_back(s); }, nullptr}};
  MavlinkSensors sensors{{MavlinkInputs::Imu::highres, true, {4, 7}}, intake};
};

bool says(Vehicle& vehicle, const std::string& words) {
  for (const std::string& text : vehicle.sensors.look()) {
    if (text.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("mavlink sensors: samples without a clock are passed over, and this is said") {
  Vehicle vehicle;
  for (int i = 0; i < 60; ++i) vehicle.take(to_payload(mavlink::ImuMessage{vehicle.remote_us(), {}, {}, 0}));
  CHECK(vehicle.imu.empty());
  CHECK(says(vehicle, "60 samples passed over: too few answers to TIMESYNC"));
  vehicle.synchronise();
  CHECK(says(vehicle, "the clocks are synchronised"));
}

TEST_CASE("mavlink sensors: messages become samples, in SI and in our time") {
  Vehicle vehicle;
  vehicle.synchronise();
  const std::int64_t stamp = vehicle.remote_us();
  vehicle.take(to_payload(mavlink::ImuMessage{stamp, {1.0, 2.0, 9.5}, {0.25, -0.5, 0.125}, 0}));
  vehicle.take(to_payload(mavlink::ImuMessage{stamp, {9.0, 9.0, 9.0}, {9.0, 9.0, 9.0}, 1}));  // another IMU
  REQUIRE(vehicle.imu.size() == 1);
  CHECK(vehicle.imu[0].accel_B == Eigen::Vector3d(1.0, 2.0, 9.5));
  CHECK(vehicle.imu[0].gyro_B == Eigen::Vector3d(0.25, -0.5, 0.125));
  CHECK(std::abs(seconds_between(stamp * 1000 + vehicle.boot_ns, vehicle.imu[0].t_ns)) < 1e-3);

  mavlink::WheelDistance wheels{stamp, {}, 2};
  wheels.distance[0] = 2.0 * M_PI * 0.05 * 3.5;  // three and a half turns
  wheels.distance[1] = -2.0 * M_PI * 0.1;
  vehicle.take(to_payload(wheels));
  REQUIRE(vehicle.wheels.size() == 1);
  CHECK(vehicle.wheels[0].left_count == 3500);
  CHECK(vehicle.wheels[0].right_count == -1000);
}

TEST_CASE("mavlink sensors: beams that have messages of their own become one reading") {
  Vehicle vehicle;
  vehicle.synchronise();
  const auto beam = [&](int id, double metres) {
    vehicle.take(to_payload(
        mavlink::DistanceSensor{vehicle.remote_us() / 1000, metres, 0.02, 4.0, static_cast<std::uint8_t>(id), 0}));
  };
  beam(7, 0.5);
  beam(3, 9.0);  // not ours
  CHECK(vehicle.ranges.empty());
  beam(4, 0.25);
  REQUIRE(vehicle.ranges.size() == 1);
  CHECK(vehicle.ranges[0].range[0] == doctest::Approx(0.25));
  CHECK(vehicle.ranges[0].range[1] == doctest::Approx(0.5));
  beam(4, 0.26);
  beam(4, 0.27);  // the other one is silent
  REQUIRE(vehicle.ranges.size() == 2);
  CHECK(std::isnan(vehicle.ranges[1].range[1]));
  beam(7, 4.0);  // nothing in reach
  REQUIRE(vehicle.ranges.size() == 3);
  CHECK(std::isnan(vehicle.ranges[2].range[1]));
}

TEST_CASE("mavlink sensors: stamps of another clock, and numbers that are none, are refused") {
  Vehicle vehicle;
  vehicle.synchronise();
  vehicle.take(to_payload(mavlink::ImuMessage{vehicle.clock.now() / 1000, {}, {}, 0}));  // since 1970
  CHECK(vehicle.imu.empty());
  CHECK(says(vehicle, "not of the clock that answers TIMESYNC"));
  mavlink::WheelDistance wheels{vehicle.remote_us(), {}, 2};
  wheels.distance[0] = std::numeric_limits<double>::quiet_NaN();
  vehicle.take(to_payload(wheels));
  CHECK(vehicle.wheels.empty());
}

TEST_CASE("mavlink sensors: sensors that the calibration has not are refused at once") {
  LiveClock clock;
  Calibration imu_and_wheels = Vehicle::calibration();
  imu_and_wheels.lasers.reset();
  LiveEstimator estimator(Config{}, imu_and_wheels, {}, {});
  Intake intake(estimator, imu_and_wheels, clock, {});
  CHECK_THROWS_WITH_AS(MavlinkSensors({MavlinkInputs::Imu::none, false, {1}}, intake),
                       "mavlink: 1 ranges are asked for, and the calibration has 0 beams", std::invalid_argument);
}
