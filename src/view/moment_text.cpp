#include "src/view/moment_text.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "src/health_text.h"

namespace ear::view {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kEnded = 4;  // above every FeatureUse

/// Numbers that are none become null, as JSON has no others.
Json number(double value, double scale = 1.0) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(value * scale * 1e6) / 1e6;
}

template <typename V>
Json vector(const V& v) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) list.push_back(number(v(i)));
  return list;
}

Json state_json(const Estimate& estimate) {
  const NavState& x = estimate.state;
  const auto position = estimate.covariance.block<3, 3>(estimate_error::position, estimate_error::position);
  const FrameStatistics& frame = estimate.frame;
  const TerrainEstimate& ground = estimate.terrain;
  Json json{{"p", vector(x.p_WB)},
            {"q", {number(x.q_WB.w()), number(x.q_WB.x()), number(x.q_WB.y()), number(x.q_WB.z())}},
            {"v", vector(x.v_W)},
            {"cov",
             {number(position(0, 0), 1e6), number(position(0, 1), 1e6), number(position(1, 1), 1e6),
              number(position(2, 2), 1e6)}},  // [mm^2]
            {"tracks", frame.tracks},
            {"stereo", frame.stereo},
            {"used", frame.features_used},
            {"rejected", frame.features_rejected},
            {"clones", frame.clones},
            {"mode", frame.standing    ? "standing"
                     : frame.on_ground ? "rolling"
                                       : "free"}};
  if (ground.known) json["slope"] = {number(ground.slope_along), number(ground.slope_across)};
  Json weights = Json::array();
  for (std::size_t i = 0; i < kMotionSensors; ++i) weights.push_back(number(estimate.consistency.weight[i]));
  json["weights"] = weights;
  return json;
}

Json sources_json(const Moment& moment) {
  Json list = Json::array();
  const TimeNs now = moment.estimate ? moment.estimate->state.t_ns : moment.t_ns;
  for (const SourceRecord& record : moment.health.sources) {
    const Json age = record.last_used_ns == 0 ? Json(nullptr) : number(seconds_between(record.last_used_ns, now));
    list.push_back({number(record.gate_ratio), record.used, record.rejected, age, number(record.score)});
  }
  return list;
}

Json counts_json(const InputCounts& counts) {
  const auto stream = [](const StreamCounts& c) { return Json{c.accepted, c.rejected(), c.gaps}; };
  return {{"imu", stream(counts.imu)},     {"camera", stream(counts.camera)}, {"encoder", stream(counts.encoder)},
          {"laser", stream(counts.laser)}, {"spikes", counts.imu_spikes},     {"jumps", counts.clock_jumps}};
}

Json faulty_json(const Health& health) {
  Json list = Json::array();
  for (std::size_t i = 0; i < kSourceCount; ++i) {
    if (health.faulty[i]) list.push_back(kSourceNames[i]);
  }
  return list;
}

}  // namespace

std::string summary_text(const Moment& moment) {
  const StageTimes& s = moment.stages;
  Json json{{"t_ns", std::to_string((moment.estimate ? moment.estimate->state.t_ns : moment.t_ns))},
            {"health", to_text(moment.health)},
            {"status", to_text(moment.health.status)},
            {"quality", moment.health.quality},
            {"faulty", faulty_json(moment.health)},
            {"load", moment.health.load_step},
            {"resets", moment.health.reset_counter},
            {"sources", sources_json(moment)},
            {"counts", counts_json(moment.counts)},
            {"ms",
             {number(s.pyramid, 1e3), number(s.track, 1e3), number(s.detect, 1e3), number(s.stereo, 1e3),
              number(s.reject, 1e3), number(s.filter, 1e3)}},
            {"image", !moment.left.empty()},
            {"right", !moment.right.empty()}};
  Json ranges = Json::array();
  for (const double range : moment.ranges) ranges.push_back(number(range));
  json["ranges"] = ranges;
  if (moment.estimate) json["state"] = state_json(*moment.estimate);
  if (moment.truth) json["truth"] = vector(*moment.truth);
  const std::string text = json.dump();
  return text.substr(1, text.size() - 2);
}

std::string features_text(const Moment& moment, const Lens* left, const Lens* right) {
  Json list = Json::array();
  const auto tenth = [](double px) { return std::round(10.0 * px) / 10.0; };
  const auto append = [&](Json& row, const Eigen::Vector2d& pixel) {
    row.push_back(tenth(pixel.x()));
    row.push_back(tenth(pixel.y()));
  };
  for (const SeenFeature& feature : moment.features) {
    const std::optional<Eigen::Vector2d> pixel = left != nullptr ? left->to_pixel(feature.left) : std::nullopt;
    if (!pixel) continue;
    Json row{feature.id, feature.age, static_cast<int>(feature.use) + (feature.ended ? kEnded : 0)};
    append(row, *pixel);
    const bool both = feature.stereo && right != nullptr;
    if (const auto other = both ? right->to_pixel(feature.right) : std::nullopt) append(row, *other);
    list.push_back(std::move(row));
  }
  return list.dump();
}

std::string description_text(const Description& description) {
  const Calibration& calibration = description.calibration;
  Json json{{"title", description.title}, {"truth", description.has_truth}, {"live", description.live}};
  json["sources"] = kSourceNames;
  Json cameras = Json::array();
  for (const CameraCalibration& camera : calibration.cameras) cameras.push_back({camera.width, camera.height});
  json["cameras"] = cameras;
  json["rates"] = {
      {"imu", number(calibration.imu.rate_hz)},
      {"camera", calibration.cameras.empty() ? Json(nullptr) : number(calibration.cameras.front().rate_hz)},
      {"encoder", calibration.encoder ? number(calibration.encoder->rate_hz) : Json(nullptr)},
      {"laser", calibration.lasers ? number(calibration.lasers->rate_hz) : Json(nullptr)}};
  Json beams = Json::array();
  if (calibration.lasers) {
    for (const LaserBeam& beam : calibration.lasers->beams) {
      beams.push_back({{"name", beam.name}, {"p", vector(beam.p_BL)}, {"d", vector(beam.d_B)}});
    }
  }
  json["beams"] = beams;
  if (calibration.encoder) {
    const EncoderCalibration& wheels = *calibration.encoder;
    json["axle"] = {{"p", vector(wheels.T_BO.translation().eval())},
                    {"left", vector(wheels.T_BO.linear().col(1).eval())},
                    {"forward", vector(wheels.T_BO.linear().col(0).eval())},
                    {"up", vector(wheels.T_BO.linear().col(2).eval())},
                    {"width", number(wheels.track_width)},
                    {"radius", number(wheels.wheel_radius[0])}};
  }
  return json.dump();
}

}  // namespace ear::view
