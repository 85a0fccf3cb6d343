#include "tools/paper/measure/configuration.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <type_traits>

#include "src/recording/config_fields.h"
#include "tools/estimators.h"

namespace ear::paper {
namespace {

Configuration with(const std::string& name, const std::string& title, const std::function<void(Config&)>& change) {
  Configuration configuration{name, title, Config{}};
  change(configuration.config);
  return configuration;
}

std::vector<Configuration> odometer_models() {
  std::vector<Configuration> models;
  for (const auto& [name, model] : names_of(OdometerModel{})) {
    models.push_back(with(name, name, [chosen = model](Config& c) { c.filter.odometer.model = chosen; }));
  }
  return models;
}

std::vector<Configuration> anomaly_weights() {
  const auto weights = [](bool enabled, AnomalyScore score) {
    return [=](Config& c) {
      c.filter.anomaly.enabled = enabled;
      c.filter.anomaly.score = score;
    };
  };
  return {with("weights-off", "anomaly weights off", weights(false, AnomalyScore::mahalanobis)),
          with("weights-mahalanobis", "anomaly weights, Mahalanobis", weights(true, AnomalyScore::mahalanobis)),
          with("weights-distance", "anomaly weights, distance", weights(true, AnomalyScore::distance))};
}

// What keeps out readings that do not fit: the gates, and what weighs the sensors.
std::vector<Configuration> without_gates() {
  const auto gates_off = [](bool weighs) {
    return [=](Config& c) {
      c.filter.gate_probability = 1.0 - 1e-9;  // as good as none
      c.filter.huber_px = 1e3;
      c.filter.odometer.scores = c.filter.anomaly.enabled = weighs;
    };
  };
  return {with("gates-off", "gates off", gates_off(true)),
          with("all-off", "gates, scores and anomaly weights off", gates_off(false))};
}

// One ingredient less, or another one in its place.
std::vector<Configuration> left_out() {
  constexpr double kNothing = 1e3;  // [m/sqrt(m)] a noise that makes a row say nothing
  std::vector<Configuration> list{
      with("no-side-slip", "no side-slip row", [](Config& c) { c.filter.odometer.side_slip = kNothing; }),
      with("oldest-clone", "oldest clone makes room", [](Config& c) { c.filter.keyframe_parallax_px = 0.0; }),
  };
  Configuration no_pitch_rate = with("no-pitch-rate", "no pitch-rate correction", [](Config&) {});
  no_pitch_rate.pitch_rate = false;
  no_pitch_rate.tracks_only = true;
  list.push_back(no_pitch_rate);
  Configuration together = with("beams-together", "beams only together", [](Config&) {});
  together.beams_together = true;
  together.tracks_only = true;
  list.push_back(together);
  Configuration unpredicted =
      with("no-prediction", "no motion prediction", [](Config& c) { c.frontend.motion_prediction = false; });
  unpredicted.images_only = true;
  list.push_back(unpredicted);
  Configuration no_lasers = with("no-lasers", "no lasers, no slope", [](Config&) {});
  no_lasers.lasers = false;
  list.push_back(no_lasers);
  return list;
}

std::vector<Configuration> all_configurations() {
  std::vector<Configuration> all{with("default", "all sensors", [](Config&) {})};
  for (const auto& more : {odometer_models(), anomaly_weights(), without_gates(), left_out()}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  all.push_back({"smoother", "smoother", Config{}, Estimator::smoother});
  return all;
}

void append(std::string& text, const std::string& key, double value) {
  std::array<char, 32> number{};
  std::snprintf(number.data(), number.size(), "%.17g", value);
  text += key + ": " + number.data() + "\n";
}

template <typename Settings>
void append_fields(std::string& text, const std::string& prefix, const Settings& settings) {
  visit(settings, [&](const char* key, const auto& field) {
    using Field = std::decay_t<decltype(field)>;
    if constexpr (std::is_enum_v<Field>) {
      text += prefix + key + ": " + name_of(field) + "\n";
    } else if constexpr (std::is_arithmetic_v<Field>) {
      append(text, prefix + key, static_cast<double>(field));
    } else {
      append_fields(text, prefix + key + ".", field);
    }
  });
}

}  // namespace

std::string name_of(Estimator estimator) { return estimator == Estimator::filter ? "filter" : "smoother"; }

bool is_built(Estimator estimator) {
  const std::vector<std::string> built = tools::estimator_names();
  return std::find(built.begin(), built.end(), name_of(estimator)) != built.end();
}

const std::vector<Configuration>& configurations() {
  static const std::vector<Configuration> kAll = all_configurations();
  return kAll;
}

const std::vector<std::string>& ablation() {
  static const std::vector<std::string> kNames{
      "default",      "none",         "no-pitch-rate",       "no-lasers",        "beams-together",
      "no-side-slip", "weights-off",  "weights-mahalanobis", "weights-distance", "gates-off",
      "all-off",      "oldest-clone", "no-prediction"};
  return kNames;
}

const Configuration& find_configuration(const std::string& name) {
  const auto& all = configurations();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Configuration& c) { return c.name == name; });
  if (found == all.end()) throw std::invalid_argument("no configuration '" + name + "'");
  return *found;
}

std::string settings_text(const Configuration& configuration) {
  std::string text = configuration.estimator == Estimator::filter ? "" : "estimator: smoother\n";
  if (!configuration.lasers) text += "lasers: not told\n";
  if (!configuration.pitch_rate) text += "pitch rate: taken out of the encoders\n";
  if (configuration.beams_together) text += "beams: together\n";
  append_fields(text, "", configuration.config);
  return text;
}

Calibration given(const Configuration& configuration, Calibration calibration) {
  if (!configuration.lasers) calibration.lasers.reset();
  return calibration;
}

}  // namespace ear::paper
