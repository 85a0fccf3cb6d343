#include <geometry_msgs/PoseStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Range.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "src/bag/bag.h"
#include "src/recording/input_error.h"
#include "src/recording/yaml_map.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

constexpr double kTurn = 2.0 * M_PI;
constexpr TimeNs kSecond = 1'000'000'000;

TimeNs nanoseconds(const ros::Time& time) { return static_cast<TimeNs>(time.sec) * kSecond + time.nsec; }

}  // namespace

bool bags_are_built() { return true; }

// Samples to messages.

class BagWriter::Impl {
 public:
  Impl(const fs::path& file, const BagTopics& topics, const Calibration& calibration)
      : file_(file), topics_(topics), calibration_(calibration) {
    try {
      bag_.open(file.string(), rosbag::bagmode::Write);
    } catch (const rosbag::BagException& error) {
      throw InputError(located(file_, 0, "", error.what()));
    }
  }

  void write(const ImuSample& sample) {
    sensor_msgs::Imu message;
    message.header = header(sample.t_ns, "imu0");
    message.orientation_covariance[0] = -1.0;  // none is given
    message.angular_velocity.x = sample.gyro_B.x();
    message.angular_velocity.y = sample.gyro_B.y();
    message.angular_velocity.z = sample.gyro_B.z();
    message.linear_acceleration.x = sample.accel_B.x();
    message.linear_acceleration.y = sample.accel_B.y();
    message.linear_acceleration.z = sample.accel_B.z();
    put(topics_.imu, sample.t_ns, message);
  }

  void write(const EncoderSample& sample) {
    const double per_count = kTurn / static_cast<double>(calibration_.encoder.value().resolution);
    sensor_msgs::JointState message;
    message.header = header(sample.t_ns, "encoder0");
    message.name = {"left", "right"};
    message.position = {per_count * static_cast<double>(sample.left_count),
                        per_count * static_cast<double>(sample.right_count)};
    put(topics_.wheels, sample.t_ns, message);
  }

  void write(const LaserSample& sample) {
    const LaserCalibration& lasers = calibration_.lasers.value();
    for (std::size_t i = 0; i < sample.range.size() && i < topics_.beams.size(); ++i) {
      sensor_msgs::Range message;
      message.header = header(sample.t_ns, "laser0_" + std::to_string(i));
      message.radiation_type = sensor_msgs::Range::INFRARED;
      message.min_range = static_cast<float>(lasers.range_min);
      message.max_range = static_cast<float>(lasers.range_max);
      message.range = std::isnan(sample.range[i]) ? std::numeric_limits<float>::infinity()  // REP-117: no return
                                                  : static_cast<float>(sample.range[i]);
      put(topics_.beams[i], sample.t_ns, message);
    }
  }

  void write(const StereoFrame& frame, TimeNs arrival_ns) {
    write(topics_.left, "cam0", frame.left, frame.t_ns, arrival_ns);
    if (!frame.right.empty()) write(topics_.right, "cam1", frame.right, frame.t_ns, arrival_ns);
  }

  void write_truth(TimeNs t_ns, const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& p_WB) {
    geometry_msgs::PoseStamped message;
    message.header = header(t_ns, "world");
    message.pose.position.x = p_WB.x();
    message.pose.position.y = p_WB.y();
    message.pose.position.z = p_WB.z();
    message.pose.orientation.w = q_WB.w();
    message.pose.orientation.x = q_WB.x();
    message.pose.orientation.y = q_WB.y();
    message.pose.orientation.z = q_WB.z();
    put(topics_.truth, t_ns, message);
  }

  void close() {
    try {
      bag_.close();
    } catch (const rosbag::BagException& error) {
      throw InputError(located(file_, 0, "", error.what()));
    }
  }

 private:
  void write(const std::string& topic, const std::string& frame_id, const ImageView& image, TimeNs t_ns,
             TimeNs arrival_ns) {
    sensor_msgs::Image message;
    message.header = header(t_ns, frame_id);
    message.width = static_cast<std::uint32_t>(image.width);
    message.height = static_cast<std::uint32_t>(image.height);
    message.step = message.width;
    message.encoding = "mono8";
    for (int y = 0; y < image.height; ++y) {
      const std::uint8_t* const row = image.data + y * image.stride;
      message.data.insert(message.data.end(), row, row + image.width);
    }
    put(topic, arrival_ns, message);
  }

  [[nodiscard]] ros::Time time(TimeNs t_ns) const {
    if (t_ns <= 0 || t_ns / kSecond > std::numeric_limits<std::uint32_t>::max()) {
      throw InputError(located(file_, 0, "", "a bag cannot hold the time " + std::to_string(t_ns) + " ns"));
    }
    return {static_cast<std::uint32_t>(t_ns / kSecond), static_cast<std::uint32_t>(t_ns % kSecond)};
  }

  [[nodiscard]] std_msgs::Header header(TimeNs t_ns, const std::string& frame_id) const {
    std_msgs::Header result;
    result.stamp = time(t_ns);
    result.frame_id = frame_id;
    return result;
  }

  template <typename Message>
  void put(const std::string& topic, TimeNs arrival_ns, const Message& message) {
    try {
      bag_.write(topic, time(arrival_ns), message);
    } catch (const rosbag::BagException& error) {
      throw InputError(located(file_, 0, topic, error.what()));
    }
  }

  fs::path file_;
  BagTopics topics_;
  Calibration calibration_;
  rosbag::Bag bag_;
};

BagWriter::BagWriter(const fs::path& file, const BagTopics& topics, const Calibration& calibration)
    : impl_(std::make_unique<Impl>(file, topics, calibration)) {}
BagWriter::~BagWriter() = default;
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;
void BagWriter::write(const ImuSample& sample) { impl_->write(sample); }
void BagWriter::write(const EncoderSample& sample) { impl_->write(sample); }
void BagWriter::write(const LaserSample& sample) { impl_->write(sample); }
void BagWriter::write(const StereoFrame& frame, TimeNs arrival_ns) { impl_->write(frame, arrival_ns); }
void BagWriter::write_truth(TimeNs t_ns, const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& p_WB) {
  impl_->write_truth(t_ns, q_WB, p_WB);
}
void BagWriter::close() { impl_->close(); }

namespace {

// Messages to a folder.

class Unpacker {
 public:
  Unpacker(const fs::path& bag, const BagTopics& topics, const fs::path& folder)
      : file_(bag), topics_(topics), mav0_(folder / "mav0"), calibration_(calibration_folder(bag, topics)) {}

  void run() {
    rosbag::Bag bag;
    try {
      bag.open(file_.string(), rosbag::bagmode::Read);
      for (const rosbag::MessageInstance& message : rosbag::View(bag)) take(message);
    } catch (const rosbag::BagException& error) {
      throw InputError(located(file_, 0, "", error.what()));
    }
    if (!files_.count("imu0")) {
      std::string there;
      for (const std::string& topic : seen_) there += (there.empty() ? "" : ", ") + topic;
      throw InputError(located(file_, 0, topics_.imu, "no messages on this topic of the IMU; there are " + there));
    }
    write_ranges();
  }

 private:
  void take(const rosbag::MessageInstance& message) {
    const std::string& topic = message.getTopic();
    seen_.insert(topic);
    if (topic == topics_.imu) return take_imu(message);
    if (topic == topics_.left) return take_image(message, "cam0");
    if (topic == topics_.right) return take_image(message, "cam1");
    if (topic == topics_.wheels) return take_wheels(message);
    for (std::size_t i = 0; i < topics_.beams.size(); ++i) {
      if (topic == topics_.beams[i]) take_beam(message, i);
    }
  }

  void take_imu(const rosbag::MessageInstance& message) {
    const auto imu = read<sensor_msgs::Imu>(message);
    const auto& w = imu->angular_velocity;
    const auto& a = imu->linear_acceleration;
    row("imu0", "#timestamp [ns],w_x [rad/s],w_y [rad/s],w_z [rad/s],a_x [m/s^2],a_y [m/s^2],a_z [m/s^2]",
        stamp(message, imu->header), {w.x, w.y, w.z, a.x, a.y, a.z});
  }

  void take_wheels(const rosbag::MessageInstance& message) {
    const auto joints = read<sensor_msgs::JointState>(message);
    if (joints->position.size() < 2) throw wrong(message, "fewer than two angles");
    if (counts_per_turn_ == 0.0) {
      counts_per_turn_ = YamlMap::load(required_calibration("encoder0", message)).get<double>("resolution");
    }
    const auto count = [&](double angle) { return std::round(angle / kTurn * counts_per_turn_); };
    row("encoder0", "#timestamp [ns],left [count],right [count]", stamp(message, joints->header),
        {count(joints->position[0]), count(joints->position[1])});
  }

  void take_beam(const rosbag::MessageInstance& message, std::size_t beam) {
    if (ranges_.empty()) static_cast<void>(required_calibration("laser0", message));
    const auto range = read<sensor_msgs::Range>(message);
    auto& ranges = ranges_[stamp(message, range->header)];
    ranges.resize(topics_.beams.size(), std::nan(""));
    const auto value = static_cast<double>(range->range);
    ranges[beam] = std::isfinite(value) ? value : std::nan("");
  }

  void take_image(const rosbag::MessageInstance& message, const std::string& camera) {
    if (message.isType<sensor_msgs::CompressedImage>()) {
      const auto image = read<sensor_msgs::CompressedImage>(message);
      const std::string ending = image->format.find("png") != std::string::npos ? ".png" : ".jpg";
      write_image(camera, stamp(message, image->header), ending, "", image->data.data(), image->data.size(), 1,
                  image->data.size());
      return;
    }
    const auto image = read<sensor_msgs::Image>(message);
    if (image->encoding != "mono8" && image->encoding != "8UC1") {
      throw wrong(message, "encoding " + image->encoding + ", not mono8");
    }
    if (image->step < image->width || image->data.size() < std::size_t{image->step} * image->height) {
      throw wrong(message, "fewer pixels than its size says");
    }
    const std::string head = "P5\n" + std::to_string(image->width) + " " + std::to_string(image->height) + "\n255\n";
    write_image(camera, stamp(message, image->header), ".pgm", head, image->data.data(), image->width, image->height,
                image->step);
  }

  /// The head, and then `rows` rows of `width` bytes that lie `step` apart.
  void write_image(const std::string& camera, TimeNs t_ns, const std::string& ending, const std::string& head,
                   const std::uint8_t* data, std::size_t width, std::size_t rows, std::size_t step) {
    const std::string name = std::to_string(t_ns) + ending;
    row(camera, "#timestamp [ns],filename", t_ns, {}, name);
    std::ofstream image(mav0_ / camera / "data" / name, std::ios::binary);
    image << head;
    for (std::size_t y = 0; y < rows; ++y) {
      image.write(reinterpret_cast<const char*>(data + y * step), static_cast<std::streamsize>(width));
    }
    if (!image.flush()) throw InputError(located(mav0_ / camera / "data" / name, 0, "", "cannot be written"));
  }

  void write_ranges() {
    for (const auto& [t_ns, ranges] : ranges_) {
      row("laser0", "#timestamp [ns],beam_0 [m],beam_1 [m],beam_2 [m]", t_ns, ranges);
    }
  }

  /// Appends a line to the sensor's data.csv; begins it, with the calibration beside it, at the first.
  void row(const std::string& sensor, const std::string& heading, TimeNs t_ns, const std::vector<double>& values,
           const std::string& text = "") {
    std::ofstream& file = files_[sensor];
    if (!file.is_open()) {
      const fs::path folder = mav0_ / sensor;
      fs::create_directories(folder / "data");
      const fs::path calibration = calibration_ / sensor / "sensor.yaml";
      if (fs::exists(calibration)) fs::copy_file(calibration, folder / "sensor.yaml");
      file.open(folder / "data.csv");
      file << heading << "\n";
    }
    file << t_ns;
    for (const double value : values) {
      std::array<char, 32> number{};
      std::snprintf(number.data(), number.size(), ",%.17g", value);
      file << number.data();
    }
    if (!text.empty()) file << "," << text;
    if (!(file << "\n")) throw InputError(located(mav0_ / sensor / "data.csv", 0, "", "cannot be written"));
  }

  /// The sensor's stamp; without one, when it was recorded.
  static TimeNs stamp(const rosbag::MessageInstance& message, const std_msgs::Header& header) {
    return header.stamp.isZero() ? nanoseconds(message.getTime()) : nanoseconds(header.stamp);
  }

  [[nodiscard]] fs::path required_calibration(const std::string& sensor, const rosbag::MessageInstance& message) const {
    const fs::path file = calibration_ / sensor / "sensor.yaml";
    if (!fs::exists(file)) throw wrong(message, "no calibration: " + file.string() + " does not exist");
    return file;
  }

  template <typename Message>
  [[nodiscard]] boost::shared_ptr<Message> read(const rosbag::MessageInstance& message) const {
    if (!message.isType<Message>()) throw wrong(message, "is of type " + message.getDataType());
    return message.instantiate<Message>();
  }

  [[nodiscard]] InputError wrong(const rosbag::MessageInstance& message, const std::string& what) const {
    return InputError(located(file_, 0, message.getTopic(), what));
  }

  fs::path file_;
  BagTopics topics_;
  fs::path mav0_;
  fs::path calibration_;
  std::set<std::string> seen_;
  std::map<std::string, std::ofstream> files_;    ///< data.csv by sensor
  std::map<TimeNs, std::vector<double>> ranges_;  ///< all beams of one stamp
  double counts_per_turn_ = 0.0;
};

}  // namespace

void unpack_bag(const fs::path& bag, const BagTopics& topics, const fs::path& folder) {
  if (!fs::is_regular_file(bag)) throw InputError(located(bag, 0, "", "no such file"));
  Unpacker(bag, topics, folder).run();
}

}  // namespace ear
