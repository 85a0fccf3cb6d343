// Zstandard and LZ4, as MCAP files and rosbag2 use them, and the checksum of MCAP.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "src/ros2/cdr.h"

namespace ear::rosbag2 {

using ros2::Bytes;

/// What `compression` ("", "zstd", "lz4") packed. Memory grows with what comes out, up to `most` bytes. Throws
/// InputError for an unknown name, for bytes that are not so compressed, and for more than `most`.
[[nodiscard]] std::vector<std::uint8_t> decompressed(Bytes bytes, const std::string& compression, std::size_t most);

[[nodiscard]] std::vector<std::uint8_t> compressed_zstd(Bytes bytes, int level);

/// A whole file, in constant memory. Throws InputError, naming the file.
void decompress_zstd_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// CRC-32 as in zlib; `begin` is that of the bytes before, 0 at first.
[[nodiscard]] std::uint32_t crc32_of(Bytes bytes, std::uint32_t begin = 0);

}  // namespace ear::rosbag2
