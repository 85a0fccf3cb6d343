// What can go wrong on the wire, from a vehicle that speaks ROS 2 by another implementation of DDS: each is named in
// words within a second, nothing stops, nothing grows.
#include <doctest/doctest.h>

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>
#include <thread>

#include "src/dds/log_sink.h"
#include "src/live/ros_calibration.h"
#include "src/live/ros_sensors.h"
#include "tests/live/fast_dds_vehicle.h"
#include "tests/live/live_setup.h"
#include "tests/support/about.h"

using namespace ear;
using namespace ear::live;

namespace {

using namespace std::chrono_literals;
using ear::test::about;
using SteadyClock = std::chrono::steady_clock;

constexpr auto kAtOnce = 1s;  // within which all is named

/// Everything stays on this machine; a domain of this process's own, so that tests may run beside each other.
int loopback_domain() {
  test::use_loopback();
  return 10 + static_cast<int>(::getpid() % 60);
}

Calibration calibration() {
  Calibration calibration;
  CameraCalibration camera = test::small_camera();
  camera.rate_hz = 20.0;
  calibration.cameras = {camera, camera};
  calibration.cameras[1].T_BC.translation().x() = 0.06;
  calibration.encoder.emplace();
  return calibration;
}

ros2::SensorTopics topics() {
  ros2::SensorTopics topics = ros2::default_topics();
  topics.beams = {};
  topics.left_joint = topics.right_joint = "";  // by their names
  return topics;
}

/// What `ear live` has behind the topics; it listens as that does.
struct Ear {
  Ear() {
    IntakeTaps taps;
    taps.imu = [this](const ImuSample&, const std::optional<NavState>&) { ++inertial; };
    taps.encoder = [this](const EncoderSample&) { ++wheels; };
    taps.stereo = [this](const StereoFrame&) { ++frames; };
    intake = std::make_unique<Intake>(estimator, calibration(), clock, taps);
    sensors = std::make_unique<RosSensors>(participant, topics(), *intake);
  }

  void listen() {
    for (std::string& text : sensors->look()) said.push_back(std::move(text));
    for (std::string& text : intake->look()) said.push_back(std::move(text));
    malformed += of_dds.take().size();  // where Fast DDS sends what is no packet
  }
  [[nodiscard]] bool heard(const std::string& words) const {
    return std::any_of(said.begin(), said.end(), [&](const auto& text) { return text.find(words) != text.npos; });
  }
  [[nodiscard]] std::string all() const {
    std::string text;
    for (const std::string& words : said) text += words + "\n";
    return text;
  }

  Complaints of_dds;
  dds::LogSink sink{[this](const std::string& text) { of_dds.add(text); }};
  dds::Participant participant{loopback_domain()};
  LiveClock clock;
  std::atomic<int> inertial{0}, wheels{0}, frames{0};
  LiveEstimator estimator{Config{}, calibration(), {2.0, 8}, {}};
  std::unique_ptr<Intake> intake;
  std::vector<std::string> said;
  std::size_t malformed = 0;
  std::unique_ptr<RosSensors> sensors;  ///< last: its threads use all else
};

/// A vehicle that stands, with sound sensors unless told otherwise.
struct Vehicle {
  explicit Vehicle(const fast_dds::Offer& imu_offer = {}) {
    wire.publish("/imu0", "Imu", imu_offer);
    wire.publish("/wheels", "JointState");
    wire.publish("/cam0/image_raw", "Image");
    wire.publish("/cam1/image_raw", "Image");
  }

  /// One inertial sample, and a wheel reading and images now and then.
  void step() {
    const TimeNs now = clock.now() + imu_ahead_ns;
    wire.write("/imu0", fast_dds::imu({now, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)}));
    ++steps;
    if (steps % 4 == 0) wire.write("/wheels", fast_dds::joints({clock.now(), 0, 0}, 4096.0));
    if (steps % 10 != 0) return;
    const std::vector<std::uint8_t> pixels(64 * 48, 100);
    const TimeNs t_ns = clock.now();
    wire.write("/cam0/image_raw", fast_dds::image(t_ns, {pixels.data(), 64, 48, 64}));
    wire.write("/cam1/image_raw", fast_dds::image(t_ns, {pixels.data(), 64, 48, 64}));
  }

  fast_dds::Vehicle wire{loopback_domain()};
  LiveClock clock;
  TimeNs imu_ahead_ns = 0;
  int steps = 0;
};

/// Plays at 200 Hz until `done` says so, or for so long; how long it took.
template <typename Done>
SteadyClock::duration play_until(Vehicle& vehicle, Ear& ear, const Done& done, SteadyClock::duration longest = 90s) {
  const SteadyClock::time_point begin = SteadyClock::now();
  while (!done() && SteadyClock::now() - begin < longest) {
    vehicle.step();
    ear.listen();
    std::this_thread::sleep_for(5ms);
  }
  return SteadyClock::now() - begin;
}

void play_until_all_come(Vehicle& vehicle, Ear& ear) {
  play_until(vehicle, ear, [&] { return ear.inertial > 20 && ear.wheels > 4 && ear.frames > 2; });
  REQUIRE(ear.frames > 2);
}

/// By how much the inertial sensor's clock was set, as the words say; 0: they do not.
double clock_step(const Ear& ear) {
  const std::string words = "imu: its clock was set by ";
  for (const std::string& text : ear.said) {
    if (text.rfind(words, 0) == 0) return std::stod(text.substr(words.size()));
  }
  return 0.0;
}

/// Was this sensor's rate said to be too high?
bool floods(const Ear& ear, const std::string& name) {
  return std::any_of(ear.said.begin(), ear.said.end(), [&](const std::string& text) {
    return text.rfind(name, 0) == 0 && text.find("what the queues cannot hold is refused") != text.npos;
  });
}

double resident_mb() {
  std::ifstream status("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  status >> pages >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1048576.0;
}

}  // namespace

TEST_CASE("ros faults: a quality of service that does not fit, and a wrong type, are named") {
  Ear ear;
  fast_dds::Vehicle wire(loopback_domain());
  fast_dds::Offer exclusive;
  exclusive.exclusive = true;
  wire.publish("/imu0", "Imu", exclusive);
  wire.publish("/wheels", "Imu");
  const auto is_known = [&](const std::string& topic) {
    const auto all = ear.participant.publications();
    return std::any_of(all.begin(), all.end(), [&](const auto& one) { return one.topic == topic; });
  };
  const SteadyClock::time_point began = SteadyClock::now();
  while (!(is_known("/imu0") && is_known("/wheels")) && SteadyClock::now() - began < 20s) {
    std::this_thread::sleep_for(5ms);
  }
  const std::string unfit = "/imu0: its publisher's quality of service does not fit: ownership";
  const std::string wrong = "/wheels: is published as sensor_msgs/msg/Imu, not as sensor_msgs/msg/JointState";
  const SteadyClock::time_point known = SteadyClock::now();
  while (!(ear.heard(unfit) && ear.heard(wrong)) && SteadyClock::now() - known < kAtOnce) {
    std::this_thread::sleep_for(10ms);
    ear.listen();
  }
  INFO(ear.all());
  CHECK(ear.heard(unfit));
  CHECK(ear.heard(wrong));
}

TEST_CASE("ros faults: topics that flood are named; memory stays, and the estimator takes what it can") {
  Ear ear;
  Vehicle vehicle;
  play_until_all_come(vehicle, ear);
  const double before = resident_mb();
  const SteadyClock::time_point begin = SteadyClock::now();
  SteadyClock::time_point next = begin;
  std::optional<SteadyClock::duration> named;
  int sent = 0;
  for (; SteadyClock::now() - begin < 3s; next += 100us) {  // 10 kHz
    const TimeNs now = vehicle.clock.now();
    vehicle.wire.write("/imu0", fast_dds::imu({now, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)}));
    vehicle.wire.write("/wheels", fast_dds::joints({now, 0, 0}, 4096.0));
    if (++sent % 100 == 0) ear.listen();
    const bool all = floods(ear, "imu: ") && floods(ear, "wheels: ");
    if (all && !named) named = SteadyClock::now() - begin;
    std::this_thread::sleep_until(next);
  }
  INFO(ear.all());
  MESSAGE("sent at ", sent / 3, " Hz; ", before, " MB before, ", resident_mb(), " MB after");
  REQUIRE(named);
  CHECK(*named < kAtOnce);
  CHECK(resident_mb() < before + 20.0);
  const int taken = ear.inertial;
  play_until(vehicle, ear, [&] { return ear.heard("samples a second again") && ear.inertial > taken; });
  CHECK(ear.heard("samples a second again"));
  CHECK(ear.inertial > taken);
}

TEST_CASE("ros faults: messages with false lengths are named; sound ones among them are taken") {
  Ear ear;
  Vehicle vehicle;
  play_until_all_come(vehicle, ear);
  const double before = resident_mb();
  const std::vector<std::uint8_t> pixels(64 * 48, 100);
  const TimeNs now = vehicle.clock.now();
  const std::vector<std::pair<std::string, fast_dds::Bytes>> sound{
      {"/imu0", fast_dds::imu({now, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()})},
      {"/wheels", fast_dds::joints({now, 0, 0}, 4096.0)},
      {"/cam0/image_raw", fast_dds::image(now, {pixels.data(), 64, 48, 64})}};
  for (const auto& [topic, bytes] : sound) {  // the length of frame_id: behind the representation and the stamp
    fast_dds::Bytes broken = bytes;
    std::fill_n(broken.begin() + 12, 4, std::uint8_t{0xFF});
    vehicle.wire.write(topic, broken);
  }
  const auto all_named = [&] {
    return ear.heard("/imu0: sensor_msgs/msg/Imu") && ear.heard("/wheels: sensor_msgs/msg/JointState") &&
           ear.heard("/cam0/image_raw: sensor_msgs/msg/Image");
  };
  CHECK(play_until(vehicle, ear, all_named) < kAtOnce);
  INFO(ear.all());
  CHECK(all_named());

  std::mt19937_64 rng{11};
  for (int i = 0; i < 6000; ++i) {  // bytes changed, cut short, or none at all
    auto [topic, bytes] = sound[rng() % sound.size()];
    for (int k = 0; k < 3; ++k)
      bytes[rng() % std::min<std::size_t>(bytes.size(), 200)] = static_cast<std::uint8_t>(rng());
    if (i % 3 == 0) bytes.resize(rng() % bytes.size() / 4 * 4);
    vehicle.wire.write(topic, bytes);
    if (i % 50 == 0) vehicle.step(), ear.listen();
    if (i % 10 == 0) std::this_thread::sleep_for(1ms);
  }
  const int frames = ear.frames, inertial = ear.inertial;
  play_until(vehicle, ear, [&] { return ear.inertial > inertial + 20 && ear.frames > frames + 2; });
  CHECK(ear.inertial > inertial + 20);
  CHECK(ear.frames > frames + 2);
  CHECK(resident_mb() < before + 20.0);
  CHECK(ear.said.size() < 200);  // of 6000: the log does not grow with them
}

TEST_CASE("ros faults: a publisher that comes again, best effort in place of reliable, and one that was there before") {
  auto first = std::make_unique<Vehicle>();
  const SteadyClock::time_point began = SteadyClock::now();
  for (; SteadyClock::now() - began < 300ms; std::this_thread::sleep_for(5ms)) first->step();  // nobody listens
  Ear ear;
  play_until_all_come(*first, ear);
  first.reset();
  const SteadyClock::time_point left = SteadyClock::now();
  while (!(ear.heard("/imu0: its publisher is gone") && ear.heard("imu: silent for")) &&
         SteadyClock::now() - left < kAtOnce) {
    std::this_thread::sleep_for(10ms);
    ear.listen();
  }
  INFO(ear.all());
  CHECK(ear.heard("/imu0: its publisher is gone"));
  CHECK(ear.heard("imu: silent for"));

  fast_dds::Offer best_effort;
  best_effort.reliable = false;
  Vehicle second(best_effort);
  const int inertial = ear.inertial;
  play_until(second, ear, [&] { return ear.heard("imu: samples come") && ear.inertial > inertial + 20; });
  CHECK(ear.heard("imu: samples come"));
  CHECK(ear.inertial > inertial + 20);
}

TEST_CASE("ros faults: a clock that is set is named, for each sensor") {
  Ear ear;
  Vehicle vehicle;
  play_until_all_come(vehicle, ear);
  vehicle.imu_ahead_ns = 5'000'000'000;
  CHECK(play_until(
            vehicle, ear, [&] { return clock_step(ear) > 0.0; }, kAtOnce) < kAtOnce);
  CHECK(clock_step(ear) == about(5.0, 0.05));
  ear.said.clear();
  vehicle.imu_ahead_ns = -2'000'000'000;
  CHECK(play_until(
            vehicle, ear, [&] { return clock_step(ear) < 0.0; }, kAtOnce) < kAtOnce);
  CHECK(clock_step(ear) == about(-7.0, 0.05));
  INFO(ear.all());
  CHECK_FALSE(ear.heard("wheels: its clock"));
}

TEST_CASE("ros faults: images without CameraInfo: what is waited for is named") {
  Vehicle vehicle;
  const dds::Participant participant(loopback_domain());
  RosCalibration calibration(participant, topics());
  const SteadyClock::time_point begin = SteadyClock::now();
  std::string missing;
  while (missing.find("/cam0/camera_info") == std::string::npos && SteadyClock::now() - begin < kAtOnce) {
    vehicle.step();
    missing = calibration.wait(0.01);
  }
  CHECK(missing.find("/cam0/camera_info") != std::string::npos);
}
