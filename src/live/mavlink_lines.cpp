#include "src/live/mavlink_lines.h"

#include <cmath>
#include <utility>

#include "src/mavlink/odometry_message.h"
#include "src/recording/input_error.h"

namespace ear::live {
namespace {

Eigen::Matrix3d mounting(const MavlinkSettings& settings, const Calibration& calibration) {
  constexpr double kPerDegree = M_PI / 180.0;
  if (settings.mounting_deg) {
    const auto& [roll, pitch, yaw] = *settings.mounting_deg;
    return mavlink::mounting_of(roll * kPerDegree, pitch * kPerDegree, yaw * kPerDegree);
  }
  if (calibration.encoder) return mavlink::mounting_of(*calibration.encoder);
  throw InputError("mavlink: mounting_deg: how does the IMU sit in the vehicle? Without wheels nothing else says so");
}

}  // namespace

MavlinkLines::MavlinkLines(const std::vector<MavlinkSettings>& settings, Intake& intake) {
  for (const MavlinkSettings& one : settings) {
    Line line;
    mavlink::LinkListener listener;
    if (one.inputs.any()) {
      line.sensors = std::make_unique<MavlinkSensors>(one.inputs, intake);
      listener.on_packet = [sensors = line.sensors.get()](const mavlink::Packet& packet) { sensors->take(packet); };
      listener.asks_time = true;
    }
    const mavlink::Sender self{static_cast<std::uint8_t>(one.system)};
    const LiveClock& clock = intake.clock();
    line.link = std::make_unique<mavlink::Link>(
        one.address, self, [&clock] { return clock.now(); }, listener);
    if (one.send) {
      line.output =
          std::make_unique<MavlinkOutput>(*line.link, mounting(one, intake.calibration()), intake.calibration().imu);
    }
    lines_.push_back(std::move(line));
  }
}

void MavlinkLines::take(const LiveSample& sample) {
  for (Line& line : lines_) {
    if (line.output) line.output->take(sample);
  }
}

void MavlinkLines::take(const LiveFrame& frame) {
  for (Line& line : lines_) {
    if (line.output) line.output->take(frame);
  }
}

std::vector<std::string> MavlinkLines::look() {
  std::vector<std::string> words;
  for (Line& line : lines_) {
    if (!line.sensors) continue;
    for (std::string& text : line.sensors->look()) words.push_back(std::move(text));
  }
  return words;
}

}  // namespace ear::live
