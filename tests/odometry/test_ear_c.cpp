// The C interface against class Odometry: the same samples give the same estimates, through threads and errors too.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "ear/ear_c.h"
#include "ear/odometry.h"
#include "tools/simulator/film.h"
#include "tools/simulator/simulation.h"

namespace ear {
namespace {

using simulator::SensorStream;
using simulator::Simulation;

struct Destroy {
  void operator()(ear_odometry* odometry) const { ear_destroy(odometry); }
};
using Handle = std::unique_ptr<ear_odometry, Destroy>;

void to_rows(const Eigen::Isometry3d& T, double* rows) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{rows} = T.matrix();
}

ear_calibration to_c(const Calibration& from) {
  ear_calibration to;
  ear_default_calibration(&to);
  to.camera_count = static_cast<std::int32_t>(from.cameras.size());
  for (std::size_t i = 0; i < from.cameras.size(); ++i) {
    const CameraCalibration& camera = from.cameras[i];
    to_rows(camera.T_BC, to.cameras[i].T_BC);
    to.cameras[i].width = camera.width;
    to.cameras[i].height = camera.height;
    to.cameras[i].fu = camera.fu;
    to.cameras[i].fv = camera.fv;
    to.cameras[i].cu = camera.cu;
    to.cameras[i].cv = camera.cv;
    to.cameras[i].lens = camera.lens == LensModel::equidistant ? EAR_LENS_EQUIDISTANT : EAR_LENS_RADIAL_TANGENTIAL;
    std::copy(camera.distortion.begin(), camera.distortion.end(), to.cameras[i].distortion);
    to.cameras[i].rate_hz = camera.rate_hz;
  }
  to.camera_time_offset = from.camera_time_offset;
  to.imu_rate_hz = from.imu.rate_hz;
  to.gyro_noise = from.imu.gyro_noise;
  to.gyro_random_walk = from.imu.gyro_random_walk;
  to.accel_noise = from.imu.accel_noise;
  to.accel_random_walk = from.imu.accel_random_walk;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{to.gyro_matrix} = from.imu.gyro_matrix;
  if (from.encoder) {
    to.has_encoder = 1;
    to_rows(from.encoder->T_BO, to.T_BO);
    to.encoder_rate_hz = from.encoder->rate_hz;
    to.counts_per_turn = from.encoder->resolution;
    to.counts_wrap = from.encoder->wraps ? 1 : 0;
    to.wheel_radius[0] = from.encoder->wheel_radius[0];
    to.wheel_radius[1] = from.encoder->wheel_radius[1];
    to.track_width = from.encoder->track_width;
    to.encoder_noise_counts = from.encoder->noise_counts;
    to.encoder_time_offset = from.encoder->time_offset;
  }
  if (from.lasers) {
    to.beam_count = static_cast<std::int32_t>(from.lasers->beams.size());
    for (std::size_t i = 0; i < from.lasers->beams.size(); ++i) {
      Eigen::Vector3d::Map(to.beams[i].p_BL) = from.lasers->beams[i].p_BL;
      Eigen::Vector3d::Map(to.beams[i].d_B) = from.lasers->beams[i].d_B;
    }
    to.laser_rate_hz = from.lasers->rate_hz;
    to.range_min = from.lasers->range_min;
    to.range_max = from.lasers->range_max;
    to.laser_noise = from.lasers->noise;
    to.laser_time_offset = from.lasers->time_offset;
  }
  return to;
}

/// A short drive with its pictures, rendered once.
struct Drive : simulator::Film {
  Drive() : Film(options()) {}

  static simulator::Options options() {
    simulator::Options options;
    options.seed = 11;
    options.duration = 3.5;
    options.camera_rate_hz = 6.0;
    options.k3 = -0.03;
    return options;
  }

  /// With a gyroscope's matrix, so that each of its entries counts.
  [[nodiscard]] Calibration calibration() const {
    Calibration given = simulation.calibration();
    given.imu.gyro_matrix += 1e-3 * Eigen::Vector3d(1.0, -2.0, 0.5) * Eigen::RowVector3d(0.4, 1.0, -0.7);
    return given;
  }
  [[nodiscard]] ear_stereo_frame c_frame(std::size_t i) const {
    return {simulation.frame_times()[i], pictures[i][0].data, pictures[i][1].data,
            static_cast<std::ptrdiff_t>(pictures[i][0].step)};
  }
  [[nodiscard]] ear_imu_sample imu(std::size_t i) const {
    const ImuSample& from = simulation.imu()[i];
    ear_imu_sample to{};
    to.t_ns = from.t_ns;
    Eigen::Vector3d::Map(to.gyro_B) = from.gyro_B;
    Eigen::Vector3d::Map(to.accel_B) = from.accel_B;
    return to;
  }
  [[nodiscard]] ear_encoder_sample encoder(std::size_t i) const {
    const EncoderSample& from = simulation.encoders()[i];
    return {from.t_ns, from.left_count, from.right_count};
  }
  [[nodiscard]] ear_laser_sample laser(std::size_t i) const {
    const LaserSample& from = simulation.lasers()[i];
    ear_laser_sample to{};
    to.t_ns = from.t_ns;
    std::copy(from.range.begin(), from.range.end(), to.range);
    return to;
  }

  ear_result add(ear_odometry* odometry, const simulator::Delivery& delivery) const {
    switch (delivery.stream) {
      case SensorStream::imu: {
        const ear_imu_sample sample = imu(delivery.index);
        return ear_add_imu(odometry, &sample);
      }
      case SensorStream::encoder: {
        const ear_encoder_sample sample = encoder(delivery.index);
        return ear_add_encoder(odometry, &sample);
      }
      case SensorStream::laser: {
        const ear_laser_sample sample = laser(delivery.index);
        return ear_add_laser(odometry, &sample);
      }
      case SensorStream::camera:
        break;
    }
    const ear_stereo_frame sample = c_frame(delivery.index);
    return ear_add_stereo(odometry, &sample);
  }

  /// What class Odometry makes of the same, sample by sample as they arrive.
  [[nodiscard]] std::vector<Estimate> direct() const {
    std::vector<Estimate> result;
    Odometry odometry(Config{}, calibration());
    for (const simulator::Delivery& delivery : simulation.deliveries()) {
      if (delivery.stream == SensorStream::imu) odometry.add_imu(simulation.imu()[delivery.index]);
      if (delivery.stream == SensorStream::encoder) odometry.add_encoder(simulation.encoders()[delivery.index]);
      if (delivery.stream == SensorStream::laser) odometry.add_laser(simulation.lasers()[delivery.index]);
      if (delivery.stream != SensorStream::camera) continue;
      if (const auto estimate = odometry.add_stereo(frame(delivery.index))) result.push_back(*estimate);
    }
    return result;
  }
};

const Drive& drive() {
  static const Drive kDrive;
  return kDrive;
}

Handle make(const ear_settings* settings = nullptr) {
  const ear_calibration calibration = to_c(drive().calibration());
  std::array<char, 200> message{};
  ear_odometry* odometry = nullptr;
  const ear_result result = ear_create(&calibration, settings, &odometry, message.data(), message.size());
  CAPTURE(message.data());
  REQUIRE(result == EAR_OK);
  return Handle(odometry);
}

void take_all(ear_odometry* odometry, std::vector<ear_estimate>& estimates) {
  ear_estimate estimate{};
  for (ear_result result = ear_process(odometry, &estimate); result != EAR_NOTHING;
       result = ear_process(odometry, &estimate)) {
    REQUIRE(result >= 0);
    if (result == EAR_OK) estimates.push_back(estimate);
  }
}

/// All samples as they arrive, the consumer after each `interval` of them.
std::vector<ear_estimate> run(ear_odometry* odometry, std::size_t interval) {
  std::vector<ear_estimate> estimates;
  std::size_t count = 0;
  for (const simulator::Delivery& delivery : drive().simulation.deliveries()) {
    REQUIRE(drive().add(odometry, delivery) == EAR_OK);
    if (++count % interval == 0) take_all(odometry, estimates);
  }
  take_all(odometry, estimates);
  return estimates;
}

Eigen::Vector3d position(const ear_estimate& estimate) { return Eigen::Vector3d::Map(estimate.state.p_WB); }

TEST_CASE("C interface: estimates are those of class Odometry, bit for bit") {
  const std::vector<Estimate> expected = drive().direct();
  const Handle odometry = make();
  const std::vector<ear_estimate> estimates = run(odometry.get(), 1);
  REQUIRE(estimates.size() == expected.size());
  REQUIRE(estimates.size() > 10);
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    CAPTURE(i);
    const NavState& state = expected[i].state;
    CHECK(estimates[i].state.t_ns == state.t_ns);
    CHECK(position(estimates[i]) == state.p_WB);
    CHECK(Eigen::Vector3d::Map(estimates[i].state.v_W) == state.v_W);
    CHECK(Eigen::Vector3d::Map(estimates[i].state.b_g) == state.b_g);
    CHECK(Eigen::Vector3d::Map(estimates[i].state.b_a) == state.b_a);
    CHECK(Eigen::Vector4d::Map(estimates[i].state.q_WB) ==
          Eigen::Vector4d(state.q_WB.w(), state.q_WB.x(), state.q_WB.y(), state.q_WB.z()));
    CHECK(estimates[i].covariance[6][7] == expected[i].covariance(6, 7));
    CHECK(estimates[i].covariance[0][8] == expected[i].covariance(0, 8));
    CHECK(estimates[i].slope_along == expected[i].terrain.slope_along);
    CHECK(estimates[i].tracks == expected[i].frame.tracks);
    CHECK(estimates[i].on_ground == (expected[i].frame.on_ground ? 1 : 0));
  }
  CHECK(position(estimates.back()).norm() > 0.3);  // it did drive

  const TimeNs later = estimates.back().state.t_ns;
  ear_state state{};
  REQUIRE(ear_predict(odometry.get(), later, &state) == EAR_OK);
  CHECK((Eigen::Vector3d::Map(state.p_WB) - position(estimates.back())).norm() < 1e-9);

  ear_health health{};
  REQUIRE(ear_health_of(odometry.get(), &health) == EAR_OK);
  CHECK(health.status == EAR_HEALTH_TRACKING);
  CHECK(health.aiding == EAR_AIDING_CAMERAS_AND_WHEELS);
  CHECK(health.faulty == 0);
  CHECK(health.quality == expected.back().health.quality);
  CHECK(health.horizontal_sigma == expected.back().health.horizontal_sigma);
  CHECK(health.vertical_sigma == expected.back().health.vertical_sigma);
  for (std::size_t i = 0; i < kSourceCount; ++i) CHECK(health.score[i] == expected.back().health.sources[i].score);
}

TEST_CASE("C interface: before the start the health says so, and after a gap which sensor it does without") {
  const Handle odometry = make();
  ear_health health{};
  REQUIRE(ear_health_of(odometry.get(), &health) == EAR_OK);
  CHECK(health.status == EAR_HEALTH_INITIALISING);
  CHECK(health.quality == 0);
  run(odometry.get(), 1);
  ear_imu_sample sample = drive().imu(drive().simulation.imu().size() - 1);
  for (int i = 0; i < 40; ++i) {  // no images come, the inertial samples go on
    sample.t_ns += 5'000'000;
    REQUIRE(ear_add_imu(odometry.get(), &sample) == EAR_OK);
  }
  sample.t_ns += 5'000'000;
  sample.gyro_B[0] = std::numeric_limits<double>::quiet_NaN();
  REQUIRE(ear_add_imu(odometry.get(), &sample) == EAR_OK);
  sample.t_ns += 5'000'000;
  sample.gyro_B[0] = 0.0;
  REQUIRE(ear_add_imu(odometry.get(), &sample) == EAR_OK);
  ear_estimate estimate{};
  static_cast<void>(ear_step(odometry.get(), sample.t_ns, &estimate));
  REQUIRE(ear_health_of(odometry.get(), &health) == EAR_OK);
  CHECK(health.status == EAR_HEALTH_DEGRADED);
  CHECK((health.faulty >> EAR_SOURCE_GYROSCOPE & 1U) == 1);
  CHECK(health.onset_ns[EAR_SOURCE_GYROSCOPE] > 0);
  CHECK(std::string(ear_source_text(EAR_SOURCE_GYROSCOPE)) == "gyroscope");
  CHECK(std::string(ear_source_text(EAR_SOURCE_COUNT)) == "unknown source");
}

TEST_CASE("C interface: a consumer that is behind, and one after a reset, miss nothing") {
  const std::vector<Estimate> expected = drive().direct();
  const Handle odometry = make();
  for (const std::size_t interval : {1U, 200U}) {  // 200 samples: half a second, three frames
    const std::vector<ear_estimate> estimates = run(odometry.get(), interval);
    REQUIRE(estimates.size() == expected.size());
    CHECK((position(estimates.back()) - expected.back().state.p_WB).norm() < 1e-3);
    REQUIRE(ear_reset(odometry.get()) == EAR_OK);
    CHECK(ear_status_of(odometry.get()) == EAR_WAITING_FOR_IMU);
  }
}

TEST_CASE("C interface: a thread for each sensor, one for the estimates") {
  const Drive& d = drive();
  const Simulation& simulation = d.simulation;
  ear_settings settings;
  ear_default_settings(&settings);
  settings.queue_seconds = 0.3;  // so that the sensors' threads meet full queues
  settings.frame_slots = 2;
  const Handle odometry = make(&settings);
  std::atomic<TimeNs> now{simulation.imu().front().t_ns};  // no sensor gives samples of the future
  std::atomic<TimeNs> imu_given{now.load()};               // the clock waits for the IMU, however busy the machine is

  const auto sensor = [&](std::size_t count, const std::function<TimeNs(std::size_t)>& arrival,
                          const std::function<ear_result(std::size_t)>& add) {
    return std::thread([=, &now] {
      for (std::size_t i = 0; i < count; ++i) {
        while (now < arrival(i)) std::this_thread::yield();
        while (add(i) == EAR_QUEUE_FULL) std::this_thread::yield();
      }
    });
  };
  std::atomic<int> running{4};
  std::vector<std::thread> sensors;
  sensors.push_back(sensor(
      simulation.imu().size(), [&](std::size_t i) { return simulation.imu()[i].t_ns; },
      [&](std::size_t i) {
        const ear_imu_sample sample = d.imu(i);
        const ear_result result = ear_add_imu(odometry.get(), &sample);
        if (result != EAR_QUEUE_FULL) imu_given = sample.t_ns;
        return result;
      }));
  sensors.push_back(sensor(
      simulation.encoders().size(), [&](std::size_t i) { return simulation.encoders()[i].t_ns; },
      [&](std::size_t i) {
        const ear_encoder_sample sample = d.encoder(i);
        return ear_add_encoder(odometry.get(), &sample);
      }));
  sensors.push_back(sensor(
      simulation.lasers().size(), [&](std::size_t i) { return simulation.lasers()[i].t_ns; },
      [&](std::size_t i) {
        const ear_laser_sample sample = d.laser(i);
        return ear_add_laser(odometry.get(), &sample);
      }));
  sensors.push_back(sensor(
      simulation.frames().size(), [&](std::size_t i) { return simulation.frame_times()[i]; },
      [&](std::size_t i) {
        const ear_stereo_frame frame = d.c_frame(i);
        return ear_add_stereo(odometry.get(), &frame);
      }));
  std::thread clock([&] {
    for (; now < simulation.imu().back().t_ns + 1'000'000'000; now += 10'000'000) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      while (imu_given < std::min(now.load(), simulation.imu().back().t_ns) - 10'000'000) std::this_thread::yield();
    }
    for (std::thread& thread : sensors) {
      thread.join();
      --running;
    }
  });
  std::vector<ear_estimate> estimates;
  while (running > 0) {
    take_all(odometry.get(), estimates);
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
  clock.join();
  take_all(odometry.get(), estimates);

  const std::vector<Estimate> expected = d.direct();
  REQUIRE(estimates.size() == expected.size());
  CHECK((position(estimates.back()) - expected.back().state.p_WB).norm() < 5e-3);
}

TEST_CASE("C interface: without a camera, steps") {
  const Drive& d = drive();
  ear_calibration calibration = to_c(d.simulation.calibration());
  calibration.camera_count = 0;
  ear_odometry* raw = nullptr;
  REQUIRE(ear_create(&calibration, nullptr, &raw, nullptr, 0) == EAR_OK);
  const Handle odometry(raw);
  const ear_stereo_frame frame = d.c_frame(0);
  CHECK(ear_add_stereo(raw, &frame) == EAR_INVALID_ARGUMENT);
  ear_estimate estimate{};
  ear_result result = EAR_NO_ESTIMATE;
  for (const simulator::Delivery& delivery : d.simulation.deliveries()) {
    if (delivery.stream == SensorStream::camera) {
      result = ear_step(raw, d.simulation.frame_times()[delivery.index], &estimate);
    } else {
      d.add(raw, delivery);
    }
  }
  REQUIRE(result == EAR_OK);
  const Eigen::Vector3d expected = d.direct().back().state.p_WB;
  CHECK((position(estimate) - expected).norm() < 0.05);
}

TEST_CASE("C interface: a full queue refuses and counts; other queues go on") {
  ear_settings settings;
  ear_default_settings(&settings);
  settings.queue_seconds = 0.1;
  settings.frame_slots = 1;
  const Handle odometry = make(&settings);
  std::uint64_t refused = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    const ear_imu_sample sample = drive().imu(i);
    if (ear_add_imu(odometry.get(), &sample) == EAR_QUEUE_FULL) ++refused;
  }
  const ear_stereo_frame first = drive().c_frame(0);
  CHECK(ear_add_stereo(odometry.get(), &first) == EAR_OK);
  CHECK(ear_add_stereo(odometry.get(), &first) == EAR_QUEUE_FULL);
  ear_counts counts{};
  REQUIRE(ear_counts_of(odometry.get(), &counts) == EAR_OK);
  CHECK(counts.imu_overflow == refused);
  CHECK(refused > 0);
  CHECK(counts.frame_overflow == 1);
  CHECK(counts.laser_overflow == 0);
}

TEST_CASE("C interface: a frame stamped at the end of time is refused, wherever the cameras' clock stands") {
  for (const double offset : {-0.01, 0.01}) {
    ear_calibration calibration = to_c(drive().simulation.calibration());
    calibration.camera_time_offset = offset;
    ear_settings settings;
    ear_default_settings(&settings);
    settings.frame_slots = 1;  // it must not wait for inertial samples of that time
    ear_odometry* created = nullptr;
    REQUIRE(ear_create(&calibration, &settings, &created, nullptr, 0) == EAR_OK);
    const Handle odometry(created);
    ear_stereo_frame frame = drive().c_frame(0);
    ear_estimate estimate{};
    for (const std::int64_t t_ns :
         {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
      frame.t_ns = t_ns;
      REQUIRE(ear_add_stereo(odometry.get(), &frame) == EAR_OK);
      CHECK(ear_process(odometry.get(), &estimate) == EAR_NO_ESTIMATE);
    }
    ear_counts counts{};
    REQUIRE(ear_counts_of(odometry.get(), &counts) == EAR_OK);
    CHECK(counts.frames_rejected == 2);
  }
}

TEST_CASE("C interface: what cannot be used is refused with its reason") {
  const ear_calibration good = to_c(drive().simulation.calibration());
  std::array<char, 200> message{};
  const auto reason_of = [&](const std::function<void(ear_calibration&, ear_settings&)>& spoil) {
    ear_calibration calibration = good;
    ear_settings settings;
    ear_default_settings(&settings);
    spoil(calibration, settings);
    ear_odometry* odometry = nullptr;
    CHECK(ear_create(&calibration, &settings, &odometry, message.data(), message.size()) == EAR_INVALID_ARGUMENT);
    CHECK(odometry == nullptr);
    return std::string(message.data());
  };
  using C = ear_calibration;
  using S = ear_settings;
  CHECK(reason_of([](C& c, S&) { c.camera_count = 3; }) == "camera_count: 0 to 2");
  CHECK(reason_of([](C& c, S&) { c.beam_count = -1; }) == "beam_count: 0 to 3");
  CHECK(reason_of([](C& c, S&) { c.cameras[1].width = 0; }).find("width") != std::string::npos);
  CHECK(reason_of([](C& c, S&) { c.cameras[0].fu = -1.0; }).find("focal") != std::string::npos);
  CHECK(reason_of([](C& c, S&) { std::memset(&c.cameras[0].lens, 7, 1); }) == "lens: no such choice");
  const auto fisheye_with_k3 = [](C& c, S&) { c.cameras[0].lens = EAR_LENS_EQUIDISTANT; };
  CHECK(reason_of(fisheye_with_k3).find("distortion") != std::string::npos);
  CHECK(reason_of([](C& c, S&) { c.imu_rate_hz = std::nan(""); }).find("rate of the IMU") != std::string::npos);
  for (const double offset : {std::nan(""), 1e300, -4000.0}) {
    const auto spoil = [offset](C& c, S&) { c.camera_time_offset = offset; };
    CHECK(reason_of(spoil).find("camera_time_offset") != std::string::npos);
    const auto spoil_encoder = [offset](C& c, S&) { c.encoder_time_offset = offset; };
    CHECK(reason_of(spoil_encoder).find("the encoder's time_offset") != std::string::npos);
    const auto spoil_lasers = [offset](C& c, S&) { c.laser_time_offset = offset; };
    CHECK(reason_of(spoil_lasers).find("the lasers' time_offset") != std::string::npos);
  }
  CHECK(reason_of([](C& c, S&) { c.encoder_time_offset_sigma = -1e-3; }).find("time_offset_sigma") !=
        std::string::npos);
  CHECK(reason_of([](C& c, S&) { c.wheel_radius_sigma = -1e-3; }).find("wheel_radius_sigma") != std::string::npos);
  CHECK(reason_of([](C& c, S&) { c.cameras[1].rotation_sigma = 1e-3; }).find("pose_sigma") != std::string::npos);
  CHECK(reason_of([](C& c, S&) { c.cameras[1].focal_length_sigma = 0.5; }).find("intrinsics_sigma") !=
        std::string::npos);
  CHECK(reason_of([](C&, S& s) { s.window = 1; }).find("filter.window") != std::string::npos);
  CHECK(reason_of([](C&, S& s) { s.frame_slots = 0; }).find("frame_slots") != std::string::npos);
  CHECK(reason_of([](C&, S& s) { s.queue_seconds = std::nan(""); }).find("queue_seconds") != std::string::npos);

  std::array<char, 8> small{};
  ear_odometry* odometry = nullptr;
  ear_calibration bad = good;
  bad.camera_count = 3;
  CHECK(ear_create(&bad, nullptr, &odometry, small.data(), small.size()) == EAR_INVALID_ARGUMENT);
  CHECK(std::string(small.data()) == "camera_");
  CHECK(ear_create(&bad, nullptr, &odometry, nullptr, 0) == EAR_INVALID_ARGUMENT);
  CHECK(ear_create(nullptr, nullptr, &odometry, nullptr, 0) == EAR_INVALID_ARGUMENT);
  CHECK(ear_create(&good, nullptr, nullptr, nullptr, 0) == EAR_INVALID_ARGUMENT);
}

TEST_CASE("C interface: a start that is given, and why there is no estimate") {
  const Handle odometry = make();
  std::array<char, 200> message{};
  ear_start start{};
  ear_default_start(&start);
  CHECK(start.state.q_WB[0] == 1.0);
  CHECK(start.tilt_sigma == GivenStart{}.tilt_sigma);
  start.velocity_sigma = 0.0;
  CHECK(ear_start_at(odometry.get(), &start, message.data(), message.size()) == EAR_INVALID_ARGUMENT);
  CHECK(std::string(message.data()) == "start: velocity_sigma: must be positive");
  CHECK(ear_start_at(odometry.get(), nullptr, nullptr, 0) == EAR_INVALID_ARGUMENT);
  CHECK(ear_start_at(nullptr, &start, nullptr, 0) == EAR_INVALID_ARGUMENT);

  start.velocity_sigma = 0.05;
  start.state.t_ns = drive().simulation.imu().back().t_ns + 1'000'000'000;
  start.state.p_WB[0] = 7.0;
  REQUIRE(ear_start_at(odometry.get(), &start, message.data(), message.size()) == EAR_OK);
  run(odometry.get(), 1);
  ear_health health{};
  REQUIRE(ear_health_of(odometry.get(), &health) == EAR_OK);
  CHECK(health.status == EAR_HEALTH_INITIALISING);
  CHECK(std::string(ear_reason_text(health.reason)) == "the time of the start that was given has not come");
  CHECK(std::string(ear_reason_text(1000)) == "unknown reason");
}

TEST_CASE("C interface: null is refused everywhere") {
  const Handle handle = make();
  ear_odometry* const odometry = handle.get();
  CHECK(ear_add_imu(odometry, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_add_encoder(odometry, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_add_laser(odometry, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_add_stereo(odometry, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_process(odometry, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_step(odometry, 0, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_predict(odometry, 0, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_health_of(odometry, nullptr) == EAR_INVALID_ARGUMENT);
  CHECK(ear_counts_of(odometry, nullptr) == EAR_INVALID_ARGUMENT);
  ear_imu_sample imu{};
  ear_estimate estimate{};
  CHECK(ear_add_imu(nullptr, &imu) == EAR_INVALID_ARGUMENT);
  CHECK(ear_process(nullptr, &estimate) == EAR_INVALID_ARGUMENT);
  CHECK(ear_reset(nullptr) == EAR_INVALID_ARGUMENT);
  ear_stereo_frame frame = drive().c_frame(0);
  frame.stride = 10;
  CHECK(ear_add_stereo(odometry, &frame) == EAR_INVALID_ARGUMENT);
  ear_state state{};
  CHECK(ear_predict(odometry, 0, &state) == EAR_NO_ESTIMATE);
  CHECK(std::strlen(ear_result_text(EAR_QUEUE_FULL)) > 0);
  ear_destroy(nullptr);
}

}  // namespace
}  // namespace ear
