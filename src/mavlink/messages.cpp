#include "src/mavlink/messages.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace ear::mavlink {
namespace {

constexpr std::uint8_t kTypeOnboardController = 18;   // MAV_TYPE
constexpr std::uint8_t kAutopilotInvalid = 8;         // MAV_AUTOPILOT: this is not a flight controller
constexpr std::uint8_t kMavlinkVersion = 3;           // of the dialect; the same in MAVLink 1 and 2
constexpr std::uint8_t kFrameBodyFrd = 12;            // MAV_FRAME
constexpr std::uint8_t kFrameLocalFrd = 20;           // MAV_FRAME
constexpr std::uint8_t kEstimatorVisualInertial = 3;  // MAV_ESTIMATOR_TYPE

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

std::uint64_t read_u64(const std::uint8_t* bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(value); ++i) value |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
  return value;
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

std::optional<TimeSync> to_time_sync(const Payload& payload) {
  if (payload.type.id != kTimeSyncType.id) return std::nullopt;
  return TimeSync{static_cast<std::int64_t>(read_u64(payload.bytes.data())),
                  static_cast<std::int64_t>(read_u64(payload.bytes.data() + 8)), payload.bytes[16], payload.bytes[17]};
}

}  // namespace ear::mavlink
