#include "tools/flight_controller.h"

#include <CLI/CLI.hpp>

#include <array>
#include <cmath>
#include <cstdio>

#include "src/log/log.h"
#include "src/recording/input_error.h"

namespace ear::tools {
namespace {

Eigen::Matrix3d mounting(const FlightControllerArguments& args, const Calibration& calibration) {
  constexpr double kDegree = M_PI / 180.0;
  if (!args.mounting_deg.empty()) {
    const std::vector<double>& rpy = args.mounting_deg;
    return mavlink::mounting_of(rpy[0] * kDegree, rpy[1] * kDegree, rpy[2] * kDegree);
  }
  if (calibration.encoder) return mavlink::mounting_of(*calibration.encoder);
  throw InputError(
      "--mavlink: how does the IMU sit in the vehicle? Without wheels the recording does not say; --mavlink-mounting "
      "does");
}

}  // namespace

void add_options(CLI::App& command, FlightControllerArguments& args) {
  CLI::Option* mavlink = command.add_option(
      "--mavlink", args.address,
      "Send ODOMETRY to a flight controller, in real time: udp:HOST:PORT, udpin:HOST:PORT or serial:DEVICE:BAUD");
  command
      .add_option("--mavlink-mounting", args.mounting_deg,
                  "Roll, pitch, yaw of the IMU in the vehicle (x forward, y left, z up) [deg], if not the odometer's")
      ->delimiter(',')
      ->expected(3)
      ->needs(mavlink);
  command.add_option("--mavlink-system", args.system, "The vehicle's MAVLink system id")
      ->capture_default_str()
      ->check(CLI::Range(1, 255))
      ->needs(mavlink);
}

FlightController::FlightController(const FlightControllerArguments& args, const Calibration& calibration,
                                   TimeNs first_ns)
    : clock_(first_ns),
      stream_(mounting(args, calibration), calibration.imu),
      link_(args.address, {static_cast<std::uint8_t>(args.system)}, [this] { return clock_.now(); }) {
  announce(mavlink::LinkHealth::starting, {});
}

void FlightController::before_sample(const Sample& sample, const Odometry& odometry) {
  clock_.wait_until(time_of(sample));
  const auto* const imu = std::get_if<ImuSample>(&sample);
  if (imu == nullptr) return;
  if (last_imu_ns_ && stream_.wants_prediction(*last_imu_ns_)) {
    if (const auto state = odometry.predict(*last_imu_ns_)) link_.send(stream_.add_prediction(*state));
  }
  stream_.add_imu(*imu);
  last_imu_ns_ = imu->t_ns;
}

void FlightController::after_frame(const ReplayedFrame& frame, const Odometry& odometry) {
  const auto message = stream_.add_frame(frame.estimate, odometry.status());
  announce(stream_.health(), odometry.health().faulty);
  if (message) link_.send(*message);
  const std::uint64_t dropped = link_.counts().dropped;
  if (dropped == dropped_) return;
  dropped_ = dropped;
  if (const auto held_back = log_limit_.allows("dropped", frame.t_ns)) {
    log_warning("mavlink: " + std::to_string(dropped) + " messages not taken so far" + held_back_text(*held_back));
  }
}

std::string FlightController::report() const {
  const mavlink::LinkCounts counts = link_.counts();
  std::array<char, 200> line{};
  std::snprintf(
      line.data(), line.size(),
      "mavlink: %llu odometry messages, %llu time requests answered, %llu messages not taken; at most %.0f ms "
      "behind real time",
      static_cast<unsigned long long>(counts.odometry), static_cast<unsigned long long>(counts.time_answers),
      static_cast<unsigned long long>(counts.dropped), 1e3 * clock_.latest());
  return line.data();
}

void FlightController::announce(mavlink::LinkHealth health, const SourceSet& faulty) {
  const mavlink::StatusText text = mavlink::to_text(health, faulty);
  if (text.text == announced_) return;
  announced_ = text.text;
  log_info("mavlink: says " + std::string(text.text));
  link_.set_state(mavlink::to_system_state(health));
  link_.send(text);
}

}  // namespace ear::tools
