#include "src/ros2/outgoing.h"

#include <cmath>
#include <limits>

namespace ear::ros2 {
namespace {

Vector3 message(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Imu imu_message(const ImuSample& sample) {
  Imu imu;
  imu.header = {time_of_stamp(sample.t_ns), "imu0"};
  imu.orientation_covariance[0] = -1.0;  // none is given
  imu.angular_velocity = message(sample.gyro_B);
  imu.linear_acceleration = message(sample.accel_B);
  return imu;
}

JointState joint_message(const EncoderSample& sample, std::int64_t resolution) {
  const double per_count = 2.0 * M_PI / static_cast<double>(resolution);
  JointState joints;
  joints.header = {time_of_stamp(sample.t_ns), "base_link"};
  joints.name = {"left", "right"};
  joints.position = {per_count * static_cast<double>(sample.left_count),
                     per_count * static_cast<double>(sample.right_count)};
  return joints;
}

Range range_message(const LaserSample& sample, std::size_t beam, const LaserCalibration& lasers) {
  Range range;
  range.header = {time_of_stamp(sample.t_ns), "laser0_" + std::to_string(beam)};
  range.radiation_type = Range::kInfrared;
  range.min_range = static_cast<float>(lasers.range_min);
  range.max_range = static_cast<float>(lasers.range_max);
  range.range = std::isfinite(sample.range[beam]) ? static_cast<float>(sample.range[beam])
                                                  : std::numeric_limits<float>::infinity();
  return range;
}

Image image_message(const ImageView& image, std::size_t camera, TimeNs t_ns) {
  Image message;
  message.header = {time_of_stamp(t_ns), "cam" + std::to_string(camera)};
  message.width = static_cast<std::uint32_t>(image.width);
  message.height = static_cast<std::uint32_t>(image.height);
  message.step = message.width;
  message.encoding = "mono8";
  message.data.reserve(std::size_t{message.step} * message.height);
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* const row = image.data + y * image.stride;
    message.data.insert(message.data.end(), row, row + image.width);
  }
  return message;
}

Pose pose_message(const Eigen::Quaterniond& q, const Eigen::Vector3d& p) {
  return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

}  // namespace ear::ros2
