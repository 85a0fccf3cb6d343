// Topics over the loopback interface, from one participant to another of this process.
#include "ear/odometry.h"
#include "src/live/ros_calibration.h"
#include "src/live/ros_publisher.h"
#include "src/live/ros_sensors.h"

#include <doctest/doctest.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "src/live/ros_calibration.h"
#include "src/ros2/cdr.h"
#include "src/ros2/outgoing.h"
#include "tests/live/live_setup.h"
#include "tests/support/about.h"

using namespace ear;
using namespace ear::live;

namespace {

using namespace std::chrono_literals;
using ear::test::about;

/// Everything stays on this machine, whatever its network is.
int loopback_domain() {
  test::use_loopback();
  return 71;
}

Calibration stereo() {
  Calibration calibration;
  CameraCalibration camera = test::small_camera();
  camera.rate_hz = 50.0;
  camera.T_BC.translation() = Eigen::Vector3d(0.1, 0.05, 0.0);
  calibration.cameras = {camera, camera};
  calibration.cameras[1].T_BC.translation().x() += 0.06;
  calibration.encoder.emplace();
  return calibration;
}

ros2::SensorTopics topics() {
  ros2::SensorTopics topics = ros2::default_topics();
  topics.beams = {};
  return topics;
}

/// A vehicle that publishes.
class Vehicle {
 public:
  Vehicle() : participant_(loopback_domain()) {}

  template <typename Message>
  void send(const std::string& topic, const Message& message, bool latched = false) {
    write(topic, Message::kType, ros2::encode(message), latched);
  }
  void write(const std::string& topic, const std::string& type, const std::vector<std::uint8_t>& cdr,
             bool latched = false) {
    auto& writer = writers_[topic];
    if (!writer)
      writer = std::make_unique<dds::Writer>(participant_, topic, type, dds::Writer::Options{true, latched, 50, ""});
    CHECK(writer->write(cdr));
  }
  void image(std::size_t camera, TimeNs t_ns) {
    const std::vector<std::uint8_t> pixels(64 * 48, 100);
    send(camera == 0 ? topics().left : topics().right, ros2::image_message({pixels.data(), 64, 48, 64}, camera, t_ns));
  }

 private:
  dds::Participant participant_;
  std::map<std::string, std::unique_ptr<dds::Writer>> writers_;
};

/// Repeats until `done` says so, at most for 20 s.
template <typename Work>
bool eventually(const Work& done) {
  for (int i = 0; i < 400; ++i) {
    if (done()) return true;
    std::this_thread::sleep_for(50ms);
  }
  return false;
}

bool contains(const std::vector<std::string>& said, const std::string& words) {
  for (const std::string& text : said) {
    if (text.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("ros sensors: cameras calibrate themselves from CameraInfo and tf_static") {
  const Calibration truth = stereo();
  const dds::Participant participant(loopback_domain());
  Vehicle vehicle;
  TimeNs t_ns = 1'700'000'000'000'000'000;
  const auto images_and_imu = [&] {
    t_ns += 20'000'000;
    vehicle.image(0, t_ns);
    vehicle.send(topics().imu, ros2::imu_message({t_ns, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)}));
  };
  images_and_imu();
  RosCalibration calibration(participant, topics());
  REQUIRE(eventually([&] {
    images_and_imu();
    return calibration.wait(0.01).find("CameraInfo") != std::string::npos ||
           calibration.wait(0.01).find("camera_info") != std::string::npos;
  }));  // images come, and it says what they lack
  vehicle.send(topics().tf_static, ros2::static_frames(truth, "base_link", t_ns), true);
  vehicle.send(topics().left_info, ros2::camera_info(truth.cameras[0], 0, t_ns));
  vehicle.send(topics().right_info, ros2::camera_info(truth.cameras[1], 1, t_ns));
  REQUIRE(eventually([&] {
    images_and_imu();
    vehicle.send(topics().left_info, ros2::camera_info(truth.cameras[0], 0, t_ns));
    vehicle.send(topics().right_info, ros2::camera_info(truth.cameras[1], 1, t_ns));
    return calibration.wait(0.05).empty();
  }));
  const Calibration learned = calibration.complete(Calibration{});
  REQUIRE(learned.cameras.size() == 2);
  CHECK(learned.cameras[0].fu == doctest::Approx(50.0));
  CHECK((learned.cameras[1].T_BC.translation() - truth.cameras[1].T_BC.translation()).norm() < 1e-9);
  CHECK(learned.cameras[0].rate_hz == about(50.0, 0.01));
  CHECK(calibration.T_B_base().has_value());
}

TEST_CASE("ros sensors: samples arrive; broken messages and wrong types are said, and nothing stops") {
  const Calibration truth = stereo();
  const dds::Participant participant(loopback_domain());
  Vehicle vehicle;
  const LiveClock clock;
  std::atomic<int> inertial{0}, frames{0};
  LiveEstimator estimator(Config{}, truth, {2.0, 16}, {});
  Intake intake(estimator, truth, clock,
                {[&](const ImuSample&, const std::optional<NavState>&) { ++inertial; }, nullptr, nullptr,
                 [&](const StereoFrame& frame) { frames += frame.right.empty() ? 0 : 1; }});
  RosSensors sensors(participant, topics(), intake);
  std::vector<std::string> said;
  const auto listen = [&] {
    for (std::string& text : sensors.look()) said.push_back(std::move(text));
  };
  TimeNs t_ns = 1'700'000'000'000'000'000;
  const ros2::Imu imu = ros2::imu_message({t_ns, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)});
  std::vector<std::uint8_t> false_length = ros2::encode(imu);
  false_length[12] = false_length[13] = false_length[14] = 0xFF;         // of frame_id
  vehicle.write("/wheels", "sensor_msgs/msg/Image", ros2::encode(imu));  // of another type

  CHECK(eventually([&] {
    t_ns += 5'000'000;
    ros2::Imu sample = imu;
    sample.header.stamp = ros2::time_of_stamp(t_ns);
    vehicle.send(topics().imu, sample);
    vehicle.write(topics().imu, ros2::Imu::kType, false_length);
    vehicle.image(0, t_ns);
    vehicle.image(1, t_ns);
    listen();
    return inertial > 10 && frames > 3 && contains(said, "/wheels: is published as sensor_msgs/msg/Image") &&
           contains(said, topics().imu + ": sensor_msgs/msg/Imu");
  }));
  CHECK(contains(said, topics().imu + ": has a publisher"));
  for (const std::string& text : said) INFO(text);
}

TEST_CASE("ros publisher: who joins later gets the frames, and topics say the hashes of their types") {
  const dds::Participant participant(loopback_domain());
  const RosMessages messages({}, Eigen::Isometry3d::Identity());
  RosPublisher publisher(participant, messages, nullptr);
  publisher.publish_frames(participant, messages.frames(stereo(), 1'700'000'000'000'000'000));
  std::this_thread::sleep_for(200ms);

  const dds::Participant late(loopback_domain());
  std::atomic<std::size_t> frames{0};
  dds::Subscription subscription(late, {{"/tf_static", ros2::TfMessage::kType, 10}}, [&](const dds::Received& message) {
    frames = ros2::decode<ros2::TfMessage>({message.cdr.data, message.cdr.size}).transforms.size();
  });
  CHECK(eventually([&] { return frames > 0; }));
  CHECK(frames == 3);  // the IMU and two cameras
  const auto says = [&](const std::string& topic, const std::string& user_data) {
    for (const dds::Publication& one : late.publications()) {
      if (one.topic == topic) return one.user_data == user_data;
    }
    return false;
  };
  CHECK(eventually([&] {
    return says("/ear/odometry", "typehash=RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0;") &&
           says("/tf", "typehash=RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087;");
  }));
}

TEST_CASE("ros publisher: images with their features, once somebody reads them") {
  const dds::Participant participant(loopback_domain()), other(loopback_domain());
  RosNames names;
  names.features = "/ear/features";
  RosPublisher publisher(participant, RosMessages(names, Eigen::Isometry3d::Identity()), nullptr);
  publisher.publish_features(participant, stereo().cameras[0]);
  Odometry odometry(Config{}, stereo());
  const std::vector<std::uint8_t> pixels(64 * 48, 100);
  StereoFrame frame;
  frame.t_ns = 1'700'000'000'000'000'000;
  frame.left = frame.right = {pixels.data(), 64, 48, 64};
  std::atomic<TimeNs> heard{0};
  dds::Subscription subscription(other, {{names.features, ros2::Image::kType, 2}}, [&](const dds::Received& message) {
    const auto image = ros2::decode<ros2::Image>({message.cdr.data, message.cdr.size});
    if (image.encoding == "bgr8" && image.data.size() == 3 * pixels.size())
      heard = ros2::nanoseconds(image.header.stamp);
  });
  CHECK(eventually([&] {
    frame.t_ns += 50'000'000;
    odometry.add_imu({frame.t_ns, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)});
    publisher.take(frame);
    static_cast<void>(odometry.add_stereo(frame));
    publisher.show(odometry);
    return heard > 0;
  }));
}

TEST_CASE("ros sensors: after a pause the topics go on together, none far ahead of the others") {
  const dds::Participant participant(loopback_domain());
  Vehicle vehicle;
  std::array<std::atomic<int>, 2> count{};
  std::atomic<bool> pause{true};
  std::atomic<int> farthest{0};
  dds::Subscription subscription(participant, {{"/a", ros2::Imu::kType, 500}, {"/b", ros2::Imu::kType, 500}},
                                 [&](const dds::Received& message) {
                                   ++count[message.what.topic == "/a" ? 0 : 1];
                                   while (pause && count[0] > 0 && count[1] > 0) std::this_thread::sleep_for(5ms);
                                   if (!pause) farthest = std::max(farthest.load(), std::abs(count[0] - count[1]));
                                 });
  const ros2::Imu imu = ros2::imu_message({1'700'000'000'000'000'000, {}, {}});
  REQUIRE(eventually([&] {
    for (const char* topic : {"/a", "/b"}) vehicle.send(topic, imu);
    return count[0] > 0 && count[1] > 0;
  }));
  const int before = std::abs(count[0] - count[1]);
  for (int i = 0; i < 40; ++i) {
    for (const char* topic : {"/a", "/b"}) vehicle.send(topic, imu);
  }
  std::this_thread::sleep_for(200ms);  // all of them wait now
  pause = false;
  CHECK(eventually([&] { return count[0] > 40 && count[1] > 40; }));
  CHECK(farthest <= before + 8);
}

TEST_CASE("ros sensors: names on the wire") {
  CHECK(dds::wire_type("sensor_msgs/msg/Imu") == "sensor_msgs::msg::dds_::Imu_");
  CHECK(dds::ros_type("sensor_msgs::msg::dds_::Imu_") == "sensor_msgs/msg/Imu");
  CHECK(dds::ros_type("Imu") == "Imu");
  CHECK(dds::wire_topic("/imu") == "rt/imu");
  CHECK(dds::wire_topic("imu") == "rt/imu");
  ::setenv("ROS_DOMAIN_ID", "232", 1);
  CHECK(dds::domain_of_environment() == 232);
  ::setenv("ROS_DOMAIN_ID", "233", 1);
  CHECK_THROWS_WITH_AS(static_cast<void>(dds::domain_of_environment()),
                       "ROS_DOMAIN_ID: '233' is no number from 0 to 232", std::invalid_argument);
  ::unsetenv("ROS_DOMAIN_ID");
  CHECK(dds::domain_of_environment() == 0);
}
