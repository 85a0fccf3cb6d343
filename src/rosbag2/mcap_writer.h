// Writes MCAP files of ROS 2 messages: chunks of zstd with an index.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "ear/types.h"
#include "src/rosbag2/mcap_format.h"

namespace ear::rosbag2 {

struct McapOptions {
  std::size_t chunk_bytes = std::size_t{1} << 20U;  ///< of messages, before compression
  TimeNs chunk_ns = 1'000'000'000;                  ///< of log time: what a kill costs at most
  int zstd_level = 1;
  std::string library = "ear-msckf";
};

/// One thread's. What is written is complete up to the last chunk at any time: after a kill or on a full disk the file
/// can be read up to there. Every function throws InputError, naming the file and the reason, when it cannot be
/// written; the file is then cut back to the last chunk that is whole, and takes no more.
class McapWriter {
 public:
  using Channel = std::uint16_t;

  /// The file must not be there yet.
  explicit McapWriter(std::filesystem::path file, McapOptions options = {});
  /// Completes the file, if close() did not; problems are then logged.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  McapWriter(McapWriter&&) = delete;
  McapWriter& operator=(McapWriter&&) = delete;

  /// `type`: "sensor_msgs/msg/Imu"; its definition is `definition`, or if that is empty the one of
  /// ros2::definition_of(). `metadata` goes into the channel's record.
  [[nodiscard]] Channel add_channel(const std::string& topic, const std::string& type,
                                    const std::map<std::string, std::string>& metadata = {},
                                    const std::string& definition = "");

  /// `bytes`: CDR with its header. Times before 1970 are written as 1970.
  void write(Channel channel, TimeNs log_ns, TimeNs publish_ns, Bytes bytes);

  /// A file beside the messages, a calibration for example.
  void attach(const std::string& name, const std::string& media_type, const std::string& content);

  /// Ends the current chunk, so that what was written is in the file.
  void flush();
  /// Writes index and end. Nothing may be written after it.
  void close();

 private:
  struct ChannelState {
    RecordWriter records;    ///< its schema and channel
    bool described = false;  ///< they are in the file
    std::uint32_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  ///< time and offset of those in the current chunk
  };
  struct Chunk {
    RecordWriter records;
    std::uint64_t first_ns = 0, last_ns = 0;
    bool any = false;
  };
  struct Summary {
    RecordWriter schemas, channels, chunks, attachments;
    std::map<std::string, std::uint16_t> schema_ids;  ///< by type
    std::uint64_t messages = 0, first_ns = 0, last_ns = 0;
    std::uint32_t chunk_count = 0, attachment_count = 0;
  };

  void begin(std::uint64_t log_ns);
  void put(const RecordWriter& records);
  [[nodiscard]] RecordWriter statistics() const;

  std::filesystem::path file_;
  McapOptions options_;
  int descriptor_ = -1;
  std::uint64_t offset_ = 0;  // bytes that are whole records
  std::vector<ChannelState> channels_;
  Chunk chunk_;
  Summary summary_;
};

}  // namespace ear::rosbag2
