// Queues whose samples have false stamps: these delay no others.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "src/queued_odometry.h"
#include "tools/simulator/film.h"

namespace ear {
namespace {

constexpr TimeNs kPeriod = 5'000'000;
constexpr TimeNs kSecond = 1'000'000'000;

/// Wheels and IMU, no camera.
Calibration without_cameras() {
  Calibration calibration;
  calibration.encoder.emplace();
  return calibration;
}

/// Standing samples at 200 Hz from `from_ns` on, with a step after every tenth.
void stand(QueuedOdometry& odometry, TimeNs from_ns, TimeNs to_ns) {
  ImuSample sample;
  sample.accel_B = {0.0, 0.0, 9.81};
  for (sample.t_ns = from_ns; sample.t_ns < to_ns; sample.t_ns += kPeriod) {
    REQUIRE(odometry.add_imu(sample));
    REQUIRE(odometry.add_encoder({sample.t_ns, 0, 0}));
    if (sample.t_ns / kPeriod % 10 == 9) static_cast<void>(odometry.step(sample.t_ns));
  }
}

TEST_CASE("queues: one inertial stamp far ahead holds nothing back") {
  for (const TimeNs ahead : {kSecond / 2, 10 * kSecond, 3600 * kSecond}) {
    CAPTURE(ahead);
    QueuedOdometry odometry(Config{}, without_cameras(), QueueCapacity{});
    stand(odometry, 0, 3 * kSecond);
    ImuSample sample;
    sample.accel_B = {0.0, 0.0, 9.81};
    sample.t_ns = 3 * kSecond + ahead;
    REQUIRE(odometry.add_imu(sample));
    stand(odometry, 3 * kSecond, 6 * kSecond);
    const InputCounts counts = odometry.odometry().input_counts();
    CHECK(counts.imu.accepted == 1200);
    CHECK(counts.imu.far_ahead == 1);
    CHECK(counts.encoder.accepted >= 1190);
  }
}

TEST_CASE("queues: they go on when the clock of all sensors is set back") {
  QueuedOdometry odometry(Config{}, without_cameras(), QueueCapacity{});
  stand(odometry, 100 * kSecond, 103 * kSecond);
  stand(odometry, 50 * kSecond, 53 * kSecond);
  const std::uint64_t accepted = odometry.odometry().input_counts().imu.accepted;
  CHECK(accepted >= 600 + 380);  // all but the second that shows it
  CHECK(accepted < 600 + 410);
}

TEST_CASE("queues: one inertial stamp far ahead costs no frame, and the state at the IMU's rate goes on") {
  simulator::Options options;
  options.seed = 11;
  options.duration = 4.0;
  options.camera_rate_hz = 6.0;
  const simulator::Film drive(options);
  const simulator::Simulation& simulation = drive.simulation;
  QueuedOdometry odometry(Config{}, simulation.calibration(), QueueCapacity{});
  int estimates = 0;
  int live = 0;
  bool was_false = false;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    if (delivery.stream == simulator::SensorStream::imu) {
      ImuSample sample = simulation.imu()[delivery.index];
      if (!was_false && estimates == 8) {
        sample.t_ns += 3600 * kSecond;
        was_false = true;
      }
      REQUIRE(odometry.add_imu(sample));
      if (was_false && odometry.live()) ++live;
    } else if (delivery.stream == simulator::SensorStream::camera) {
      REQUIRE(odometry.add_stereo(drive.frame(delivery.index)));
    } else {
      continue;
    }
    std::optional<Estimate> estimate;
    if (odometry.process(estimate) == Progress::estimated) ++estimates;
  }
  CHECK(was_false);
  CHECK(odometry.odometry().input_counts().camera.far_ahead == 0);
  CHECK(estimates >= 16);
  CHECK(live > 200);
}

/// Wheels and lasers without cameras, whose stamps are off by this [s], as the calibration says; a step every 50 ms.
std::vector<Estimate> drive_by_clocks(const simulator::Simulation& simulation, double encoder_late, double laser_late) {
  Calibration calibration = simulation.calibration();
  calibration.cameras.clear();
  calibration.encoder->time_offset = -encoder_late;
  calibration.lasers->time_offset = -laser_late;
  QueuedOdometry odometry(Config{}, calibration, QueueCapacity{});
  std::vector<Estimate> estimates;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    if (delivery.stream == simulator::SensorStream::encoder) {
      EncoderSample sample = simulation.encoders()[delivery.index];
      sample.t_ns = later_by(encoder_late, sample.t_ns);
      REQUIRE(odometry.add_encoder(sample));
    } else if (delivery.stream == simulator::SensorStream::laser) {
      const LaserSample& sample = simulation.lasers()[delivery.index];
      QueuedOdometry::Ranges ranges{later_by(laser_late, sample.t_ns), {}};
      std::copy(sample.range.begin(), sample.range.end(), ranges.range.begin());
      REQUIRE(odometry.add_laser(ranges));
    } else if (delivery.stream == simulator::SensorStream::imu) {
      const ImuSample& sample = simulation.imu()[delivery.index];
      REQUIRE(odometry.add_imu(sample));
      if (delivery.index % 10 != 9) continue;
      if (const auto estimate = odometry.step(sample.t_ns - 20'000'000)) estimates.push_back(*estimate);
    }
  }
  return estimates;
}

TEST_CASE("queues: readings of other clocks are handed over where they belong") {
  simulator::Options options;
  options.seed = 11;
  options.duration = 8.0;
  const simulator::Simulation simulation(options);
  const std::vector<Estimate> plain = drive_by_clocks(simulation, 0.0, 0.0);
  REQUIRE(plain.size() > 50);
  CHECK(plain.back().state.v_W.norm() > 0.1);
  for (const auto& late : {std::pair(0.05, -0.03), std::pair(-0.05, 0.3), std::pair(1800.0, 0.0)}) {  // encoder, lasers
    CAPTURE(late.first);
    const std::vector<Estimate> shifted = drive_by_clocks(simulation, late.first, late.second);
    REQUIRE(shifted.size() == plain.size());
    for (std::size_t i = 0; i < plain.size(); ++i) {
      CHECK(shifted[i].state.p_WB == plain[i].state.p_WB);
      CHECK(shifted[i].covariance == plain[i].covariance);
    }
  }
}

TEST_CASE("queues: handing over the samples leaves a frame that came meanwhile") {
  simulator::Options options;
  options.seed = 12;
  options.duration = 1.0;
  options.camera_rate_hz = 6.0;
  const simulator::Film drive(options);
  QueuedOdometry odometry(Config{}, drive.simulation.calibration(), QueueCapacity{});
  for (const ImuSample& sample : drive.simulation.imu()) REQUIRE(odometry.add_imu(sample));
  const StereoFrame frame = drive.frame(0);
  REQUIRE(odometry.add_stereo(frame));
  odometry.hand_over_samples();
  CHECK(odometry.odometry().input_counts().imu.accepted == drive.simulation.imu().size());
  CHECK(odometry.odometry().input_counts().camera.accepted == 0);
  REQUIRE(odometry.next_frame_ns());
  std::optional<Estimate> estimate;
  CHECK(odometry.process(estimate) != Progress::no_frame);
  CHECK(odometry.odometry().input_counts().camera.accepted == 1);
  CHECK_FALSE(odometry.next_frame_ns());
}

TEST_CASE("queues: a frame that was taken is handed on with its pixels, and later ones are as they came") {
  simulator::Options options;
  options.seed = 12;
  options.duration = 2.0;
  options.camera_rate_hz = 6.0;
  const simulator::Film drive(options);
  const Calibration& calibration = drive.simulation.calibration();
  QueuedOdometry odometry(Config{}, calibration, {2.0, 1});  // one slot, which is used again
  QueuedFrame kept = empty_frame(calibration.cameras);
  const auto same = [](const ImageView& a, const ImageView& b) {
    bool equal = a.width == b.width && a.height == b.height;
    for (int row = 0; equal && row < a.height; ++row) {
      equal = std::equal(a.data + row * a.stride, a.data + row * a.stride + a.width, b.data + row * b.stride);
    }
    return equal;
  };
  int frames = 0;
  for (const simulator::Delivery& delivery : drive.simulation.deliveries()) {
    if (delivery.stream == simulator::SensorStream::imu)
      REQUIRE(odometry.add_imu(drive.simulation.imu()[delivery.index]));
    if (delivery.stream != simulator::SensorStream::camera) continue;
    const StereoFrame came = drive.frame(delivery.index);
    REQUIRE(odometry.add_stereo(came));
    std::optional<Estimate> estimate;
    REQUIRE(odometry.process(estimate, ++frames % 3 == 0 ? nullptr : &kept) != Progress::no_frame);
    if (frames % 3 == 0) continue;
    const StereoFrame view = view_of(kept, calibration.cameras);
    REQUIRE(view.t_ns == came.t_ns);
    REQUIRE(same(view.left, came.left));
    REQUIRE(same(view.right, came.right));
  }
  CHECK(frames > 8);
}

}  // namespace
}  // namespace ear
