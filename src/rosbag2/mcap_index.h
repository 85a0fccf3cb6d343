// What an MCAP file holds and where: from its summary, or where there is none by reading through it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "src/recording/warnings.h"
#include "src/rosbag2/bag_file.h"
#include "src/rosbag2/mcap_format.h"

namespace ear::rosbag2 {

/// A file's bytes, by position; any thread.
class FileBytes {
 public:
  /// Throws InputError if it cannot be read.
  explicit FileBytes(std::filesystem::path file);
  ~FileBytes();
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  FileBytes(FileBytes&&) = delete;
  FileBytes& operator=(FileBytes&&) = delete;

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  /// Throws InputError where the file ends before.
  [[nodiscard]] std::vector<std::uint8_t> read(std::uint64_t offset, std::uint64_t count) const;

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// A record's head.
struct RecordHead {
  Opcode opcode{};
  std::uint64_t content = 0;  ///< where its content begins
  std::uint64_t length = 0;   ///< of the content
  [[nodiscard]] std::uint64_t end() const { return content + length; }
};

/// Throws InputError where the record would go beyond `end`.
[[nodiscard]] RecordHead read_head(const FileBytes& file, std::uint64_t offset, std::uint64_t end);

/// A chunk, or a run of records outside of chunks.
struct Section {
  std::uint64_t begin = 0;  ///< of a chunk's content, of a run's first record
  std::uint64_t end = 0;
  bool chunk = false;
  std::uint64_t first_ns = 0;
  std::vector<std::uint16_t> channels;  ///< of which it has messages; empty: not known
};

struct McapIndex {
  std::map<std::uint16_t, BagTopic> channels;
  std::vector<Section> sections;                                               ///< in the order of time
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> attachments;  ///< content's place by name
};

/// The records of a chunk, unpacked. Throws InputError for what is damaged: a false length, another checksum.
[[nodiscard]] std::vector<std::uint8_t> unpack_chunk(const FileBytes& file, const Section& section);

/// Calls f(opcode, content) for each record in unpacked bytes. Throws RecordError where the last one ends early.
template <typename F>
void for_each_record(Bytes records, F&& f) {
  RecordReader reader(records);
  while (reader.any()) {
    const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
    f(opcode, reader.take(reader.number<std::uint64_t>()));
  }
}

/// Throws InputError if the file is none. A file without an end is read up to it: `warnings` says so.
[[nodiscard]] McapIndex read_mcap_index(const FileBytes& file, Warnings& warnings);

}  // namespace ear::rosbag2
