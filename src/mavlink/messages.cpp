#include "src/mavlink/messages.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace ear::mavlink {
namespace {

constexpr std::uint8_t kTypeOnboardController = 18;   // MAV_TYPE
constexpr std::uint8_t kAutopilotInvalid = 8;         // MAV_AUTOPILOT: this is not a flight controller
constexpr std::uint8_t kMavlinkVersion = 3;           // of the dialect; the same in MAVLink 1 and 2
constexpr std::uint8_t kFrameBodyFrd = 12;            // MAV_FRAME
constexpr std::uint8_t kFrameLocalFrd = 20;           // MAV_FRAME
constexpr std::uint8_t kEstimatorVisualInertial = 3;  // MAV_ESTIMATOR_TYPE
constexpr std::uint16_t kAccelAndGyroUpdated = 0x3F;  // HIGHRES_IMU_UPDATED_FLAGS
constexpr std::uint8_t kFacesDown = 25;               // MAV_SENSOR_ROTATION_PITCH_270
constexpr double kStandardGravity = 9.80665;          // [m/s^2] what the unit G of SCALED_IMU means

/// Appends little-endian numbers to a payload, whatever the byte order of this machine.
class Writer {
 public:
  explicit Writer(const MessageType& type) { payload_.type = type; }

  template <typename Unsigned>
  Writer& put(Unsigned value) {
    static_assert(std::is_unsigned_v<Unsigned>);
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
      payload_.bytes[at_++] = static_cast<std::uint8_t>(value >> (8 * i) & 0xFFU);
    }
    return *this;
  }

  Writer& put_float(double value) {
    static_assert(sizeof(float) == sizeof(std::uint32_t));
    const float narrow = static_cast<float>(value);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &narrow, sizeof(bits));
    return put(bits);
  }

  Writer& put_double(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    return put(bits);
  }

  Writer& put_floats(const Eigen::Vector3d& v) { return put_float(v.x()).put_float(v.y()).put_float(v.z()); }

  /// Row by row, each from the diagonal on.
  Writer& put_upper_triangle(const Matrix6d& m) {
    for (int row = 0; row < m.rows(); ++row) {
      for (int column = row; column < m.cols(); ++column) put_float(m(row, column));
    }
    return *this;
  }

  [[nodiscard]] Payload done() const {
    assert(at_ <= payload_.type.length);  // what is left is zero
    return payload_;
  }

 private:
  Payload payload_;
  std::size_t at_ = 0;
};

/// Takes little-endian numbers out of a payload, one after the other.
class Reader {
 public:
  explicit Reader(const Payload& payload) : payload_(payload) {}

  template <typename Unsigned>
  Unsigned get() {
    static_assert(std::is_unsigned_v<Unsigned>);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
      value |= static_cast<std::uint64_t>(payload_.bytes[at_++]) << (8 * i);
    }
    return static_cast<Unsigned>(value);
  }

  template <typename Number>
  Number get_bits_of() {
    using Bits = std::conditional_t<sizeof(Number) == 8, std::uint64_t,
                                    std::conditional_t<sizeof(Number) == 4, std::uint32_t, std::uint16_t>>;
    const Bits bits = get<Bits>();
    Number number{};
    std::memcpy(&number, &bits, sizeof(number));
    return number;
  }

  /// Three numbers of a type, each times `unit`.
  template <typename Number>
  Eigen::Vector3d get_vector(double unit) {
    const double x = get_bits_of<Number>(), y = get_bits_of<Number>(), z = get_bits_of<Number>();
    return Eigen::Vector3d(x, y, z) * unit;
  }

  Reader& skip(std::size_t bytes) {
    at_ += bytes;
    return *this;
  }

 private:
  const Payload& payload_;
  std::size_t at_ = 0;
};

/// A time that does not fit the sign is none, and is refused with its sample.
std::int64_t signed_time(std::uint64_t time) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(time, std::numeric_limits<std::int64_t>::max()));
}

}  // namespace

Payload to_payload(const Heartbeat& message) {
  return Writer(kHeartbeatType)
      .put(std::uint32_t{0})  // custom mode
      .put(kTypeOnboardController)
      .put(kAutopilotInvalid)
      .put(std::uint8_t{0})  // base mode
      .put(static_cast<std::uint8_t>(message.state))
      .put(kMavlinkVersion)
      .done();
}

Payload to_payload(const TimeSync& message) {
  return Writer(kTimeSyncType)
      .put(static_cast<std::uint64_t>(message.tc1))
      .put(static_cast<std::uint64_t>(message.ts1))
      .put(message.target_system)
      .put(message.target_component)
      .done();
}

Payload to_payload(const StatusText& message) {
  Writer writer(kStatusTextType);
  writer.put(static_cast<std::uint8_t>(message.severity));
  for (const char letter : message.text.substr(0, StatusText::kMaxLength)) {
    writer.put(static_cast<std::uint8_t>(letter));
  }
  return writer.done();
}

Payload to_payload(const OdometryMessage& message) {
  const Eigen::Quaterniond& q = message.q_LV;
  return Writer(kOdometryType)
      .put(message.time_us)
      .put_floats(message.p_L)
      .put_float(q.w())
      .put_floats(q.vec())
      .put_floats(message.v_V)
      .put_floats(message.w_V)
      .put_upper_triangle(message.pose_covariance)
      .put_upper_triangle(message.velocity_covariance)
      .put(kFrameLocalFrd)
      .put(kFrameBodyFrd)
      .put(message.reset_counter)
      .put(kEstimatorVisualInertial)
      .put(static_cast<std::uint8_t>(message.quality))
      .done();
}

Payload to_payload(const ImuMessage& message) {
  Writer writer(kHighresImuType);
  writer.put(static_cast<std::uint64_t>(message.time_us)).put_floats(message.accel).put_floats(message.gyro);
  for (int i = 0; i < 7; ++i) writer.put_float(0.0);  // magnetic field, pressures, altitude, temperature
  return writer.put(kAccelAndGyroUpdated).put(message.id).done();
}

Payload to_payload(const WheelDistance& message) {
  Writer writer(kWheelDistanceType);
  writer.put(static_cast<std::uint64_t>(message.time_us));
  for (const double distance : message.distance) writer.put_double(distance);
  return writer.put(message.count).done();
}

Payload to_payload(const DistanceSensor& message) {
  const auto centimetres = [](double metres) { return static_cast<std::uint16_t>(std::lround(100.0 * metres)); };
  Writer writer(kDistanceSensorType);
  writer.put(static_cast<std::uint32_t>(message.time_ms))
      .put(centimetres(message.least))
      .put(centimetres(message.most))
      .put(centimetres(message.distance))
      .put(std::uint8_t{0})  // MAV_DISTANCE_SENSOR_LASER
      .put(message.id)
      .put(kFacesDown)
      .put(std::uint8_t{255});                        // covariance: not known
  for (int i = 0; i < 6; ++i) writer.put_float(0.0);  // fields of view, quaternion
  return writer.put(message.signal_quality).done();
}

std::optional<ImuMessage> to_highres_imu(const Payload& payload) {
  if (payload.type.id != kHighresImuType.id) return std::nullopt;
  Reader reader(payload);
  ImuMessage message;
  message.time_us = signed_time(reader.get<std::uint64_t>());
  message.accel = reader.get_vector<float>(1.0);
  message.gyro = reader.get_vector<float>(1.0);
  message.id = reader.skip(7 * sizeof(float) + sizeof(std::uint16_t)).get<std::uint8_t>();
  return message;
}

std::optional<ImuMessage> to_scaled_imu(const Payload& payload) {
  if (payload.type.id != kScaledImuType.id) return std::nullopt;
  Reader reader(payload);
  ImuMessage message;
  message.time_us = 1000 * static_cast<std::int64_t>(reader.get<std::uint32_t>());
  message.accel = reader.get_vector<std::int16_t>(1e-3 * kStandardGravity);
  message.gyro = reader.get_vector<std::int16_t>(1e-3);
  return message;
}

std::optional<WheelDistance> to_wheel_distance(const Payload& payload) {
  if (payload.type.id != kWheelDistanceType.id) return std::nullopt;
  Reader reader(payload);
  WheelDistance message;
  message.time_us = signed_time(reader.get<std::uint64_t>());
  for (double& distance : message.distance) distance = reader.get_bits_of<double>();
  message.count = reader.get<std::uint8_t>();
  return message;
}

std::optional<DistanceSensor> to_distance_sensor(const Payload& payload) {
  if (payload.type.id != kDistanceSensorType.id) return std::nullopt;
  Reader reader(payload);
  DistanceSensor message;
  message.time_ms = reader.get<std::uint32_t>();
  message.least = 0.01 * reader.get<std::uint16_t>();
  message.most = 0.01 * reader.get<std::uint16_t>();
  message.distance = 0.01 * reader.get<std::uint16_t>();
  message.id = reader.skip(1).get<std::uint8_t>();
  message.signal_quality = reader.skip(2 + 6 * sizeof(float)).get<std::uint8_t>();
  return message;
}

std::optional<TimeSync> to_time_sync(const Payload& payload) {
  if (payload.type.id != kTimeSyncType.id) return std::nullopt;
  Reader reader(payload);
  TimeSync message;
  message.tc1 = static_cast<std::int64_t>(reader.get<std::uint64_t>());
  message.ts1 = static_cast<std::int64_t>(reader.get<std::uint64_t>());
  message.target_system = reader.get<std::uint8_t>();
  message.target_component = reader.get<std::uint8_t>();
  return message;
}

}  // namespace ear::mavlink
