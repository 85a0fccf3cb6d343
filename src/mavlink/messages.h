// The few MAVLink messages that this project sends or reads, and their payloads: own words out, sensors in. Fields,
// their order on the wire and the numbers are those of MAVLink's common.xml
// (https://mavlink.io/en/messages/common.html). docs/mavlink.md has the reasons.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace ear::mavlink {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// What both ends must agree on for a message: its number, the seed of its checksum, the length of its payload.
struct MessageType {
  std::uint32_t id = 0;
  std::uint8_t crc_extra = 0;
  std::size_t length = 0;
};

inline constexpr MessageType kHeartbeatType{0, 50, 9};
inline constexpr MessageType kTimeSyncType{111, 34, 18};
inline constexpr MessageType kScaledImuType{26, 170, 24};
inline constexpr MessageType kHighresImuType{105, 93, 63};
inline constexpr MessageType kDistanceSensorType{132, 85, 39};
inline constexpr MessageType kStatusTextType{253, 83, 54};
inline constexpr MessageType kWheelDistanceType{9000, 113, 137};
inline constexpr MessageType kOdometryType{331, 91, 233};

/// The bytes of one message, zeros at its end included.
struct Payload {
  MessageType type;
  std::array<std::uint8_t, 255> bytes{};
};

/// MAV_STATE.
enum class SystemState : std::uint8_t { calibrating = 2, active = 4, critical = 5 };

/// MAV_SEVERITY.
enum class Severity : std::uint8_t { critical = 2, warning = 4, notice = 5 };

/// "I am here": type MAV_TYPE_ONBOARD_CONTROLLER, autopilot MAV_AUTOPILOT_INVALID.
struct Heartbeat {
  SystemState state = SystemState::calibrating;
};

/// A request (tc1 = 0) for the time of whoever is addressed, or the answer to one.
struct TimeSync {
  std::int64_t tc1 = 0;               ///< time of the one who answers [ns]
  std::int64_t ts1 = 0;               ///< time of the one who asked [ns]; sent back unchanged
  std::uint8_t target_system = 0;     ///< 0: all
  std::uint8_t target_component = 0;  ///< 0: all
};

/// A line for the pilot's screen.
struct StatusText {
  static constexpr std::size_t kMaxLength = 50;
  Severity severity = Severity::notice;
  std::string text;  ///< what is longer than kMaxLength is cut
};

/// Pose and twist of a vehicle. L: local frame, fixed to the ground, x forward, y right, z down (MAV_FRAME_LOCAL_FRD).
/// V: the vehicle, x forward, y right, z down (MAV_FRAME_BODY_FRD). Estimator type MAV_ESTIMATOR_TYPE_VIO.
struct OdometryMessage {
  std::uint64_t time_us = 0;                        ///< when the sensors saw it [us]
  Eigen::Vector3d p_L = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Quaterniond q_LV{1.0, 0.0, 0.0, 0.0};      ///< vehicle to local frame
  Eigen::Vector3d v_V = Eigen::Vector3d::Zero();    ///< [m/s]
  Eigen::Vector3d w_V = Eigen::Vector3d::Zero();    ///< angular rate [rad/s]
  Matrix6d pose_covariance = Matrix6d::Zero();      ///< of p_L [m], and rotation about V's axes [rad]
  Matrix6d velocity_covariance = Matrix6d::Zero();  ///< of v_V [m/s], w_V [rad/s]
  std::uint8_t reset_counter = 0;                   ///< grows when the estimate starts anew
  std::int8_t quality = 0;                          ///< -1: failed, 0: unknown, 1 ... 100 [%]
};

/// What a flight controller's IMU measures, in SI: HIGHRES_IMU, or SCALED_IMU with its coarser steps. Axes as sent.
struct ImuMessage {
  std::int64_t time_us = 0;                         ///< since the sender started, or since 1970
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< [m/s^2]
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< [rad/s]
  std::uint8_t id = 0;                              ///< of HIGHRES_IMU
};

/// WHEEL_DISTANCE: what each wheel rolled since the start.
struct WheelDistance {
  static constexpr std::size_t kMost = 16;
  std::int64_t time_us = 0;
  std::array<double, kMost> distance{};  ///< [m] forward is positive
  std::uint8_t count = 0;                ///< wheels
};

/// DISTANCE_SENSOR, in metres.
struct DistanceSensor {
  std::int64_t time_ms = 0;  ///< since the sender started
  double distance = 0.0;     ///< [m]
  double least = 0.0;        ///< [m] that it measures
  double most = 0.0;         ///< [m]
  std::uint8_t id = 0;
  std::uint8_t signal_quality = 0;  ///< 1: no return; 0: not told
};

[[nodiscard]] Payload to_payload(const Heartbeat& message);
[[nodiscard]] Payload to_payload(const TimeSync& message);
[[nodiscard]] Payload to_payload(const StatusText& message);
[[nodiscard]] Payload to_payload(const OdometryMessage& message);

/// As HIGHRES_IMU.
[[nodiscard]] Payload to_payload(const ImuMessage& message);
[[nodiscard]] Payload to_payload(const WheelDistance& message);
[[nodiscard]] Payload to_payload(const DistanceSensor& message);

/// HIGHRES_IMU.
[[nodiscard]] std::optional<ImuMessage> to_highres_imu(const Payload& payload);
/// SCALED_IMU: milli-g and mrad/s to SI.
[[nodiscard]] std::optional<ImuMessage> to_scaled_imu(const Payload& payload);
[[nodiscard]] std::optional<WheelDistance> to_wheel_distance(const Payload& payload);
[[nodiscard]] std::optional<DistanceSensor> to_distance_sensor(const Payload& payload);

/// The TIMESYNC in a payload; as the four above, nothing if it is another message.
[[nodiscard]] std::optional<TimeSync> to_time_sync(const Payload& payload);

}  // namespace ear::mavlink
