// An MCAP file as a file of a bag.
#pragma once

#include <filesystem>
#include <memory>

#include "src/rosbag2/bag_file.h"

namespace ear::rosbag2 {

/// Chunked or not, packed by zstd, lz4 or not at all, with an index or without. Throws InputError if it is no such
/// file; where it is torn or damaged, what can be read is, and `warnings` says what not.
[[nodiscard]] std::unique_ptr<BagFile> open_mcap(const std::filesystem::path& file, Warnings& warnings);

}  // namespace ear::rosbag2
