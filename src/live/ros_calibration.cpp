#include "src/live/ros_calibration.h"

#include <chrono>
#include <utility>

#include "filter/ingest/median.h"
#include "src/ros2/image_messages.h"

namespace ear::live {
namespace {

constexpr std::size_t kImagesForRate = 20;

std::string info_topic(const std::string& stated, const std::string& image) {
  return stated.empty() ? ros2::info_topic_of(image) : stated;
}

}  // namespace

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
    const double interval = intervals.empty() ? 0.0 : upper_median(intervals);
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
