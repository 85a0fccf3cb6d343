#include "src/rosbag2/recording_writer.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include "src/ros2/calibration_messages.h"
#include "src/ros2/outgoing.h"
#include "src/rosbag2/mcap_writer.h"

namespace ear::rosbag2 {

namespace fs = std::filesystem;

namespace {

/// Transforms that never change are published once and kept for those who come later: what rosbag2 needs to know to do
/// the same when it plays them. History and depth are left to it; durability 1 is transient local, reliability 1
/// reliable.
const std::string kEver = "\n    sec: 9223372036\n    nsec: 854775807\n";
const std::string kLatched = "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 1\n  deadline:" + kEver +
                             "  lifespan:" + kEver + "  liveliness: 1\n  liveliness_lease_duration:" + kEver +
                             "  avoid_ros_namespace_conventions: false";

}  // namespace

class RecordingWriter::Impl {
 public:
  Impl(const fs::path& file, const ros2::SensorTopics& topics, const Calibration& calibration, const fs::path& folder)
      : topics_(topics), calibration_(calibration), file_(file) {
    for (const char* sensor : {"imu0", "cam0", "cam1", "encoder0", "laser0"}) {
      const fs::path yaml = folder / sensor / "sensor.yaml";
      if (!fs::exists(yaml)) continue;
      std::ostringstream text;
      text << std::ifstream(yaml, std::ios::binary).rdbuf();
      file_.attach(std::string("calibration/") + sensor + "/sensor.yaml", "application/yaml", text.str());
    }
  }

  void write(const Sample& sample) {
    std::visit(Overloaded{[&](const RecordedFrame& frame) { write(frame); }, [&](const auto& other) { write(other); }},
               sample);
  }

  void write_truth(TimeNs t_ns, const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& p_WB) {
    ros2::PoseStamped pose;
    pose.header = {ros2::time_of_stamp(t_ns), "world"};
    pose.pose = ros2::pose_message(q_WB, p_WB);
    put(topics_.truth, t_ns, t_ns, pose);
  }

  void write_message(const std::string& topic, const std::string& type, TimeNs t_ns,
                     const std::vector<std::uint8_t>& cdr) {
    put(topic, type, t_ns, t_ns, cdr, {});
  }

  void close() { file_.close(); }

 private:
  void write(const ImuSample& sample) { put(topics_.imu, sample.t_ns, sample.t_ns, ros2::imu_message(sample)); }

  void write(const EncoderSample& sample) {
    put(topics_.wheels, sample.t_ns, sample.t_ns, ros2::joint_message(sample, calibration_.encoder.value().resolution));
  }

  void write(const LaserSample& sample) {
    for (std::size_t i = 0; i < sample.range.size() && i < topics_.beams.size(); ++i) {
      put(topics_.beams[i], sample.t_ns, sample.t_ns, ros2::range_message(sample, i, calibration_.lasers.value()));
    }
  }

  void write(const RecordedFrame& frame) {
    const std::map<std::string, std::string> by_arrival{{"log_time", "arrival"}};
    last_arrival_ns_ = std::max(last_arrival_ns_, frame.arrival_ns);  // frames stay in order
    put(topics_.left, last_arrival_ns_, frame.t_ns, ros2::image_message(frame.left, 0, frame.t_ns), by_arrival);
    if (frame.right.empty()) return;
    put(topics_.right, last_arrival_ns_, frame.t_ns, ros2::image_message(frame.right, 1, frame.t_ns), by_arrival);
  }

  /// What says where the sensors are, with the first message's time.
  void describe(TimeNs t_ns) {
    described_ = true;
    const ros2::TfMessage frames = ros2::static_frames(calibration_, topics_.base_frame, t_ns);
    if (!frames.transforms.empty()) {
      put(topics_.tf_static, t_ns, t_ns, frames, {{"offered_qos_profiles", kLatched}});
    }
    for (std::size_t i = 0; i < calibration_.cameras.size(); ++i) {
      put(i == 0 ? topics_.left_info : topics_.right_info, t_ns, t_ns,
          ros2::camera_info(calibration_.cameras[i], i, t_ns));
    }
  }

  template <typename Message>
  void put(const std::string& topic, TimeNs log_ns, TimeNs stamp_ns, const Message& message,
           const std::map<std::string, std::string>& metadata = {}) {
    put(topic, Message::kType, log_ns, stamp_ns, ros2::encode(message), metadata);
  }

  void put(const std::string& topic, const std::string& type, TimeNs log_ns, TimeNs stamp_ns,
           const std::vector<std::uint8_t>& bytes, const std::map<std::string, std::string>& metadata) {
    if (!described_) describe(log_ns);
    auto channel = channels_.find(topic);
    if (channel == channels_.end()) {
      channel = channels_.emplace(topic, file_.add_channel(topic, type, metadata)).first;
    }
    file_.write(channel->second, log_ns, stamp_ns, {bytes.data(), bytes.size()});
  }

  ros2::SensorTopics topics_;
  Calibration calibration_;
  McapWriter file_;
  std::map<std::string, McapWriter::Channel> channels_;
  TimeNs last_arrival_ns_ = std::numeric_limits<TimeNs>::min();
  bool described_ = false;
};

RecordingWriter::RecordingWriter(const fs::path& file, const ros2::SensorTopics& topics, const Calibration& calibration,
                                 const fs::path& calibration_folder)
    : impl_(std::make_unique<Impl>(file, topics, calibration, calibration_folder)) {}
RecordingWriter::~RecordingWriter() = default;
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
void RecordingWriter::write(const Sample& sample) { impl_->write(sample); }
void RecordingWriter::write_truth(TimeNs t_ns, const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& p_WB) {
  impl_->write_truth(t_ns, q_WB, p_WB);
}
void RecordingWriter::write_message(const std::string& topic, const std::string& type, TimeNs t_ns,
                                    const std::vector<std::uint8_t>& cdr) {
  impl_->write_message(topic, type, t_ns, cdr);
}
void RecordingWriter::close() { impl_->close(); }

}  // namespace ear::rosbag2
