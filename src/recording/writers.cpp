#include "src/recording/writers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "src/recording/input_error.h"

namespace ear {
namespace {

// Names of the pose error in states.csv: position in the world, then rotation about the world's axes.
struct PoseAxis {
  const char* name;
  int index;  // in Estimate::covariance
};
constexpr std::array<PoseAxis, 6> kPoseAxes{{{"x", estimate_error::position},
                                             {"y", estimate_error::position + 1},
                                             {"z", estimate_error::position + 2},
                                             {"rx", estimate_error::rotation},
                                             {"ry", estimate_error::rotation + 1},
                                             {"rz", estimate_error::rotation + 2}}};

struct SigmaGroup {
  const char* name;
  int index;
};
constexpr std::array<SigmaGroup, 3> kSigmas{
    {{"v", estimate_error::velocity}, {"b_g", estimate_error::gyro_bias}, {"b_a", estimate_error::accel_bias}}};

std::string states_heading() {
  std::string heading = "t_ns,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,v_y,v_z,b_g_x,b_g_y,b_g_z,b_a_x,b_a_y,b_a_z";
  for (std::size_t i = 0; i < kPoseAxes.size(); ++i) {
    for (std::size_t j = i; j < kPoseAxes.size(); ++j) {
      heading += std::string(",cov_") + kPoseAxes[i].name + "_" + kPoseAxes[j].name;
    }
  }
  for (const SigmaGroup& group : kSigmas) {
    for (const char* axis : {"_x", "_y", "_z"}) heading += std::string(",sigma_") + group.name + axis;
  }
  heading +=
      ",tracks,stereo,features_used,features_rejected,clones,wheel_rows_used,wheel_rows_rejected,beams_used,"
      "beams_rejected,standing,on_ground,slope_along,slope_across,sigma_slope_along,sigma_slope_across,"
      "weight_imu,weight_odometer,weight_camera,inconsistency_imu,inconsistency_odometer,inconsistency_camera,"
      "displacement_variance,disagreement,anomalous,mode,health,quality,load_step";
  for (const char* source : kSourceNames) heading += std::string(",score_") + source;
  return heading + "\n";
}

void append(std::string& line, double value) {
  std::array<char, 32> text{};
  const int length = std::snprintf(text.data(), text.size(), ",%.9g", value);
  line.append(text.data(), static_cast<std::size_t>(length));
}

void append(std::string& line, const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) append(line, v(i));
}

// Seconds from integer nanoseconds without a loss: a double would keep 200 ns of today's dates.
std::string seconds_text(TimeNs t_ns) {
  const std::uint64_t size = t_ns < 0 ? 0 - static_cast<std::uint64_t>(t_ns) : static_cast<std::uint64_t>(t_ns);
  std::string fraction = std::to_string(size % 1'000'000'000);
  fraction.insert(0, 9 - fraction.size(), '0');
  return (t_ns < 0 ? "-" : "") + std::to_string(size / 1'000'000'000) + "." + fraction;
}

// Column `anomalous`: nobody, a sensor in the order of MotionSensor, or one of two.
int anomalous_code(const Consistency& consistency) {
  constexpr int kNobody = 0, kFirstSensor = 1, kOneOfTwo = 4;
  if (consistency.anomalous) return kFirstSensor + static_cast<int>(*consistency.anomalous);
  return consistency.disagree() ? kOneOfTwo : kNobody;
}

// Column `mode`: what the vehicle does. Free: no wheels carry it, as in flight, or nobody knows of any.
const char* mode_text(const FrameStatistics& frame) {
  if (frame.standing) return "standing";
  return frame.on_ground ? "rolling" : "free";
}

// 16 numbers row by row, as sensor.yaml takes them.
nlohmann::ordered_json to_json(const Eigen::Isometry3d& T) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (Eigen::Index row = 0; row < 4; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) list.push_back(T.matrix()(row, column));
  }
  return list;
}

// All that is learned while running: of the sensors that there are.
nlohmann::ordered_json to_json(const Calibration& calibration) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  const std::vector<CameraCalibration>& cameras = calibration.cameras;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraCalibration& camera = cameras[i];
    json["intrinsics_" + std::to_string(i)] = {camera.fu, camera.fv, camera.cu, camera.cv};
  }
  if (!cameras.empty()) {
    json["camera_time_offset"] = calibration.camera_time_offset;
    json["T_BC0"] = to_json(cameras[0].T_BC);
  }
  if (cameras.size() > 1) {
    json["T_BC1"] = to_json(cameras[1].T_BC);
    json["T_C0C1"] = to_json(cameras[0].T_BC.inverse(Eigen::Isometry) * cameras[1].T_BC);
  }
  if (calibration.encoder) {
    json["wheel_radius_left"] = calibration.encoder->wheel_radius[0];
    json["wheel_radius_right"] = calibration.encoder->wheel_radius[1];
    json["track_width"] = calibration.encoder->track_width;
    json["encoder_time_offset"] = calibration.encoder->time_offset;
    json["T_BO"] = to_json(calibration.encoder->T_BO);
  }
  if (calibration.lasers) {
    json["beams"] = nlohmann::ordered_json::array();
    for (const LaserBeam& beam : calibration.lasers->beams) {
      json["beams"].push_back({{"name", beam.name}, {"origin", {beam.p_BL.x(), beam.p_BL.y(), beam.p_BL.z()}}});
    }
  }
  return json;
}

nlohmann::ordered_json to_json(const std::vector<Warning>& warnings) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Warning& w : warnings) list.push_back({{"kind", w.kind}, {"count", w.count}, {"first", w.first}});
  return list;
}

}  // namespace

OutputFile::OutputFile(const std::filesystem::path& file) : file_(file), stream_(file) {
  if (!stream_) throw InputError(located(file_, 0, "", "cannot be created"));
}

void OutputFile::write(const std::string& text) {
  if (!(stream_ << text << std::flush)) throw InputError(located(file_, 0, "", "cannot be written"));
}

void TumWriter::write(const NavState& state) {
  const Eigen::Vector3d& p = state.p_WB;
  const Eigen::Quaterniond& q = state.q_WB;
  std::string line = seconds_text(state.t_ns);
  std::array<char, 32> text{};
  for (const double value : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}) {
    const int length = std::snprintf(text.data(), text.size(), " %.9f", value);
    line.append(text.data(), static_cast<std::size_t>(length));
  }
  out_.write(line + "\n");
}

StatesWriter::StatesWriter(const std::filesystem::path& file) : out_(file) { out_.write(states_heading()); }

void StatesWriter::write(const Estimate& estimate, std::string health) {
  const NavState& state = estimate.state;
  std::string line = std::to_string(state.t_ns);
  append(line, state.p_WB);
  for (const double value : {state.q_WB.w(), state.q_WB.x(), state.q_WB.y(), state.q_WB.z()}) append(line, value);
  append(line, state.v_W);
  append(line, state.b_g);
  append(line, state.b_a);
  for (std::size_t i = 0; i < kPoseAxes.size(); ++i) {
    for (std::size_t j = i; j < kPoseAxes.size(); ++j) {
      append(line, estimate.covariance(kPoseAxes[i].index, kPoseAxes[j].index));
    }
  }
  for (const SigmaGroup& group : kSigmas) {
    append(line, estimate.covariance.diagonal().segment<3>(group.index).cwiseMax(0.0).cwiseSqrt().eval());
  }
  const FrameStatistics& frame = estimate.frame;
  for (const int count : {frame.tracks, frame.stereo, frame.features_used, frame.features_rejected, frame.clones,
                          frame.wheel_rows_used, frame.wheel_rows_rejected, frame.beams_used, frame.beams_rejected}) {
    line += "," + std::to_string(count);
  }
  line += frame.standing ? ",1" : ",0";
  line += frame.on_ground ? ",1" : ",0";
  const TerrainEstimate& ground = estimate.terrain;
  for (const double value : {ground.slope_along, ground.slope_across, ground.sigma_along, ground.sigma_across}) {
    if (ground.known) {
      append(line, value);
    } else {
      line += ",nan";
    }
  }
  const Consistency& consistency = estimate.consistency;
  for (const double weight : consistency.weight) append(line, weight);
  for (const double coefficient : consistency.coefficient) append(line, coefficient);
  append(line, consistency.variance);
  append(line, consistency.threshold > 0.0 ? consistency.score / consistency.threshold : 0.0);
  line += "," + std::to_string(anomalous_code(consistency)) + "," + mode_text(frame);
  std::replace(health.begin(), health.end(), ',', ';');
  line +=
      "," + health + "," + std::to_string(estimate.health.quality) + "," + std::to_string(estimate.health.load_step);
  for (const SourceRecord& record : estimate.health.sources) append(line, record.score);
  out_.write(line + "\n");
}

void write_summary(const RunSummary& summary, const std::filesystem::path& file) {
  nlohmann::ordered_json json;
  json["recording"] = summary.recording;
  json["duration_s"] = summary.duration_s;
  json["wall_time_s"] = summary.wall_time_s;
  json["counts"] = nlohmann::ordered_json::object();
  for (const auto& [name, count] : summary.counts) json["counts"][name] = count;
  json["stage_times_s"] = nlohmann::ordered_json::object();
  for (const auto& [name, seconds] : summary.stage_times_s) json["stage_times_s"][name] = seconds;
  json["calibration"] = to_json(summary.calibration);
  json["health"] = nlohmann::ordered_json::array();
  for (const HealthChange& change : summary.health)
    json["health"].push_back({{"t_ns", change.t_ns}, {"is", change.text}});
  json["warnings"] = to_json(summary.warnings);
  OutputFile(file).write(json.dump(2) + "\n");
}

}  // namespace ear
