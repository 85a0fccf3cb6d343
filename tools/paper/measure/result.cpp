#include "tools/paper/measure/result.h"

#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace ear::paper {
namespace {

using Json = nlohmann::ordered_json;

/// Calls f(key, number) for every number of a result that is always there.
template <typename R, typename F>
void visit_numbers(R& r, F&& f) {
  f("coverage", r.coverage);
  f("length_m", r.length);
  f("ate_m", r.ate);
  f("z_m", r.z);
  f("rotation_deg", r.rotation);
  f("start_to_end_m", r.start_to_end);
  f("end_distance_m", r.end_distance);
  f("true_end_distance_m", r.true_end_distance);
  f("frame_ms", r.frame_ms);
  f("worst_frame_ms", r.worst_frame_ms);
}

Json value_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

std::optional<double> number_or_none(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

Result from_json(const Json& json) {
  Result result;
  result.estimated = json.at("estimated").get<bool>();
  visit_numbers(result, [&](const char* key, double& value) { value = json.at(key).get<double>(); });
  result.nees_position = number_or_none(json.at("nees_position"));
  result.nees_orientation = number_or_none(json.at("nees_orientation"));
  for (const Json& row : json.at("moments")) {
    const auto number = [&](std::size_t i) { return row.at(i).get<double>(); };
    result.moments.push_back({number(0), number(1), number(2), number(3), number(4), number(5), number(6), number(7),
                              number(8), number_or_none(row.at(9))});
  }
  return result;
}

}  // namespace

std::string to_json(const Result& result) {
  Json json{{"estimated", result.estimated}};
  visit_numbers(result, [&](const char* key, double value) { json[key] = value; });
  json["nees_position"] = value_or_null(result.nees_position);
  json["nees_orientation"] = value_or_null(result.nees_orientation);
  json["moments"] = Json::array();
  for (const Moment& m : result.moments) {
    json["moments"].push_back(
        Json::array({m.t, m.distance, m.x, m.y, m.z, m.true_x, m.true_y, m.true_z, m.error, value_or_null(m.nees)}));
  }
  return json.dump() + "\n";
}

Result read_result(const std::filesystem::path& file) {
  std::ifstream stream(file);
  try {
    return from_json(Json::parse(stream));
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": no result of a run (delete it): " + error.what());
  }
}

void write_complete(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path part = file.string() + ".part" + std::to_string(getpid());
  std::ofstream stream(part);
  stream << text << std::flush;
  if (!stream) throw std::runtime_error(part.string() + ": cannot be written");
  stream.close();
  std::filesystem::rename(part, file);
}

}  // namespace ear::paper
