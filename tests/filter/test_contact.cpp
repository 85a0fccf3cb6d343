#include <doctest/doctest.h>

#include <functional>
#include <limits>
#include <vector>

#include "filter/sources/ground/contact.h"
#include "tests/support/flat_ground.h"

using namespace ear;
using namespace ear::test;

namespace {

const double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr double kGravity = 9.81;

/// A vehicle over a floor, step by step of 5 ms, and what the detector makes of it.
class Drive {
 public:
  explicit Drive(const FilterConfig& config = {}) : detector(config, calibration) {}

  // What the next steps do.
  double climb = 0.0;                             ///< [m/s]
  double speed = 0.0;                             ///< of the vehicle [m/s]
  double swing = 0.0;                             ///< amplitude of the body's pitch at 1 Hz [rad]
  double force = kGravity;                        ///< specific force along the body's z [m/s^2]
  std::function<void(LaserSample&)> obstruction;  ///< changes readings

  void run(double duration) {
    for (int steps = static_cast<int>(std::lround(duration / 0.005)); steps > 0; --steps) step();
  }

  /// As if the floor or the vehicle jumped.
  void set_height(double height) { pose_.height = height; }

  [[nodiscard]] double t() const { return t_; }

  struct Event {
    ContactEvent what;
    double t;  ///< [s]
  };
  std::vector<Event> events;
  Calibration calibration = vehicle_with_beams();
  ContactDetector detector;

 private:
  void step() {
    ++count_;
    t_ = 0.005 * static_cast<double>(count_);
    const TimeNs t_ns = 5'000'000 * count_;
    const double before = pose_.pitch;
    pose_.height = std::max(0.0, pose_.height + 0.005 * climb);
    pose_.pitch = swing * std::sin(2.0 * M_PI * t_);
    wheel_angle_ += 0.005 * speed / kWheelRadius - (pose_.pitch - before);

    std::normal_distribution<double> normal(0.0, 1.0);
    const Eigen::Vector3d gyro((0.014 * normal(rng_)), (pose_.pitch - before) / 0.005 + 0.014 * normal(rng_), 0.0);
    note(detector.add_imu({t_ns, gyro, Eigen::Vector3d(0.0, 0.0, force + 0.14 * normal(rng_))}));
    if (count_ % 2 == 0) {
      const auto resolution = calibration.encoder->resolution;
      auto counts = std::llround(wheel_angle_ / (2.0 * M_PI) * static_cast<double>(resolution)) % resolution;
      if (counts < 0) counts += resolution;
      if (const auto increment = reader_.add({t_ns, counts, counts})) note(detector.add_wheels(*increment));
    }
    if (count_ % 4 == 0) {
      LaserSample sample = read_beams(calibration, t_ns, pose_, calibration.lasers->noise, rng_);
      if (obstruction) obstruction(sample);
      note(detector.add_laser(sample));
    }
  }

  void note(ContactEvent event) {
    if (event != ContactEvent::none) events.push_back({event, t_});
  }

  std::mt19937_64 rng_{5};
  EncoderReader reader_{*calibration.encoder};
  VehiclePose pose_;
  double wheel_angle_ = 0.0;
  TimeNs count_ = 0;
  double t_ = 0.0;
};

/// Up to 1 m, and to a standstill there.
void fly(Drive& drive) {
  drive.climb = 0.5;
  drive.run(2.0);
  drive.climb = 0.0;
  drive.run(1.0);
  REQUIRE(drive.detector.mode() == ContactMode::air);
  drive.events.clear();
}

/// Down to `height` at `speed`.
void descend(Drive& drive, double from, double height, double speed) {
  drive.climb = -speed;
  drive.run((from - height) / speed);
}

}  // namespace

TEST_CASE("contact: unknown at first, and within 0.2 s on the ground, which is no event") {
  Drive drive;
  CHECK(drive.detector.mode() == ContactMode::unknown);
  CHECK_FALSE(drive.detector.since_ns());
  drive.run(0.2);
  CHECK(drive.detector.mode() == ContactMode::ground);
  CHECK(drive.events.empty());
}

TEST_CASE("contact: switched on in the air") {
  Drive drive;
  drive.set_height(1.0);
  drive.run(0.3);
  CHECK(drive.detector.mode() == ContactMode::air);
}

TEST_CASE("contact: a take-off is seen within 0.15 s, once") {
  for (const double climb : {0.2, 0.5, 2.0, 5.0}) {
    CAPTURE(climb);
    Drive drive;
    drive.run(2.0);
    drive.climb = climb;
    drive.run(0.5);
    REQUIRE(drive.events.size() == 1);
    CHECK(drive.events[0].what == ContactEvent::takeoff);
    CHECK(drive.events[0].t - 2.0 < 0.15);
    CHECK(drive.detector.since_ns() == std::llround(1e9 * drive.events[0].t));
  }
}

TEST_CASE("contact: a strike near the ground is a touchdown at once; a strike high above it is none") {
  Drive drive;
  drive.run(1.0);
  fly(drive);
  drive.force = 40.0;
  drive.run(0.02);
  CHECK(drive.events.empty());
  drive.force = kGravity;
  descend(drive, 1.0, 0.0, 0.4);
  CHECK(drive.events.empty());
  drive.climb = 0.0;
  drive.force = 40.0;
  drive.run(0.02);
  REQUIRE(drive.events.size() == 1);
  CHECK(drive.events[0].what == ContactEvent::touchdown);
  drive.force = kGravity;
  drive.run(2.0);
  CHECK(drive.events.size() == 1);
}

TEST_CASE("contact: a landing without a strike is seen when it has come to rest") {
  Drive drive;
  drive.run(1.0);
  fly(drive);
  descend(drive, 1.0, 0.0, 0.1);
  CHECK(drive.events.empty());
  const double landed = drive.t();
  drive.climb = 0.0;
  drive.run(1.0);
  REQUIRE(drive.events.size() == 1);
  CHECK(drive.events[0].t - landed < 0.5);
}

TEST_CASE("contact: a vehicle that bounces has left the ground, and lands again") {
  Drive drive;
  drive.run(1.0);
  fly(drive);
  descend(drive, 1.0, 0.0, 0.5);
  drive.force = 60.0;
  drive.run(0.02);
  drive.force = 0.5;
  drive.climb = 0.7;
  drive.run(0.1);
  drive.climb = -0.7;
  drive.run(0.1);
  drive.climb = 0.0;
  drive.force = 30.0;
  drive.run(0.02);
  drive.force = kGravity;
  drive.run(1.0);
  REQUIRE(drive.events.size() == 3);
  CHECK(drive.events[0].what == ContactEvent::touchdown);
  CHECK(drive.events[1].what == ContactEvent::takeoff);
  CHECK(drive.events[2].what == ContactEvent::touchdown);
}

TEST_CASE("contact: a body that swings on standing wheels stays on the ground") {
  Drive drive;
  drive.swing = 0.26;
  drive.run(20.0);
  CHECK(drive.detector.mode() == ContactMode::ground);
  CHECK(drive.events.empty());
}

TEST_CASE("contact: no broken or obstructed beam fakes a take-off, or hides one") {
  const std::vector<std::pair<const char*, std::function<double(double)>>> faults = {
      {"no return", [](double) { return kNothing; }},
      {"stuck", [](double) { return 0.3; }},
      {"a blade of grass", [](double range) { return 0.5 * range; }},
      {"much too long", [](double range) { return range + 1.0; }},
      {"a little too long", [](double range) { return range + 0.02; }}};
  for (const auto& fault : faults) {
    for (std::size_t beam = 0; beam < 3; ++beam) {
      CAPTURE(fault.first);
      CAPTURE(beam);
      Drive drive;
      drive.swing = 0.05;
      drive.speed = 0.7;
      drive.run(2.0);
      drive.obstruction = [&](LaserSample& s) { s.range[beam] = fault.second(s.range[beam]); };
      drive.run(10.0);
      CHECK(drive.events.empty());
      drive.speed = 0.0;
      drive.run(2.0);
      CHECK(drive.events.empty());
      drive.climb = 0.4;
      drive.run(1.0);
      REQUIRE(drive.events.size() == 1);
      CHECK(drive.events[0].what == ContactEvent::takeoff);
    }
  }
}

TEST_CASE("contact: the one beam that still sees the ground is enough for a take-off, and for none on the ground") {
  for (std::size_t alone = 0; alone < 3; ++alone) {
    CAPTURE(alone);
    Drive drive;
    drive.obstruction = [alone](LaserSample& sample) {
      for (std::size_t beam = 0; beam < sample.range.size(); ++beam) {
        if (beam != alone) sample.range[beam] = kNothing;
      }
    };
    drive.speed = 0.5;
    drive.run(3.0);
    CHECK(drive.detector.mode() == ContactMode::ground);
    CHECK(drive.events.empty());
    drive.speed = 0.0;
    const double lifts_off = drive.t();
    for (int step = 0; step < 100; ++step) {  // at 1 m/s^2
      drive.climb = 0.01 * step;
      drive.run(0.01);
    }
    REQUIRE(drive.events.size() == 1);
    CHECK(drive.events.front().what == ContactEvent::takeoff);
    CHECK(drive.events.front().t - lifts_off < 0.45);  // within 10 cm
  }
}

TEST_CASE("contact: no beam sees anything, and the mode stays, on the ground and in the air") {
  Drive drive;
  drive.run(1.0);
  drive.obstruction = [](LaserSample& s) { s.range.assign(s.range.size(), kNothing); };
  drive.run(5.0);
  CHECK(drive.detector.mode() == ContactMode::ground);
  drive.obstruction = {};
  drive.run(1.0);
  fly(drive);
  drive.obstruction = [](LaserSample& s) { s.range.assign(s.range.size(), kNothing); };
  drive.run(2.0);
  drive.force = 40.0;
  drive.run(0.02);
  drive.force = kGravity;
  drive.run(0.2);
  CHECK(drive.events.empty());
  drive.climb = -0.5;
  drive.obstruction = {};
  drive.run(3.0);
  REQUIRE(drive.events.size() == 1);
  CHECK(drive.events[0].what == ContactEvent::touchdown);
}

TEST_CASE("contact: a car without lasers is on the ground; without wheels nobody knows") {
  Calibration car = vehicle_with_beams();
  car.lasers.reset();
  CHECK(ContactDetector(FilterConfig{}, car).mode() == ContactMode::ground);
  Calibration drone = vehicle_with_beams();
  drone.encoder.reset();
  ContactDetector detector(FilterConfig{}, drone);
  CHECK(detector.add_laser({1, {0.1, 0.1, 0.1}}) == ContactEvent::none);
  CHECK(detector.add_imu({2, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 50.0)}) == ContactEvent::none);
  CHECK(detector.add_wheels({2, 3, {0.1, 0.1}}) == ContactEvent::none);
  CHECK(detector.mode() == ContactMode::unknown);
}
