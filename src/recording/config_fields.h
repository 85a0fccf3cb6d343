// The keys of a configuration file, stated once: loading, saving and the search for unknown keys all go through
// visit(), so that they cannot drift apart. A new setting is one line here.
//
// visit(config, f) calls f(key, field) for every field; a field that is itself a struct of settings becomes a map.
#pragma once

#include <array>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "ear/config.h"

namespace ear {

/// What a choice is called in a file and on the command line: names_of(E{}) lists all values of the enumeration E.
constexpr auto names_of(OdometerModel) {
  return std::array<std::pair<const char*, OdometerModel>, 4>{{{"none", OdometerModel::none},
                                                               {"differential", OdometerModel::differential},
                                                               {"gyro", OdometerModel::gyro},
                                                               {"terrain", OdometerModel::terrain}}};
}

/// The name of one of them.
template <typename E>
const char* name_of(E choice) {
  for (const auto& [name, value] : names_of(E{})) {
    if (value == choice) return name;
  }
  throw std::logic_error("a choice without a name in config_fields.h");
}

constexpr auto names_of(AnomalyScore) {
  return std::array<std::pair<const char*, AnomalyScore>, 2>{
      {{"distance", AnomalyScore::distance}, {"mahalanobis", AnomalyScore::mahalanobis}}};
}

constexpr auto names_of(AnomalyWeight) {
  return std::array<std::pair<const char*, AnomalyWeight>, 2>{
      {{"symmetric", AnomalyWeight::symmetric}, {"printed", AnomalyWeight::printed}}};
}

/// C is T, or T and const.
template <typename C, typename T>
using EnableFor = std::enable_if_t<std::is_same_v<std::remove_const_t<C>, T>>;

template <typename C, typename F>
EnableFor<C, FrontendConfig> visit(C& c, F&& f) {
  f("max_features", c.max_features);
  f("nearest_depth", c.nearest_depth);
  f("motion_prediction", c.motion_prediction);
}

template <typename C, typename F>
EnableFor<C, PerformanceConfig> visit(C& c, F&& f) {
  f("budget_ms", c.budget_ms);
}

template <typename C, typename F>
EnableFor<C, PriorConfig> visit(C& c, F&& f) {
  f("gyro_bias", c.gyro_bias);
  f("gyro_scale", c.gyro_scale);
  f("accel_scale", c.accel_scale);
  f("gyro_unseen", c.gyro_unseen);
  f("gyro_axes_unseen", c.gyro_axes_unseen);
  f("accel_bias", c.accel_bias);
  f("camera_rotation", c.camera_rotation);
  f("camera_position", c.camera_position);
  f("stereo_rotation", c.stereo_rotation);
  f("stereo_position", c.stereo_position);
  f("focal_length", c.focal_length);
  f("principal_point", c.principal_point);
  f("time_offset", c.time_offset);
  f("wheel_radius", c.wheel_radius);
  f("wheel_apart", c.wheel_apart);
  f("wheel_scale", c.wheel_scale);
  f("track_width", c.track_width);
  f("odometer_rotation", c.odometer_rotation);
  f("odometer_unseen", c.odometer_unseen);
  f("axle", c.axle);
  f("axle_unseen", c.axle_unseen);
  f("encoder_time_offset", c.encoder_time_offset);
  f("beam_offset", c.beam_offset);
}

template <typename C, typename F>
EnableFor<C, StandstillConfig> visit(C& c, F&& f) {
  f("duration", c.duration);
  f("max_gyro", c.max_gyro);
  f("max_gyro_spread", c.max_gyro_spread);
  f("max_accel_spread", c.max_accel_spread);
  f("max_flow_px", c.max_flow_px);
  f("leave_flow_px", c.leave_flow_px);
  f("position_sigma", c.position_sigma);
  f("rotation_sigma", c.rotation_sigma);
  f("velocity_sigma", c.velocity_sigma);
}

template <typename C, typename F>
EnableFor<C, OnlineCalibrationConfig> visit(C& c, F&& f) {
  f("camera_extrinsics", c.camera_extrinsics);
  f("intrinsics", c.intrinsics);
  f("time_offset", c.time_offset);
  f("wheels", c.wheels);
  f("odometer_rotation", c.odometer_rotation);
  f("axle", c.axle);
  f("encoder_time_offset", c.encoder_time_offset);
  f("beam_offset", c.beam_offset);
}

template <typename C, typename F>
EnableFor<C, OdometerConfig> visit(C& c, F&& f) {
  f("model", c.model);
  f("slip", c.slip);
  f("side_slip", c.side_slip);
  f("side_slip_turn", c.side_slip_turn);
  f("roughness", c.roughness);
  f("scores", c.scores);
  f("body_pitch", c.body_pitch);
  f("body_yaw", c.body_yaw);
  f("speed_sigma", c.speed_sigma);
  f("yaw_rate_sigma", c.yaw_rate_sigma);
  f("normal_walk", c.normal_walk);
  f("normal_prior", c.normal_prior);
  f("unevenness", c.unevenness);
}

template <typename C, typename F>
EnableFor<C, ContactConfig> visit(C& c, F&& f) {
  f("takeoff_height", c.takeoff_height);
  f("unevenness", c.unevenness);
  f("takeoff_duration", c.takeoff_duration);
  f("touchdown_height", c.touchdown_height);
  f("touchdown_duration", c.touchdown_duration);
  f("touchdown_climb", c.touchdown_climb);
  f("confirmed_height", c.confirmed_height);
  f("strike", c.strike);
}

template <typename C, typename F>
EnableFor<C, ImpactConfig> visit(C& c, F&& f) {
  f("accel_deviation", c.accel_deviation);
  f("gyro_deviation", c.gyro_deviation);
  f("accel_range", c.accel_range);
  f("gyro_range", c.gyro_range);
}

template <typename C, typename F>
EnableFor<C, AnomalyConfig> visit(C& c, F&& f) {
  f("enabled", c.enabled);
  f("score", c.score);
  f("weight", c.weight);
  f("distance", c.distance);
  f("false_alarm", c.false_alarm);
  f("min_weight", c.min_weight);
}

template <typename C, typename F>
EnableFor<C, FilterConfig> visit(C& c, F&& f) {
  f("window", c.window);
  f("max_track_updates", c.max_track_updates);
  f("feature_sigma_px", c.feature_sigma_px);
  f("huber_px", c.huber_px);
  f("gate_probability", c.gate_probability);
  f("keyframe_parallax_px", c.keyframe_parallax_px);
  f("prior", c.prior);
  f("standstill", c.standstill);
  f("online_calibration", c.online_calibration);
  f("odometer", c.odometer);
  f("contact", c.contact);
  f("impact", c.impact);
  f("anomaly", c.anomaly);
}

template <typename C, typename F>
EnableFor<C, Config> visit(C& c, F&& f) {
  f("frontend", c.frontend);
  f("filter", c.filter);
  f("performance", c.performance);
}

}  // namespace ear
