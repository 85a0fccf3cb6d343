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
    : R_BV_(mounting(args, calibration)),
      clock_(first_ns),
      link_(args.address, {static_cast<std::uint8_t>(args.system)}, [this] { return clock_.now(); }),
      output_(link_, R_BV_, calibration.imu) {}

void FlightController::before_sample(const Sample& sample, const Odometry& odometry) {
  const auto* const imu = std::get_if<ImuSample>(&sample);
  if (imu == nullptr) return;  // the others come between these, whatever their clocks
  clock_.wait_until(imu->t_ns);
  if (last_imu_ns_ && output_.wants_prediction(*last_imu_ns_)) {
    if (const auto state = odometry.predict(*last_imu_ns_)) output_.send_prediction(*state);
  }
  output_.add_imu(*imu);
  last_imu_ns_ = imu->t_ns;
}

void FlightController::after_frame(const ReplayedFrame& frame, const Odometry& odometry) {
  output_.take({frame.t_ns, frame.estimate, odometry.status(), odometry.health()});
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

}  // namespace ear::tools
