// The ROS 2 messages that are read and written, as plain structs. Fields, order and units are those of the published
// definitions (ROS 2 Humble); src/ros2/cdr.h turns them into bytes and back, src/ros2/definition.h into their text.
//
// Each struct names its type (kType) and shows its fields, in the order of the wire, to a visitor: v("name", field).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ear/types.h"

namespace ear::ros2 {

/// builtin_interfaces/msg/Time.
struct Time {
  static constexpr const char* kType = "builtin_interfaces/msg/Time";
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("sec", self.sec);
    v("nanosec", self.nanosec);
  }
};

/// Nanoseconds of a message's time, of any fields whatever.
[[nodiscard]] constexpr TimeNs nanoseconds(const Time& time) {
  return TimeNs{time.sec} * 1'000'000'000 + TimeNs{time.nanosec};
}

/// The message's time of a stamp. Throws InputError for a stamp before 1970 or after 2038, which it cannot hold.
[[nodiscard]] Time time_of_stamp(TimeNs t_ns);

struct Header {
  static constexpr const char* kType = "std_msgs/msg/Header";
  Time stamp;
  std::string frame_id;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("stamp", self.stamp);
    v("frame_id", self.frame_id);
  }
};

struct Vector3 {
  static constexpr const char* kType = "geometry_msgs/msg/Vector3";
  double x = 0.0, y = 0.0, z = 0.0;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("x", self.x);
    v("y", self.y);
    v("z", self.z);
  }
};

struct Point {
  static constexpr const char* kType = "geometry_msgs/msg/Point";
  double x = 0.0, y = 0.0, z = 0.0;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("x", self.x);
    v("y", self.y);
    v("z", self.z);
  }
};

struct Quaternion {
  static constexpr const char* kType = "geometry_msgs/msg/Quaternion";
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("x", self.x);
    v("y", self.y);
    v("z", self.z);
    v("w", self.w);
  }
};

struct Pose {
  static constexpr const char* kType = "geometry_msgs/msg/Pose";
  Point position;
  Quaternion orientation;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("position", self.position);
    v("orientation", self.orientation);
  }
};

struct PoseStamped {
  static constexpr const char* kType = "geometry_msgs/msg/PoseStamped";
  Header header;
  Pose pose;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("pose", self.pose);
  }
};

/// Covariances are row by row: x, y, z, and rotations about them.
struct PoseWithCovariance {
  static constexpr const char* kType = "geometry_msgs/msg/PoseWithCovariance";
  Pose pose;
  std::array<double, 36> covariance{};
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("pose", self.pose);
    v("covariance", self.covariance);
  }
};

struct Twist {
  static constexpr const char* kType = "geometry_msgs/msg/Twist";
  Vector3 linear;   ///< [m/s]
  Vector3 angular;  ///< [rad/s]
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("linear", self.linear);
    v("angular", self.angular);
  }
};

struct TwistWithCovariance {
  static constexpr const char* kType = "geometry_msgs/msg/TwistWithCovariance";
  Twist twist;
  std::array<double, 36> covariance{};
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("twist", self.twist);
    v("covariance", self.covariance);
  }
};

struct Transform {
  static constexpr const char* kType = "geometry_msgs/msg/Transform";
  Vector3 translation;
  Quaternion rotation;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("translation", self.translation);
    v("rotation", self.rotation);
  }
};

/// Takes coordinates from the child's frame to the header's.
struct TransformStamped {
  static constexpr const char* kType = "geometry_msgs/msg/TransformStamped";
  Header header;
  std::string child_frame_id;
  Transform transform;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("child_frame_id", self.child_frame_id);
    v("transform", self.transform);
  }
};

struct TfMessage {
  static constexpr const char* kType = "tf2_msgs/msg/TFMessage";
  std::vector<TransformStamped> transforms;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("transforms", self.transforms);
  }
};

struct Image {
  static constexpr const char* kType = "sensor_msgs/msg/Image";
  Header header;
  std::uint32_t height = 0, width = 0;  ///< [px]
  std::string encoding;                 ///< "mono8", "bgr8", ...
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< bytes from one row to the next
  std::vector<std::uint8_t> data;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("height", self.height);
    v("width", self.width);
    v("encoding", self.encoding);
    v("is_bigendian", self.is_bigendian);
    v("step", self.step);
    v("data", self.data);
  }
};

struct CompressedImage {
  static constexpr const char* kType = "sensor_msgs/msg/CompressedImage";
  Header header;
  std::string format;              ///< "jpeg", "mono8; png compressed ", ...
  std::vector<std::uint8_t> data;  ///< a file's bytes
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("format", self.format);
    v("data", self.data);
  }
};

struct RegionOfInterest {
  static constexpr const char* kType = "sensor_msgs/msg/RegionOfInterest";
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("x_offset", self.x_offset);
    v("y_offset", self.y_offset);
    v("height", self.height);
    v("width", self.width);
    v("do_rectify", self.do_rectify);
  }
};

/// Matrices row by row: k and d of the raw image, r and p of the rectified one.
struct CameraInfo {
  static constexpr const char* kType = "sensor_msgs/msg/CameraInfo";
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("height", self.height);
    v("width", self.width);
    v("distortion_model", self.distortion_model);
    v("d", self.d);
    v("k", self.k);
    v("r", self.r);
    v("p", self.p);
    v("binning_x", self.binning_x);
    v("binning_y", self.binning_y);
    v("roi", self.roi);
  }
};

struct Imu {
  static constexpr const char* kType = "sensor_msgs/msg/Imu";
  Header header;
  Quaternion orientation;
  std::array<double, 9> orientation_covariance{};
  Vector3 angular_velocity;  ///< [rad/s]
  std::array<double, 9> angular_velocity_covariance{};
  Vector3 linear_acceleration;  ///< specific force [m/s^2]
  std::array<double, 9> linear_acceleration_covariance{};
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("orientation", self.orientation);
    v("orientation_covariance", self.orientation_covariance);
    v("angular_velocity", self.angular_velocity);
    v("angular_velocity_covariance", self.angular_velocity_covariance);
    v("linear_acceleration", self.linear_acceleration);
    v("linear_acceleration_covariance", self.linear_acceleration_covariance);
  }
};

struct JointState {
  static constexpr const char* kType = "sensor_msgs/msg/JointState";
  Header header;
  std::vector<std::string> name;
  std::vector<double> position;  ///< [rad]
  std::vector<double> velocity;  ///< [rad/s]
  std::vector<double> effort;    ///< [Nm]
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("name", self.name);
    v("position", self.position);
    v("velocity", self.velocity);
    v("effort", self.effort);
  }
};

/// Without the `variance` that distributions after Humble have behind the range.
struct Range {
  static constexpr const char* kType = "sensor_msgs/msg/Range";
  static constexpr std::uint8_t kInfrared = 1;
  Header header;
  std::uint8_t radiation_type = 0;
  float field_of_view = 0.0F;                ///< [rad]
  float min_range = 0.0F, max_range = 0.0F;  ///< [m]
  float range = 0.0F;                        ///< [m]; infinite: no return (REP-117)
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("radiation_type", self.radiation_type);
    v("field_of_view", self.field_of_view);
    v("min_range", self.min_range);
    v("max_range", self.max_range);
    v("range", self.range);
  }
};

struct LaserScan {
  static constexpr const char* kType = "sensor_msgs/msg/LaserScan";
  Header header;
  float angle_min = 0.0F, angle_max = 0.0F, angle_increment = 0.0F;  ///< [rad]
  float time_increment = 0.0F, scan_time = 0.0F;                     ///< [s]
  float range_min = 0.0F, range_max = 0.0F;                          ///< [m]
  std::vector<float> ranges;                                         ///< [m]
  std::vector<float> intensities;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("angle_min", self.angle_min);
    v("angle_max", self.angle_max);
    v("angle_increment", self.angle_increment);
    v("time_increment", self.time_increment);
    v("scan_time", self.scan_time);
    v("range_min", self.range_min);
    v("range_max", self.range_max);
    v("ranges", self.ranges);
    v("intensities", self.intensities);
  }
};

/// Pose in the header's frame, twist in the child's.
struct Odometry {
  static constexpr const char* kType = "nav_msgs/msg/Odometry";
  Header header;
  std::string child_frame_id;
  PoseWithCovariance pose;
  TwistWithCovariance twist;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("child_frame_id", self.child_frame_id);
    v("pose", self.pose);
    v("twist", self.twist);
  }
};

struct Path {
  static constexpr const char* kType = "nav_msgs/msg/Path";
  Header header;
  std::vector<PoseStamped> poses;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("poses", self.poses);
  }
};

struct KeyValue {
  static constexpr const char* kType = "diagnostic_msgs/msg/KeyValue";
  std::string key;
  std::string value;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("key", self.key);
    v("value", self.value);
  }
};

/// One bare octet: `byte` in definitions, where an unsigned number is `uint8`.
struct Octet {
  std::uint8_t value = 0;
};

struct DiagnosticStatus {
  static constexpr const char* kType = "diagnostic_msgs/msg/DiagnosticStatus";
  static constexpr Octet kOk{0}, kWarn{1}, kError{2}, kStale{3};
  Octet level;
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<KeyValue> values;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("level", self.level);
    v("name", self.name);
    v("message", self.message);
    v("hardware_id", self.hardware_id);
    v("values", self.values);
  }
};

struct DiagnosticArray {
  static constexpr const char* kType = "diagnostic_msgs/msg/DiagnosticArray";
  Header header;
  std::vector<DiagnosticStatus> status;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("status", self.status);
  }
};

/// std_msgs/msg/String.
struct Text {
  static constexpr const char* kType = "std_msgs/msg/String";
  std::string data;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor& v) {
    v("data", self.data);
  }
};

}  // namespace ear::ros2
