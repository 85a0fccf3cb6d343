// Settings of the estimator from and to YAML files.
#pragma once

#include <filesystem>

#include "ear/config.h"

namespace ear {

/// Reads settings; the map `topics` is for ROS bags (src/bag/topics.h), and keys that are left out keep their defaults.
/// Throws InputError, naming file, line and key, for a key that does not exist or a value of the wrong type. Whether a
/// value makes sense is for the estimator to decide.
[[nodiscard]] Config load_config(const std::filesystem::path& file);

/// Writes all settings, so that load_config() gives back the same. Throws InputError if the file cannot be written.
void save_config(const Config& config, const std::filesystem::path& file);

}  // namespace ear
