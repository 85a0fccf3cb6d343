#include "tools/calibration/result_text.h"

#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace ear::calibration {
namespace {

using Json = nlohmann::ordered_json;

[[gnu::format(printf, 1, 2)]] std::string line(const char* format, ...) {
  std::array<char, 400> text{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text.data(), text.size(), format, arguments);
  va_end(arguments);
  return text.data();
}

/// One line per number.
std::string table_of(const std::vector<Finding>& findings) {
  std::string text =
      line("%-46s %11s %10s %9s %9s  %s\n", "", "given", "change", "known to", "before", "entangled with");
  for (const Finding& finding : findings) {
    const std::string change = finding.shown ? line("%+.4g", finding.change) : "kept";
    text += line("%-46s %11.6g %10s %9.3g %9.3g  %s %.2f [%s]\n", finding.name.c_str(), finding.given, change.c_str(),
                 finding.posterior, finding.prior, finding.entangled_with.c_str(), finding.correlation,
                 finding.unit.c_str());
  }
  return text;
}

Json json_of(const std::vector<Finding>& findings) {
  Json parameters = Json::array();
  for (const Finding& finding : findings) {
    parameters.push_back({{"name", finding.name},
                          {"unit", finding.unit},
                          {"given", finding.given},
                          {"change", finding.change},
                          {"prior_sigma", finding.prior},
                          {"posterior_sigma", finding.posterior},
                          {"shown", finding.shown},
                          {"entangled_with", finding.entangled_with},
                          {"correlation", finding.correlation},
                          {"motion_wanted", finding.motion_wanted}});
  }
  return parameters;
}

const char* axis_name(std::size_t axis) {
  constexpr std::array kNames{"gyroscope x",     "gyroscope y",     "gyroscope z",
                              "accelerometer x", "accelerometer y", "accelerometer z"};
  return kNames[axis];
}

/// Root mean square of three axes; nothing where one of them has none.
std::optional<double> of_sensor(const ImuNoise& noise, std::size_t first, bool walk) {
  double sum = 0.0;
  for (std::size_t axis = first; axis < first + 3; ++axis) {
    const std::optional<Measured>& found = walk ? noise.axes[axis].random_walk : noise.axes[axis].white;
    if (!found) return std::nullopt;
    sum += found->value * found->value / 3.0;
  }
  return std::sqrt(sum);
}

std::string yaml_line(const char* key, const std::optional<double>& value) {
  if (value) return line("%s: %.3g\n", key, *value);
  return line("# %s: cannot be told from this length\n", key);
}

/// Of the sensors that are there.
std::string noise_text(const Calibration& calibration, const Noise& noise) {
  std::string text;
  const auto add = [&](const std::string& of) { text += (text.empty() ? "noise found: " : ", ") + of; };
  if (!calibration.cameras.empty()) add(line("features %.2f px", noise.pixel));
  if (calibration.encoder) add(line("slip %.2g m/sqrt(m)", noise.roll.slip));
  if (calibration.lasers) add(line("beams %.2g m", noise.beam));
  if (!text.empty()) text += "\n";
  if (noise.roll.common > 0.0) {
    text += line("both wheels alike slip by %.2g m/sqrt(m) against the reference, or it drifts by that\n",
                 noise.roll.common);
  }
  return text;
}

}  // namespace

std::string to_text(const Result& result) {
  std::string text = table_of(result.findings);
  bool any = false;
  for (const Finding& finding : result.findings) {
    if (finding.shown) continue;
    if (!any) text += "\nNot shown by this motion; the values given stay:\n";
    any = true;
    text += "  " + finding.name + ": " + finding.motion_wanted + "\n";
  }
  text += noise_text(result.calibration, result.noise);
  if (result.left_out > 0.0) text += line("%.1f s of the drives were left out: no estimate there\n", result.left_out);
  return text;
}

std::string to_json(const Result& result) {
  const Json json{{"parameters", json_of(result.findings)},
                  {"noise",
                   {{"feature_px", result.noise.pixel},
                    {"slip", result.noise.roll.slip},
                    {"common_slip", result.noise.roll.common},
                    {"beam", result.noise.beam}}},
                  {"left_out_s", result.left_out}};
  return json.dump(1) + "\n";
}

std::string to_text(const BoardResult& result) {
  const BoardCoverage& coverage = result.coverage;
  std::string text = line("%-46s %11s %9s %9s  %s\n", "", "found", "known to", "start", "entangled with");
  for (const Finding& finding : result.findings) {
    text += line("%-46s %11.6g %9.3g %9.3g  %s %.2f [%s]\n", finding.name.c_str(), finding.given + finding.change,
                 finding.posterior, finding.prior, finding.entangled_with.c_str(), finding.correlation,
                 finding.unit.c_str());
  }
  text += line(
      "%zu views, %zu corners within %.3f px (each coordinate), tilted by up to %.0f degrees, %.2f to %.2f m away\n",
      result.views, result.residuals.size(), result.sigma_px, coverage.largest_tilt * 57.29577951308232,
      coverage.nearest, coverage.farthest);
  for (std::size_t i = 0; i < result.calibration.cameras.size(); ++i) {
    text += line("cam%zu: %.0f %% of the image saw the board\n", i, 100.0 * coverage.covered[i]);
  }
  for (const std::string& words : result.advice) text += words + "\n";
  return text;
}

std::string to_json(const BoardResult& result) {
  const BoardCoverage& coverage = result.coverage;
  const Json json{{"parameters", json_of(result.findings)},
                  {"views", result.views},
                  {"corners", result.residuals.size()},
                  {"corner_sigma_px", result.sigma_px},
                  {"largest_tilt_deg", coverage.largest_tilt * 57.29577951308232},
                  {"distance_m", {coverage.nearest, coverage.farthest}},
                  {"advice", result.advice}};
  return json.dump(1) + "\n";
}

std::string to_text(const ImuNoise& noise) {
  std::string text = line("%.1f s at rest, %.1f Hz\n", noise.duration, noise.rate_hz);
  for (std::size_t axis = 0; axis < noise.axes.size(); ++axis) {
    const AllanResult& found = noise.axes[axis];
    text += line("%-16s", axis_name(axis));
    text += found.white ? line(" white %.3g +- %.1g", found.white->value, found.white->sigma) : " white: none found";
    if (found.random_walk) {
      text += line(", random walk %.3g +- %.1g\n", found.random_walk->value, found.random_walk->sigma);
    } else {
      text += ", random walk: the recording is too short to tell\n";
    }
  }
  text += yaml_line("gyroscope_noise_density", of_sensor(noise, 0, false));
  text += yaml_line("gyroscope_random_walk", of_sensor(noise, 0, true));
  text += yaml_line("accelerometer_noise_density", of_sensor(noise, 3, false));
  text += yaml_line("accelerometer_random_walk", of_sensor(noise, 3, true));
  return text;
}

std::string to_text(const MotionNoise& motion) {
  std::string text = line("%.1f s in motion; noise, times that at rest:\n", motion.duration);
  for (std::size_t axis = 0; axis < motion.times.size(); ++axis) {
    text += line("%-16s %.2f +- %.1g\n", axis_name(axis), motion.times[axis].value, motion.times[axis].sigma);
  }
  const auto factor = [&](std::size_t first) {
    double sum = 0.0;
    for (std::size_t axis = first; axis < first + 3; ++axis) sum += motion.times[axis].value * motion.times[axis].value;
    return std::sqrt(sum / 3.0);
  };
  return text +
         line("factor for gyroscope_noise_density %.2f, for accelerometer_noise_density %.2f\n", factor(0), factor(3));
}

std::string to_json(const ImuNoise& noise, const std::optional<MotionNoise>& motion) {
  const auto measured = [](const std::optional<Measured>& value) {
    return value ? Json{{"value", value->value}, {"sigma", value->sigma}} : Json(nullptr);
  };
  Json axes = Json::array();
  for (std::size_t axis = 0; axis < noise.axes.size(); ++axis) {
    const AllanResult& found = noise.axes[axis];
    Json points = Json::array();
    for (const AllanPoint& point : found.points) points.push_back({point.tau, point.deviation, point.relative_sigma});
    axes.push_back({{"axis", axis_name(axis)},
                    {"white", measured(found.white)},
                    {"random_walk", measured(found.random_walk)},
                    {"tau_deviation_relative_sigma", points}});
  }
  Json json{{"duration_s", noise.duration}, {"rate_hz", noise.rate_hz}, {"axes", axes}};
  if (motion) {
    Json times = Json::array();
    for (const Measured& value : motion->times) times.push_back({{"value", value.value}, {"sigma", value.sigma}});
    json["in_motion"] = {{"duration_s", motion->duration}, {"noise_over_noise_at_rest", times}};
  }
  return json.dump(1) + "\n";
}

}  // namespace ear::calibration
