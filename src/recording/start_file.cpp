#include "src/recording/start_file.h"

#include <string>

#include "src/recording/yaml_map.h"

namespace ear {
namespace {

constexpr double kQuaternionTolerance = 1e-3;  // of the length of a quaternion: digits that were cut off

double sigma_or_zero(const YamlMap& map, const std::string& key, double otherwise) {
  const auto sigma = map.get_or(key, otherwise);
  if (!(sigma >= 0.0)) throw map.error(key, std::to_string(sigma) + " is negative: it is a standard deviation");
  return sigma;
}

}  // namespace

GivenStart load_start(const std::filesystem::path& file, const TimeSpan& span) {
  const YamlMap map = YamlMap::load(file);
  map.require_only({"t_ns", "position", "rotation", "velocity", "gyroscope_bias", "accelerometer_bias", "tilt_sigma",
                    "yaw_sigma", "position_sigma", "velocity_sigma", "gyroscope_bias_sigma",
                    "accelerometer_bias_sigma"});
  GivenStart start;
  NavState& x = start.state;
  x.t_ns = map.get<TimeNs>("t_ns");
  if (x.t_ns < span.first_ns || x.t_ns > span.last_ns) {
    throw map.error("t_ns",
                    "the recording goes from " + std::to_string(span.first_ns) + " to " + std::to_string(span.last_ns));
  }
  x.p_WB = map.vector3("position");
  const std::vector<double> q = map.numbers("rotation", 4);
  x.q_WB = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  if (!(std::abs(x.q_WB.norm() - 1.0) < kQuaternionTolerance)) {
    throw map.error("rotation",
                    "a quaternion w, x, y, z of length one is needed, not " + std::to_string(x.q_WB.norm()));
  }
  x.v_W = map.vector3("velocity");
  if (map.has("gyroscope_bias")) x.b_g = map.vector3("gyroscope_bias");
  if (map.has("accelerometer_bias")) x.b_a = map.vector3("accelerometer_bias");
  start.tilt_sigma = map.sigma("tilt_sigma").value_or(start.tilt_sigma);
  start.yaw_sigma = sigma_or_zero(map, "yaw_sigma", start.yaw_sigma);
  start.position_sigma = sigma_or_zero(map, "position_sigma", start.position_sigma);
  start.velocity_sigma = map.sigma("velocity_sigma").value_or(start.velocity_sigma);
  start.gyro_bias_sigma = map.sigma("gyroscope_bias_sigma");
  start.accel_bias_sigma = map.sigma("accelerometer_bias_sigma");
  return start;
}

}  // namespace ear
