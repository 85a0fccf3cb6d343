// A .db3 file of rosbag2's sqlite3 storage as a file of a bag.
#pragma once

#include <filesystem>
#include <memory>

#include "src/rosbag2/bag_file.h"

namespace ear::rosbag2 {

/// Throws InputError if it is no such file, or its tables are others.
[[nodiscard]] std::unique_ptr<BagFile> open_sqlite(const std::filesystem::path& file);

}  // namespace ear::rosbag2
