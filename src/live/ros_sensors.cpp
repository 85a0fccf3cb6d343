#include "src/live/ros_sensors.h"

#include <utility>

namespace ear::live {
namespace {

LaserCalibration lasers_of(const Calibration& calibration) { return calibration.lasers.value_or(LaserCalibration{}); }

std::int64_t resolution_of(const Calibration& calibration) {
  return calibration.encoder.value_or(EncoderCalibration{}).resolution;
}

void report(const Warnings& warnings, Complaints& complaints) {
  for (const Warning& warning : warnings.list()) complaints.add(warning.kind + ": " + warning.first);
}

}  // namespace

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
    subscribe({wheel_topic(topics.wheels)}, &RosSensors::take_wheels);
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
    report(warnings, complaints_);
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
    report(warnings, complaints_);
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

}  // namespace ear::live
