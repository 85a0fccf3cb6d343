#include "src/live/ros_sensors.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace ear::live {
namespace {

constexpr std::size_t kMostComplaints = 20;  // that wait to be said
constexpr int kSampleDepth = 500;            // messages of a quick sensor that wait for its thread
constexpr int kImageDepth = 4;
constexpr std::size_t kImagesForRate = 20;

const char* const kImuType = ros2::Imu::kType;

/// The type that a topic is published with now, among those that can be read; the first one, if it is not published.
std::string type_of(const dds::Participant& participant, const std::string& topic,
                    const std::vector<std::string>& known) {
  for (const dds::Publication& one : participant.publications()) {
    if (one.topic == topic && std::count(known.begin(), known.end(), one.type) > 0) return one.type;
  }
  return known.front();
}

dds::Wanted image_topic(const dds::Participant& participant, const std::string& topic) {
  return {topic, type_of(participant, topic, {ros2::Image::kType, ros2::CompressedImage::kType}), kImageDepth};
}

dds::Wanted beam_topic(const dds::Participant& participant, const std::string& topic) {
  return {topic, type_of(participant, topic, {ros2::Range::kType, ros2::LaserScan::kType}), kSampleDepth};
}

std::vector<dds::Wanted> imu_topics(const ros2::SensorTopics& topics) {
  if (!topics.imu_apart()) return {{topics.imu, kImuType, kSampleDepth}};
  return {{topics.gyro, kImuType, kSampleDepth}, {topics.accel, kImuType, kSampleDepth}};
}

std::string info_topic(const std::string& stated, const std::string& image) {
  return stated.empty() ? ros2::info_topic_of(image) : stated;
}

std::vector<std::string> beam_topics(const ros2::SensorTopics& topics) {
  std::vector<std::string> beams;
  std::copy_if(topics.beams.begin(), topics.beams.end(), std::back_inserter(beams),
               [](const std::string& beam) { return !beam.empty(); });
  return beams;
}

LaserCalibration lasers_of(const Calibration& calibration) { return calibration.lasers.value_or(LaserCalibration{}); }

std::int64_t resolution_of(const Calibration& calibration) {
  return calibration.encoder.value_or(EncoderCalibration{}).resolution;
}

void say(const Warnings& warnings, Complaints& complaints) {
  for (const Warning& warning : warnings.list()) complaints.add(warning.kind + ": " + warning.first);
}

}  // namespace

void Complaints::add(const std::string& words) {
  const std::lock_guard lock(mutex_);
  if (words_.size() < kMostComplaints) words_.push_back(words);
}

std::vector<std::string> Complaints::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(words_, {});
}

std::vector<ros2::Topic> topics_of(const dds::Participant& participant) {
  std::vector<ros2::Topic> topics;
  for (const dds::Publication& one : participant.publications()) topics.push_back({one.topic, one.type});
  return topics;
}

RosSensors::RosSensors(const dds::Participant& participant, const ros2::SensorTopics& topics, Intake& intake)
    : topics_(topics),
      intake_(intake),
      imu_(topics),
      wheels_(topics, resolution_of(intake.calibration())),
      beams_(topics, lasers_of(intake.calibration())),
      pairing_(intake.calibration().cameras.size() > 1) {
  const Calibration& calibration = intake.calibration();
  const auto subscribe = [&](std::vector<dds::Wanted> wanted, void (RosSensors::*take)(const dds::Received&)) {
    subscriptions_.push_back(std::make_unique<dds::Subscription>(
        participant, std::move(wanted), [this, take](const dds::Received& message) { (this->*take)(message); }));
  };
  if (!topics.imu.empty() || topics.imu_apart()) subscribe(imu_topics(topics), &RosSensors::take_imu);
  if (calibration.encoder && !topics.wheels.empty()) {
    subscribe({{topics.wheels, ros2::JointState::kType, kSampleDepth}}, &RosSensors::take_wheels);
  }
  std::vector<dds::Wanted> beams;
  for (const std::string& beam : beam_topics(topics)) beams.push_back(beam_topic(participant, beam));
  if (calibration.lasers && !beams.empty()) subscribe(std::move(beams), &RosSensors::take_beam);
  if (calibration.cameras.empty() || topics.left.empty()) return;
  std::vector<dds::Wanted> images{image_topic(participant, topics.left)};
  if (calibration.cameras.size() > 1 && !topics.right.empty()) {
    images.push_back(image_topic(participant, topics.right));
  }
  subscribe(std::move(images), &RosSensors::take_image);
}

ros2::RawMessage RosSensors::raw(const dds::Received& message) const {
  return {message.what.topic, message.what.type, intake_.clock().now(), {message.cdr.data, message.cdr.size}};
}

template <typename Work>
void RosSensors::guarded(const Work& work) {
  try {
    work();
  } catch (const std::exception& error) {  // one bad message is no reason to stop
    complaints_.add(error.what());
  }
}

void RosSensors::take_imu(const dds::Received& message) {
  guarded([&] {
    std::vector<ImuSample> samples;
    Warnings warnings;
    imu_.take(raw(message), samples, warnings);
    for (const ImuSample& sample : samples) intake_.add(sample);
    say(warnings, complaints_);
  });
}

void RosSensors::take_wheels(const dds::Received& message) {
  guarded([&] { intake_.add(wheels_.take(raw(message))); });
}

void RosSensors::take_beam(const dds::Received& message) {
  guarded([&] {
    std::vector<LaserSample> samples;
    beams_.take(raw(message), samples);
    for (const LaserSample& sample : samples) intake_.add(sample);
  });
}

void RosSensors::take_image(const dds::Received& message) {
  guarded([&] {
    const std::size_t camera = message.what.topic == topics_.left ? 0 : 1;
    Warnings warnings;
    std::vector<RecordedFrame> frames;
    ros2::GreyImage image = ros2::grey_image(raw(message), camera == 0 ? "cam0" : "cam1", warnings);
    if (!image.pixels.empty()) pairing_.take(camera, std::move(image), frames, warnings);
    for (const RecordedFrame& frame : frames) intake_.add(static_cast<const StereoFrame&>(frame));
    say(warnings, complaints_);
  });
}

std::vector<std::string> RosSensors::look() {
  std::vector<std::string> words;
  for (const auto& subscription : subscriptions_) {
    for (std::string& text : subscription->look()) words.push_back(std::move(text));
  }
  const TimeNs now = intake_.clock().now();
  for (const std::string& text : complaints_.take()) {
    if (const auto held_back = limit_.allows(text.substr(0, text.find(':')), now)) {
      words.push_back(text + held_back_text(*held_back));
    }
  }
  return words;
}

RosCalibration::RosCalibration(const dds::Participant& participant, const ros2::SensorTopics& topics)
    : topics_(topics), messages_(topics) {
  std::vector<dds::Wanted> wanted{{topics.tf_static, ros2::TfMessage::kType, 100}};
  for (const dds::Wanted& imu : imu_topics(topics)) {
    if (!imu.topic.empty()) wanted.push_back(imu);
  }
  for (const std::string& beam : beam_topics(topics)) wanted.push_back(beam_topic(participant, beam));
  if (!topics.left.empty()) {
    wanted.push_back({info_topic(topics.left_info, topics.left), ros2::CameraInfo::kType, 1});
    wanted.push_back(image_topic(participant, topics.left));
  }
  if (!topics.right.empty()) {
    wanted.push_back({info_topic(topics.right_info, topics.right), ros2::CameraInfo::kType, 1});
  }
  subscription_ = std::make_unique<dds::Subscription>(participant, std::move(wanted),
                                                      [this](const dds::Received& message) { take(message); });
}

void RosCalibration::take(const dds::Received& message) {
  const std::lock_guard lock(mutex_);
  const ros2::RawMessage raw{message.what.topic, message.what.type, 0, {message.cdr.data, message.cdr.size}};
  try {
    if (message.what.topic == topics_.left && image_stamps_.size() < kImagesForRate) {
      Warnings ignored;  // the estimator's reader will say so
      image_stamps_.push_back(ros2::grey_image(raw, "cam0", ignored).t_ns);
    }
    messages_.take(raw);
  } catch (const std::exception& error) {
    complaints_.add(error.what());
  }
  changed_.notify_all();
}

std::string RosCalibration::missing() const {
  std::string text = messages_.missing_for_cameras();
  const std::string beams = messages_.missing_for_beams();
  if (!beams.empty()) text += (text.empty() ? "" : "; ") + beams;
  if (text.empty() && !topics_.left.empty() && image_stamps_.size() < kImagesForRate)
    text = "images of " + topics_.left;
  return text;
}

std::string RosCalibration::wait(double seconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return missing().empty(); });
  return missing();
}

std::vector<std::string> RosCalibration::look() {
  std::vector<std::string> words = subscription_->look();
  for (std::string& text : complaints_.take()) words.push_back(std::move(text));
  return words;
}

Calibration RosCalibration::complete(Calibration known) const {
  const std::lock_guard lock(mutex_);
  if (known.cameras.empty() && !topics_.left.empty()) {
    known.cameras = messages_.cameras();
    std::vector<double> intervals;
    for (std::size_t i = 1; i < image_stamps_.size(); ++i) {
      intervals.push_back(seconds_between(image_stamps_[i - 1], image_stamps_[i]));
    }
    std::sort(intervals.begin(), intervals.end());
    const double interval = intervals.empty() ? 0.0 : intervals[intervals.size() / 2];
    for (CameraCalibration& camera : known.cameras) camera.rate_hz = interval > 0.0 ? 1.0 / interval : 0.0;
  }
  if (!known.lasers && topics_.beam_count() > 0) known.lasers = messages_.lasers();
  return known;
}

std::optional<Eigen::Isometry3d> RosCalibration::T_B_base() const {
  const std::lock_guard lock(mutex_);
  return messages_.T_B_base();
}

}  // namespace ear::live
