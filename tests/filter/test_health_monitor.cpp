// From records to faults, status and numbers that a flight controller acts on.
#include <doctest/doctest.h>

#include <limits>

#include "filter/health/health_monitor.h"

using namespace ear;

namespace {

TimeNs at(double t) { return static_cast<TimeNs>(1e9 * (100.0 + t)); }

Calibration vehicle() {
  Calibration calibration;
  calibration.cameras.resize(2);
  calibration.encoder.emplace();
  calibration.lasers.emplace();
  calibration.lasers->beams.resize(3);
  return calibration;
}

using Records = std::array<SourceRecord, kSourceCount>;

/// A sound vehicle that rolls, at 20 frames a second; what a test changes goes wrong.
struct Drive {
  HealthMonitor monitor{vehicle(), true, true};
  HealthMonitor::Frame frame;
  Records records{};
  double t = 0.0;
  double imu_t = 0.0;
  double last_imu_t = 0.0;

  Drive() {
    frame.running = true;
    frame.statistics.tracks = 100;
    frame.statistics.stereo = 90;
    frame.statistics.on_ground = true;
    frame.statistics.wheel_rows_used = 15;
    frame.agreement.matches = 90;
    for (std::size_t i = 0; i < index_of(Source::gyroscope); ++i) records[i].used = 3;
  }

  void hear_imu(double stamp) {
    ImuVerdict verdict;
    verdict.accepted = true;
    verdict.lost = static_cast<int>(std::lround(100.0 * (stamp - last_imu_t))) - 1;
    verdict.gap = stamp - last_imu_t > 0.12;
    monitor.add_imu(at(stamp), verdict);
    last_imu_t = stamp;
  }
  void imu_until(double end) {
    for (; imu_t <= end; imu_t += 0.01) hear_imu(imu_t);
  }
  void go_on(double duration) {
    for (const double end = t + duration; t < end; t += 0.05) {
      imu_until(t);
      monitor.add_encoder(Verdict::accepted, at(t));
      monitor.add_laser({at(t), {0.1 + 1e-3 * t, 0.2 + 1e-3 * t, 0.3 + 1e-3 * t}}, Verdict::accepted,
                        LaserCalibration{}, {}, at(t));
      frame.t_ns = at(t);
      usable = monitor.check_image(frame.agreement, at(t) + stamp_error);
      monitor.add_frame(frame, records);
    }
  }
  bool usable = true;      ///< the last image
  TimeNs stamp_error = 0;  ///< of the images
  void reject(Source source) {
    records[index_of(source)].used = 0;
    records[index_of(source)].rejected = 3;
  }
  [[nodiscard]] const Health& health() const { return monitor.health(); }
};

}  // namespace

TEST_CASE("fault state: it takes a while to be faulty, and longer to be sound again") {
  FaultState state;
  double t = 0.0;
  for (; t < 0.2; t += 0.05) state.add(true, at(t));
  CHECK(state.sound());
  for (; t < 0.4; t += 0.05) state.add(true, at(t));
  CHECK_FALSE(state.sound());
  CHECK(state.onset_ns() == at(0.0));
  const double end = t;
  for (; state.sound() == false; t += 0.05) state.add(false, at(t));
  CHECK(t - end > 0.4);
  CHECK(t - end < 0.7);
}

TEST_CASE("health: a sound vehicle is tracked") {
  Drive drive;
  CHECK(drive.health().status == HealthStatus::initialising);
  CHECK(drive.health().quality == 0);
  drive.frame.horizontal_sigma = 0.04;
  drive.go_on(2.0);
  CHECK(drive.health().status == HealthStatus::tracking);
  CHECK(drive.health().faulty.none());
  CHECK(drive.health().aiding == Aiding::cameras_and_wheels);
  CHECK(drive.health().quality == 100);
  CHECK(drive.health().horizontal_sigma == 0.04);
  CHECK(drive.health().reset_counter == 0);
}

TEST_CASE("health: one source that is rejected degrades within half a second, and only while it lasts") {
  for (std::size_t i = index_of(Source::wheel_left); i <= index_of(Source::accelerometer); ++i) {
    CAPTURE(i);
    const auto source = static_cast<Source>(i);
    Drive drive;
    drive.go_on(1.0);
    const Records sound = drive.records;
    drive.reject(source);
    drive.go_on(0.45);
    CHECK(drive.health().status == HealthStatus::degraded);
    CHECK(drive.health().faulty.count() == 1);
    CHECK(drive.health().faulty[i]);
    CHECK(drive.health().quality <= 60);
    CHECK(drive.health().onset_ns[i] >= at(0.95));
    drive.records = sound;
    drive.go_on(1.0);
    CHECK(drive.health().status == HealthStatus::tracking);
  }
}

TEST_CASE("health: wheels that leave the ground are rightly silent") {
  Drive drive;
  drive.go_on(1.0);
  drive.frame.statistics.on_ground = false;
  drive.frame.statistics.wheel_rows_used = 0;
  for (std::size_t i = index_of(Source::wheel_left); i <= index_of(Source::beam_2); ++i) drive.records[i].used = 0;
  drive.go_on(3.0);
  CHECK(drive.health().status == HealthStatus::tracking);
  CHECK(drive.health().aiding == Aiding::cameras);
}

TEST_CASE(
    "health: on wheels alone it is degraded, on inertia alone lost after two seconds; what comes then is a reset") {
  Drive drive;
  drive.go_on(1.0);
  const HealthMonitor::Frame sound = drive.frame;
  drive.frame.statistics.tracks = drive.frame.statistics.stereo = 0;
  drive.frame.agreement = FrameAgreement{};
  drive.go_on(10.0);
  CHECK(drive.health().status == HealthStatus::degraded);
  CHECK(drive.health().aiding == Aiding::wheels);
  drive.frame.statistics.on_ground = false;
  drive.go_on(1.9);
  CHECK(drive.health().status == HealthStatus::degraded);
  CHECK(drive.health().aiding == Aiding::none);
  drive.go_on(0.3);
  CHECK(drive.health().status == HealthStatus::lost);
  CHECK(drive.health().quality == 0);
  CHECK(drive.health().reset_counter == 0);
  drive.frame = sound;
  drive.go_on(1.0);
  CHECK(drive.health().status == HealthStatus::tracking);
  CHECK(drive.health().reset_counter == 1);
}

TEST_CASE("health: images that stop are noticed without a frame") {
  Drive drive;
  drive.go_on(1.0);
  drive.imu_until(1.5);
  CHECK(drive.health().status == HealthStatus::degraded);
  CHECK(drive.health().faulty[index_of(Source::camera_left)]);
  drive.imu_until(4.0);
  CHECK(drive.health().status == HealthStatus::lost);
}

TEST_CASE("health: exchanged images, a stuck beam, a gap, a clipped value, a jumping clock") {
  const auto degraded_by = [](Drive& drive, Source source) {
    return drive.health().status == HealthStatus::degraded && drive.health().faulty[index_of(source)];
  };
  SUBCASE("exchanged") {
    Drive drive;
    drive.go_on(1.0);
    drive.frame.agreement.behind = 0.9;
    drive.go_on(0.1);
    CHECK(degraded_by(drive, Source::camera_left));
  }
  SUBCASE("stuck") {
    Drive drive;
    drive.go_on(1.0);
    drive.monitor.add_laser({at(1.0), {0.1, 0.2, 0.3}}, Verdict::accepted, LaserCalibration{}, 0b001, at(1.0));
    drive.go_on(0.05);
    CHECK(degraded_by(drive, Source::beam_0));
    CHECK(drive.health().faulty.count() == 1);
  }
  SUBCASE("gap") {
    Drive drive;
    drive.go_on(1.0);
    drive.imu_t += 0.2;
    drive.t += 0.2;
    drive.go_on(0.1);
    CHECK(degraded_by(drive, Source::gyroscope));
  }
  SUBCASE("clipped") {
    Drive drive;
    drive.go_on(1.0);
    drive.monitor.report_imu_fault({false, true}, at(1.0));
    drive.go_on(0.05);
    CHECK(degraded_by(drive, Source::accelerometer));
    CHECK_FALSE(drive.health().faulty[index_of(Source::gyroscope)]);
  }
}

TEST_CASE("health: images that cannot be true are not to be used") {
  Drive drive;
  drive.frame.agreement.matches = 100;
  drive.go_on(2.0);
  CHECK(drive.usable);
  SUBCASE("left and right exchanged") {
    drive.frame.agreement.behind = 0.9;
    drive.go_on(0.05);
    CHECK_FALSE(drive.usable);
  }
  SUBCASE("a late one is, if it fits; one with a wrong stamp is not, until stamps are as before") {
    drive.stamp_error = -200'000'000;
    drive.go_on(0.2);
    CHECK(drive.usable);
    drive.frame.agreement.left = 0.9;
    drive.go_on(0.05);
    CHECK_FALSE(drive.usable);
    drive.frame.agreement.left = 0.0;
    drive.go_on(0.2);
    CHECK_FALSE(drive.usable);
    drive.stamp_error = 0;
    drive.go_on(0.05);
    CHECK(drive.usable);
  }
}

TEST_CASE("health: an image far ahead of the inertial samples is at fault if these go on, not if some were lost") {
  Drive drive;
  drive.go_on(2.0);
  const auto camera_faulty = [&] { return drive.health().faulty[index_of(Source::camera_left)]; };
  const auto imu_faulty = [&] { return drive.health().faulty[index_of(Source::gyroscope)]; };
  SUBCASE("lost, the image used") {
    for (int i = 0; i < 20; ++i) {
      drive.t += 0.02;
      drive.go_on(0.05);  // without samples since the last image
      drive.imu_t += 0.05;
      drive.go_on(0.2);
    }
    CHECK_FALSE(camera_faulty());
    CHECK_FALSE(imu_faulty());
  }
  SUBCASE("lost, the image refused") {
    for (int i = 0; i < 20; ++i) {
      drive.monitor.add_refused_frame(at(drive.last_imu_t));
      drive.imu_t += 0.06;
      drive.t += 0.06;
      drive.go_on(0.2);
    }
    CHECK_FALSE(camera_faulty());
    CHECK_FALSE(imu_faulty());
  }
  SUBCASE("ahead") {
    drive.monitor.add_refused_frame(at(drive.last_imu_t));
    drive.go_on(0.05);
    CHECK(camera_faulty());
    CHECK_FALSE(imu_faulty());
  }
  SUBCASE("no sample comes any more") {
    drive.monitor.add_refused_frame(at(drive.last_imu_t));
    drive.monitor.add_refused_frame(at(drive.last_imu_t));
    CHECK(imu_faulty());
  }
}

TEST_CASE("health: poor images are named, and in flight carry the estimate all the same") {
  Drive drive;
  drive.frame.statistics.on_ground = false;
  drive.frame.statistics.wheel_rows_used = 0;
  drive.go_on(20.0);  // what is usual is known by then
  CHECK(drive.health().status == HealthStatus::tracking);
  const HealthMonitor::Frame sound = drive.frame;
  SUBCASE("a third of the usual features") { drive.frame.statistics.tracks = drive.frame.statistics.stereo = 33; }
  SUBCASE("somebody crosses the view") { drive.frame.agreement.left = drive.frame.agreement.right = 0.3; }
  SUBCASE("twice the usual noise") { drive.frame.agreement.noise = 2.0; }
  SUBCASE("they come late, and fit") { drive.stamp_error = -200'000'000; }
  drive.go_on(0.45);
  CHECK(drive.health().status == HealthStatus::degraded);
  CHECK(drive.health().faulty[index_of(Source::camera_left)]);
  CHECK(drive.health().faulty[index_of(Source::camera_right)]);
  drive.go_on(4.0);
  CHECK(drive.health().status == HealthStatus::degraded);
  CHECK(drive.health().aiding == Aiding::cameras);
  drive.frame = sound;
  drive.stamp_error = 0;
  drive.go_on(0.7);
  CHECK(drive.health().status == HealthStatus::tracking);
}

TEST_CASE("health: as many features are off their place as front ends at five frames a second mistake") {
  Drive drive;
  drive.frame.agreement.matches = 60;
  drive.frame.agreement.left = drive.frame.agreement.right = 0.167;  // of euroc_mh01 at 5 Hz, in a sharp turn
  drive.go_on(4.0);
  CHECK(drive.health().status == HealthStatus::tracking);
}

TEST_CASE("health: the right camera is judged by how many of the features it usually sees") {
  Drive drive;
  drive.frame.statistics.stereo = 39;  // of 100: what is near has no match
  drive.go_on(5.0);
  CHECK(drive.health().status == HealthStatus::tracking);
  drive.frame.statistics.stereo = 12;
  drive.go_on(0.5);
  CHECK(drive.health().faulty[index_of(Source::camera_right)]);
  CHECK_FALSE(drive.health().faulty[index_of(Source::camera_left)]);
}

TEST_CASE("health: a right camera that never sees anything is faulty, whatever is usual") {
  Drive drive;
  drive.frame.statistics.stereo = 3;
  drive.go_on(5.0);
  CHECK(drive.health().faulty[index_of(Source::camera_right)]);
}

TEST_CASE("health: images that contradict the state for a second, and no wheels: lost") {
  Drive drive;
  drive.frame.statistics.on_ground = false;
  drive.go_on(1.0);
  drive.frame.agreement.left = drive.frame.agreement.right = 0.95;
  drive.go_on(0.8);
  CHECK(drive.health().status == HealthStatus::degraded);
  drive.go_on(0.5);
  CHECK(drive.health().status == HealthStatus::lost);
  CHECK(drive.monitor.contradicted());
}

TEST_CASE("health: two standard deviations of more than 0.1 m and 5 % of the path are not tracking") {
  Drive drive;
  drive.frame.speed = 1.0;
  drive.go_on(4.0);
  for (double* const sigma : {&drive.frame.horizontal_sigma, &drive.frame.vertical_sigma}) {
    *sigma = 0.2;
    drive.go_on(0.1);
    CHECK(drive.health().status == HealthStatus::degraded);
    CHECK(drive.health().imprecise);
    CHECK(drive.health().faulty.none());
    *sigma = 0.0;
    drive.go_on(0.1);
    CHECK(drive.health().status == HealthStatus::tracking);
  }
  drive.frame.horizontal_sigma = 0.2;
  drive.go_on(3.0);
  CHECK(drive.health().imprecise);  // 7.2 m
  drive.go_on(1.5);
  CHECK_FALSE(drive.health().imprecise);  // 8.7 m
  CHECK(drive.health().status == HealthStatus::tracking);
}

TEST_CASE("health: what was lost must fit for half a second before it is given again") {
  Drive drive;
  drive.go_on(1.0);
  drive.frame.velocity_sigma = 2.0;
  drive.go_on(0.5);
  REQUIRE(drive.health().status == HealthStatus::lost);
  drive.frame.statistics.tracks = 0;  // nothing carries it
  drive.frame.statistics.wheel_rows_used = 0;
  drive.go_on(0.2);
  drive.frame.velocity_sigma = 0.0;
  drive.frame.statistics.tracks = 100;
  drive.frame.statistics.wheel_rows_used = 15;
  drive.go_on(0.4);
  CHECK(drive.health().status == HealthStatus::lost);
  drive.go_on(0.3);
  CHECK(drive.monitor.usable());
  CHECK(drive.health().reset_counter == 1);
}

TEST_CASE("health: one camera whose features the gate refuses contradicts the state") {
  Calibration calibration = vehicle();
  calibration.cameras.resize(1);
  Drive drive;
  drive.monitor = HealthMonitor(calibration, false, false);
  drive.frame.statistics.stereo = 0;
  drive.frame.statistics.on_ground = false;
  drive.frame.statistics.wheel_rows_used = 0;
  drive.frame.agreement = {};
  drive.frame.statistics.features_used = 5;
  drive.frame.statistics.features_rejected = 2;
  drive.go_on(2.0);
  REQUIRE(drive.health().status == HealthStatus::tracking);
  drive.frame.statistics.features_used = 1;
  drive.frame.statistics.features_rejected = 6;
  SUBCASE("for good") {
    drive.go_on(1.5);
    CHECK(drive.health().faulty[index_of(Source::camera_left)]);
    drive.go_on(1.5);
    CHECK(drive.health().status == HealthStatus::lost);
  }
  SUBCASE("until the vehicle stands, and the images show that") {
    drive.go_on(0.8);
    drive.frame.statistics.features_used = drive.frame.statistics.features_rejected = 0;
    drive.frame.statistics.standing = true;
    for (int i = 0; i < 40; ++i) {
      drive.go_on(0.05);
      CHECK(drive.health().status != HealthStatus::lost);
    }
    CHECK(drive.health().status == HealthStatus::tracking);
  }
}

TEST_CASE("health: what is not a number, or a velocity that may be anything, is lost") {
  Drive drive;
  drive.go_on(1.0);
  drive.frame.possible = false;
  drive.go_on(0.05);
  CHECK(drive.health().status == HealthStatus::lost);
  drive.frame.possible = true;
  drive.go_on(0.1);
  CHECK(drive.health().status == HealthStatus::tracking);
  drive.frame.velocity_sigma = 1.5;
  drive.go_on(0.05);
  CHECK(drive.health().status == HealthStatus::lost);
  drive.frame.speed = 20.0;  // the same of a fast one: its direction is known to 0.075 rad
  drive.go_on(0.1);
  CHECK(drive.health().status == HealthStatus::tracking);
  drive.frame.velocity_sigma = std::numeric_limits<double>::infinity();
  drive.go_on(0.05);
  CHECK(drive.health().status == HealthStatus::lost);
  CHECK(drive.monitor.possible());
  drive.frame.speed = 120.0;  // no vehicle is so fast: it is not to be waited for
  drive.go_on(0.05);
  CHECK_FALSE(drive.monitor.possible());
}

TEST_CASE("health: a step between two images is no image without features") {
  Drive drive;
  drive.go_on(1.0);
  const auto step = [&] {
    HealthMonitor::Frame frame = drive.frame;
    frame.image = false;
    frame.t_ns = at(drive.t - 0.02);
    frame.statistics.tracks = frame.statistics.stereo = 0;
    frame.agreement = FrameAgreement{};
    drive.monitor.add_frame(frame, drive.records);
  };
  step();
  CHECK(drive.health().aiding == Aiding::cameras_and_wheels);
  CHECK(drive.health().quality == 100);
  // Nor is it one that fits.
  drive.frame.agreement.left = 0.9;
  drive.frame.statistics.wheel_rows_used = 0;
  for (int i = 0; i < 30; ++i) {
    drive.go_on(0.05);
    step();
  }
  CHECK(drive.monitor.contradicted());
}

TEST_CASE("health: cameras that never delivered are faulty once the wheels carry the vehicle") {
  Drive drive;
  drive.frame.image = false;
  drive.frame.statistics.tracks = drive.frame.statistics.stereo = 0;
  drive.frame.agreement = FrameAgreement{};
  drive.go_on(1.0);
  CHECK(drive.health().status == HealthStatus::degraded);
  CHECK(drive.health().aiding == Aiding::wheels);
  CHECK(drive.health().faulty[index_of(Source::camera_left)]);
  CHECK(drive.health().faulty[index_of(Source::camera_right)]);
  CHECK(drive.health().faulty.count() == 2);
}

TEST_CASE("health: without cameras too, the estimate is lost when nothing but inertial samples comes") {
  Calibration calibration = vehicle();
  calibration.cameras.clear();
  Drive drive;
  drive.monitor = HealthMonitor(calibration, true, true);
  drive.frame.image = false;
  drive.frame.statistics.tracks = drive.frame.statistics.stereo = 0;
  drive.frame.agreement = FrameAgreement{};
  drive.go_on(2.0);
  CHECK(drive.health().status == HealthStatus::tracking);
  CHECK(drive.health().aiding == Aiding::wheels);
  drive.imu_until(drive.t + 1.5);
  CHECK(drive.health().status != HealthStatus::lost);
  drive.imu_until(drive.t + 3.0);
  CHECK(drive.health().status == HealthStatus::lost);
  CHECK(drive.monitor.possible());  // they fitted, before they fell silent
}

TEST_CASE("health: without cameras a lost state is none where the wheels do not fit") {
  for (const std::size_t cameras : {0U, 2U}) {
    Calibration calibration = vehicle();
    calibration.cameras.resize(cameras);
    Drive drive;
    drive.monitor = HealthMonitor(calibration, true, true);
    drive.frame.image = false;
    drive.go_on(2.0);
    drive.frame.statistics.wheel_rows_used = 6;
    drive.frame.statistics.wheel_rows_rejected = 9;
    drive.reject(Source::wheel_left);
    drive.reject(Source::wheel_right);
    drive.go_on(1.8);
    CHECK(drive.monitor.possible());
    drive.go_on(0.4);
    CHECK(drive.health().status == HealthStatus::lost);
    CHECK(drive.monitor.possible() == (cameras != 0));
  }
}

TEST_CASE("health: wheels that fit again after a slip keep the estimate, before they are known to be sound") {
  Drive drive;
  drive.frame.image = false;
  drive.go_on(2.0);
  const FrameStatistics fitting = drive.frame.statistics;
  const Records sound = drive.records;
  const auto slip = [&] {
    drive.frame.statistics.wheel_rows_used = 6;
    drive.frame.statistics.wheel_rows_rejected = 9;
    drive.reject(Source::wheel_left);
    drive.reject(Source::wheel_right);
  };
  slip();
  drive.go_on(1.8);
  CHECK(drive.health().aiding == Aiding::none);
  CHECK(drive.health().status == HealthStatus::degraded);
  drive.frame.statistics = fitting;
  drive.records = sound;
  for (int i = 0; i < 8; ++i) {
    drive.go_on(0.05);
    CHECK(drive.health().status == HealthStatus::degraded);
    CHECK(drive.health().faulty[index_of(Source::wheel_left)]);
  }
  slip();
  drive.go_on(2.2);
  CHECK(drive.health().status == HealthStatus::lost);
}

TEST_CASE("health: wheels that are slower than the frames carry the estimate until they are silent") {
  HealthMonitor monitor{[] {
                          Calibration calibration;
                          calibration.encoder.emplace();
                          return calibration;
                        }(),
                        true, false};
  HealthMonitor::Frame frame;
  frame.image = false;
  frame.running = true;
  frame.statistics.on_ground = true;
  Records records{};
  const auto step = [&](double t, bool reading) {
    monitor.add_imu(at(t), {});
    if (reading) monitor.add_encoder(Verdict::accepted, at(t));
    frame.t_ns = at(t);
    frame.statistics.wheel_rows_used = reading ? 5 : 0;
    for (const Source wheel : {Source::wheel_left, Source::wheel_right})
      records[index_of(wheel)].used = reading ? 1 : 0;
    monitor.add_frame(frame, records);
  };
  double t = 0.0;
  for (int k = 0; k < 100; ++k, t += 0.04) {  // 25 frames and 8 readings a second
    step(t, k % 3 == 0);
    CAPTURE(k);
    CHECK(monitor.health().aiding == Aiding::wheels);
  }
  for (int k = 0; k < 10; ++k, t += 0.04) step(t, false);
  CHECK(monitor.health().aiding == Aiding::none);
}

TEST_CASE("health: a sensor that never spoke is silent, whatever the stamps") {
  for (const double start : {-1000.0, -100.0, 0.0}) {
    CAPTURE(start);
    Calibration calibration = vehicle();
    calibration.cameras.clear();
    HealthMonitor monitor(calibration, true, true);
    HealthMonitor::Frame frame;
    frame.image = false;
    frame.running = true;
    frame.statistics.on_ground = true;
    for (double t = start; t < start + 1.0; t += 0.05) {
      monitor.add_imu(at(t), {});
      frame.t_ns = at(t);
      monitor.add_frame(frame, Records{});
    }
    for (const Source source : {Source::wheel_left, Source::wheel_right, Source::beam_0, Source::beam_2}) {
      CHECK(monitor.health().faulty[index_of(source)]);
    }
  }
}
