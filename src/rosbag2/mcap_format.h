// The records of MCAP files, as its specification lays them out (https://mcap.dev/spec): numbers little endian, texts
// and bytes behind their length.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "src/ros2/cdr.h"

namespace ear::rosbag2 {

using ros2::Bytes;

inline constexpr std::array<std::uint8_t, 8> kMcapMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0A,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F
};

inline constexpr std::size_t kRecordHead = 9;    // opcode and length
inline constexpr std::size_t kMessageHead = 22;  // channel, sequence, two times
inline constexpr std::size_t kFooterSize = 20;

/// Appends records to bytes.
class RecordWriter {
 public:
  template <typename Number>
  RecordWriter& number(Number value) {
    static_assert(std::is_unsigned_v<Number>);
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8U * i)));
    }
    return *this;
  }
  RecordWriter& text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    return *this;
  }
  RecordWriter& bytes(Bytes value) {
    bytes_.insert(bytes_.end(), value.data, value.data + value.size);
    return *this;
  }
  RecordWriter& texts(const std::map<std::string, std::string>& values) {
    RecordWriter inner;
    for (const auto& [key, value] : values) inner.text(key).text(value);
    return number(static_cast<std::uint32_t>(inner.bytes_.size())).bytes(inner.view());
  }
  /// This content as a record.
  RecordWriter& record(Opcode opcode, const RecordWriter& content) {
    number(static_cast<std::uint8_t>(opcode)).number(std::uint64_t{content.bytes_.size()});
    return bytes(content.view());
  }

  [[nodiscard]] Bytes view() const { return {bytes_.data(), bytes_.size()}; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  void clear() { bytes_.clear(); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// A record that is shorter than what it should hold.
class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Takes a record's content apart. Throws RecordError where it ends early.
class RecordReader {
 public:
  explicit RecordReader(Bytes content) : content_(content) {}

  template <typename Number>
  [[nodiscard]] Number number() {
    const Bytes bytes = take(sizeof(Number));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Number); ++i) value |= std::uint64_t{bytes.data[i]} << (8U * i);
    return static_cast<Number>(value);
  }
  [[nodiscard]] std::string text() {
    const Bytes bytes = take(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(bytes.data), bytes.size};
  }
  [[nodiscard]] Bytes take(std::uint64_t size) {
    if (size > content_.size - at_) throw RecordError("a record of an MCAP file ends early");
    const Bytes bytes{content_.data + at_, static_cast<std::size_t>(size)};
    at_ += bytes.size;
    return bytes;
  }
  [[nodiscard]] std::map<std::string, std::string> texts() {
    RecordReader inner(take(number<std::uint32_t>()));
    std::map<std::string, std::string> values;
    while (inner.any()) {
      std::string key = inner.text();
      values[key] = inner.text();
    }
    return values;
  }
  [[nodiscard]] bool any() const { return at_ < content_.size; }
  [[nodiscard]] Bytes rest() { return take(content_.size - at_); }

 private:
  Bytes content_;
  std::size_t at_ = 0;
};

}  // namespace ear::rosbag2
