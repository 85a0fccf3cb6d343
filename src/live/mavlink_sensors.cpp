#include "src/live/mavlink_sensors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace ear::live {
namespace {

constexpr double kFarFromNow = 1.0;         // [s] of a stamp: it is of another clock than the one that answers
constexpr std::uint8_t kNoReturn = 1;       // DISTANCE_SENSOR.signal_quality: invalid
constexpr double kLargestDistance = 1e9;    // [m] of a wheel
constexpr std::uint64_t kManyWithout = 50;  // samples before words about a clock that does not answer

/// What a wheel rolled, as its encoder would have counted it.
std::int64_t counts(double distance, double radius, std::int64_t resolution) {
  return std::llround(distance / (2.0 * M_PI * radius) * static_cast<double>(resolution));
}

}  // namespace

MavlinkSensors::MavlinkSensors(MavlinkInputs inputs, Intake& intake) : inputs_(std::move(inputs)), intake_(intake) {
  const Calibration& calibration = intake.calibration();
  if (inputs_.wheels && !calibration.encoder) {
    throw std::invalid_argument("mavlink: wheels are asked for, and the calibration has none");
  }
  const std::size_t beams = calibration.lasers ? calibration.lasers->beams.size() : 0;
  if (!inputs_.range_ids.empty() && inputs_.range_ids.size() != beams) {
    throw std::invalid_argument("mavlink: " + std::to_string(inputs_.range_ids.size()) +
                                " ranges are asked for, and the calibration has " + std::to_string(beams) + " beams");
  }
  ranges_.range.fill(std::numeric_limits<double>::quiet_NaN());
}

void MavlinkSensors::take(const mavlink::Packet& packet) {
  const mavlink::Payload& payload = packet.payload;
  if (const auto answer = mavlink::to_time_sync(payload)) {
    if (answer->tc1 != 0) take_answer(*answer);
    return;
  }
  const bool highres = inputs_.imu == MavlinkInputs::Imu::highres;
  const bool scaled = inputs_.imu == MavlinkInputs::Imu::scaled;
  if (const auto imu = highres ? mavlink::to_highres_imu(payload) : std::nullopt; imu && imu->id == 0) take(*imu);
  if (const auto imu = scaled ? mavlink::to_scaled_imu(payload) : std::nullopt) take(*imu);
  if (const auto wheels = inputs_.wheels ? mavlink::to_wheel_distance(payload) : std::nullopt) take(*wheels);
  if (inputs_.range_ids.empty()) return;
  if (const auto range = mavlink::to_distance_sensor(payload)) take(*range);
}

void MavlinkSensors::take_answer(const mavlink::TimeSync& answer) {
  clock_.add(answer.ts1, answer.tc1, intake_.clock().now());
  clock_steps_ = clock_.steps();
  synchronised_ = clock_.ready();
}

std::optional<TimeNs> MavlinkSensors::our_time(std::int64_t stamp, std::int64_t unit_ns) {
  if (stamp < 0 || stamp > kLargestStamp / unit_ns) {
    ++other_clock_;
    return std::nullopt;
  }
  const std::optional<TimeNs> ours = clock_.to_ours(stamp * unit_ns);
  if (!ours) {
    ++without_clock_;
    return std::nullopt;
  }
  if (std::abs(seconds_between(*ours, intake_.clock().now())) < kFarFromNow) return ours;
  ++other_clock_;
  return std::nullopt;
}

void MavlinkSensors::take(const mavlink::ImuMessage& message) {
  if (const auto t_ns = our_time(message.time_us, 1000)) intake_.add(ImuSample{*t_ns, message.gyro, message.accel});
}

void MavlinkSensors::take(const mavlink::WheelDistance& message) {
  const auto is_distance = [](double distance) { return std::abs(distance) < kLargestDistance; };
  if (message.count < 2 || !is_distance(message.distance[0]) || !is_distance(message.distance[1])) return;
  const auto t_ns = our_time(message.time_us, 1000);
  if (!t_ns) return;
  const EncoderCalibration& encoder = *intake_.calibration().encoder;
  intake_.add(EncoderSample{*t_ns, counts(message.distance[0], encoder.wheel_radius[0], encoder.resolution),
                            counts(message.distance[1], encoder.wheel_radius[1], encoder.resolution)});
}

/// Each beam has a message of its own. A reading is complete when all beams came, or one of them again.
void MavlinkSensors::take(const mavlink::DistanceSensor& message) {
  const auto known = std::find(inputs_.range_ids.begin(), inputs_.range_ids.end(), int{message.id});
  if (known == inputs_.range_ids.end()) return;
  const auto t_ns = our_time(message.time_ms, 1'000'000);
  if (!t_ns) return;
  const auto beam = static_cast<std::size_t>(known - inputs_.range_ids.begin());
  const auto hand_in = [this] {
    intake_.add(ranges_);
    ranges_.range.fill(std::numeric_limits<double>::quiet_NaN());
    beams_seen_ = 0;
  };
  if ((beams_seen_ >> beam & 1U) != 0) hand_in();
  const bool no_return = message.signal_quality == kNoReturn || message.distance >= message.most;
  ranges_.range[beam] = no_return ? std::numeric_limits<double>::quiet_NaN() : message.distance;
  ranges_.t_ns = *t_ns;
  beams_seen_ |= 1U << beam;
  if (beams_seen_ == (1U << inputs_.range_ids.size()) - 1U) hand_in();
}

std::vector<std::string> MavlinkSensors::look() {
  std::vector<std::string> words;
  if (synchronised_ && !said_synchronised_) words.emplace_back("mavlink: the clocks are synchronised");
  if (!synchronised_ && without_clock_ >= said_without_ + kManyWithout) {
    words.push_back("mavlink: " + std::to_string(without_clock_) +
                    " samples passed over: too few answers to TIMESYNC yet");
    said_without_ = 10 * without_clock_;
  }
  if (other_clock_ > said_other_) {
    words.push_back("mavlink: " + std::to_string(other_clock_) +
                    " samples refused whose stamps are not of the clock that answers TIMESYNC");
    said_other_ = 10 * other_clock_;
  }
  if (clock_steps_ > said_steps_) words.emplace_back("mavlink: the sender's clock was set: has it restarted?");
  said_synchronised_ = synchronised_;
  said_steps_ = clock_steps_;
  return words;
}

}  // namespace ear::live
