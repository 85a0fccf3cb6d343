#include "src/recording/config_file.h"

#include <yaml-cpp/yaml.h>

#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "src/recording/config_fields.h"
#include "src/recording/input_error.h"
#include "src/recording/yaml_map.h"

namespace ear {
namespace {

template <typename E>
E load_choice(const YamlMap& map, const char* key) {
  const auto given = map.get<std::string>(key);
  std::string known;
  for (const auto& [name, value] : names_of(E{})) {
    if (given == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  throw map.error(key, "'" + given + "' is none of " + known);
}

template <typename T>
void load(const YamlMap& map, T& settings, std::vector<std::string> known = {}) {
  visit(settings, [&](const char* key, auto& field) {
    known.emplace_back(key);
    if (!map.has(key)) return;
    using Field = std::decay_t<decltype(field)>;
    if constexpr (std::is_arithmetic_v<Field>) {
      field = map.get<Field>(key);
      if constexpr (!std::is_same_v<Field, bool>) {
        if (field < 0) throw map.error(key, "must not be negative");
      }
    } else if constexpr (std::is_enum_v<Field>) {
      field = load_choice<Field>(map, key);
    } else {
      load(map.child(key), field);
    }
  });
  map.require_only(known);
}

template <typename T>
void save(const T& settings, YAML::Emitter& out) {
  out << YAML::BeginMap;
  visit(settings, [&](const char* key, const auto& field) {
    out << YAML::Key << key << YAML::Value;
    using Field = std::decay_t<decltype(field)>;
    if constexpr (std::is_arithmetic_v<Field>) {
      out << field;
    } else if constexpr (std::is_enum_v<Field>) {
      out << name_of(field);
    } else {
      save(field, out);
    }
  });
  out << YAML::EndMap;
}

}  // namespace

Config load_config(const std::filesystem::path& file) {
  Config config;
  load(YamlMap::load(file), config, {"topics"});  // of a bag: load_topics()
  return config;
}

void save_config(const Config& config, const std::filesystem::path& file) {
  YAML::Emitter out;
  out.SetDoublePrecision(std::numeric_limits<double>::max_digits10);
  save(config, out);
  std::ofstream stream(file);
  stream << out.c_str() << '\n';
  if (!stream.flush()) throw InputError(located(file, 0, "", "cannot be written"));
}

}  // namespace ear
