// YAML files with errors that name file, line and key.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "src/recording/input_error.h"

namespace ear {

/// A map inside a YAML file. Every reader throws InputError with file, line and key.
class YamlMap {
 public:
  /// Reads a file. The heading "%YAML:1.0" of EuRoC and OpenCV, which is not YAML, is accepted.
  [[nodiscard]] static YamlMap load(const std::filesystem::path& file);

  /// A map that was found inside `file`; `prefix` ("cam0.") goes before its keys in messages.
  YamlMap(std::filesystem::path file, const YAML::Node& node, std::string prefix);

  [[nodiscard]] bool has(const std::string& key) const { return node_[key].IsDefined() && !node_[key].IsNull(); }

  /// The value of a key that must be there. T: bool, double (finite), integers, std::string.
  template <typename T>
  [[nodiscard]] T get(const std::string& key) const {
    return convert<T>(required(key), key);
  }

  /// The value of a key that may be missing.
  template <typename T>
  [[nodiscard]] T get_or(const std::string& key, const T& otherwise) const {
    return has(key) ? get<T>(key) : otherwise;
  }

  /// A standard deviation that may be missing; it must be positive.
  [[nodiscard]] std::optional<double> sigma(const std::string& key) const;

  /// A list of finite numbers; `size` 0 accepts any length.
  [[nodiscard]] std::vector<double> numbers(const std::string& key, std::size_t size) const;

  /// A list of texts.
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;

  /// A 3-vector.
  [[nodiscard]] Eigen::Vector3d vector3(const std::string& key) const;

  /// A 4x4 pose: {rows, cols, data: 16 numbers}, 16 numbers, or four rows of four, row-major. A rotation that is only
  /// rounded is made orthonormal; one that is worse is left as it is, for check_calibration() to find.
  [[nodiscard]] Eigen::Isometry3d pose(const std::string& key) const;

  /// A map below this one.
  [[nodiscard]] YamlMap child(const std::string& key) const;

  /// A list of maps below this one.
  [[nodiscard]] std::vector<YamlMap> children(const std::string& key) const;

  /// Throws InputError at the first key that is none of `known`, or stated twice.
  void require_only(const std::vector<std::string>& known) const;

  /// The error to throw about a key.
  [[nodiscard]] InputError error(const std::string& key, const std::string& message) const;

 private:
  template <typename T>
  [[nodiscard]] T convert(const YAML::Node& value, const std::string& key) const {
    T result{};
    if (!value.IsScalar() || !YAML::convert<T>::decode(value, result)) {
      throw error_at(value, key, shown(value) + " is not " + type_name<T>());
    }
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(result)) throw error_at(value, key, shown(value) + " is not a finite number");
    }
    return result;
  }

  template <typename T>
  static const char* type_name() {
    if constexpr (std::is_same_v<T, bool>) return "true or false";
    if constexpr (std::is_integral_v<T>) return "a whole number";
    if constexpr (std::is_floating_point_v<T>) return "a number";
    return "a text";
  }

  static std::string shown(const YAML::Node& value) {
    return value.IsScalar() ? "'" + value.Scalar() + "'" : std::string("a list or map");
  }

  [[nodiscard]] YAML::Node required(const std::string& key) const;
  [[nodiscard]] InputError error_at(const YAML::Node& node, const std::string& key, const std::string& message) const;

  std::filesystem::path file_;
  YAML::Node node_;
  std::string prefix_;
};

}  // namespace ear
