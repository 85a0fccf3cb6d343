// What comes over a MAVLink line: any bytes, in pieces. First byte: where they are cut, and what follows them. Packets
// that are found must be whole ones, and their sensors' values go through everything that a live process does with
// them.
#include <cmath>

#include "src/live/mavlink_sensors.h"
#include "tests/fuzz/support.h"

namespace {

using namespace ear;

Calibration vehicle() {
  Calibration calibration;
  calibration.encoder.emplace();
  calibration.lasers.emplace();
  calibration.lasers->beams.resize(2);
  return calibration;
}

void check(const mavlink::Packet& packet) {
  fuzz::require(packet.payload.type.length <= packet.payload.bytes.size(), "a payload fits");
  const std::vector<std::uint8_t> bytes = to_bytes(packet);
  const std::vector<mavlink::Packet> again = mavlink::Parser{}.add(bytes.data(), bytes.size());
  fuzz::require(again.size() == 1, "a packet can be sent on");
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const live::LiveClock kClock;
  static live::LiveEstimator estimator(Config{}, vehicle(), {}, {});
  static live::Intake intake(estimator, vehicle(), kClock, {});
  live::MavlinkSensors sensors(
      {data[0] % 2 == 0 ? live::MavlinkInputs::Imu::highres : live::MavlinkInputs::Imu::scaled, true, {0, 7}}, intake);
  for (int i = 0; i < 12; ++i) {  // synchronised, so that stamps count
    const TimeNs now = kClock.now();
    sensors.take({{1, 1}, 0, to_payload(mavlink::TimeSync{1'000'000 + now % 1'000'000'000, now, 1, 1})});
  }
  mavlink::Parser parser;
  const std::size_t cut = 1 + data[0] % size;
  for (const auto& [begin, end] : {std::pair{std::size_t{1}, cut}, std::pair{cut, size}}) {
    if (end <= begin) continue;
    for (const mavlink::Packet& packet : parser.add(data + begin, end - begin)) {
      check(packet);
      sensors.take(packet);
    }
  }
  static_cast<void>(sensors.look());
  return 0;
}
