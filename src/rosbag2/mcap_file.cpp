#include "src/rosbag2/mcap_file.h"

#include <algorithm>
#include <list>
#include <mutex>
#include <set>
#include <utility>

#include "src/recording/input_error.h"
#include "src/rosbag2/compression.h"
#include "src/rosbag2/mcap_index.h"

namespace ear::rosbag2 {
namespace {

using Memory = std::shared_ptr<const std::vector<std::uint8_t>>;

constexpr std::size_t kCacheBytes = std::size_t{8} << 20U;

/// Unpacks chunks and keeps the last ones: cursors of several topics pass over them at about the same time.
class Chunks {
 public:
  explicit Chunks(const FileBytes& file) : file_(file) {}

  /// Null, and counted once, if it is damaged.
  Memory get(const Section& section, Warnings& warnings) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found =
        std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.begin == section.begin; });
    if (found != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, found);
      return kept_.front().records;
    }
    if (damaged_.count(section.begin) > 0) return nullptr;
    try {
      auto records = std::make_shared<const std::vector<std::uint8_t>>(unpack_chunk(file_, section));
      bytes_ += records->size();
      kept_.push_front({section.begin, records});
      while (bytes_ > kCacheBytes && kept_.size() > 1) {
        bytes_ -= kept_.back().records->size();
        kept_.pop_back();
      }
      return records;
    } catch (const InputError& error) {
      damaged_.insert(section.begin);
      warnings.add("bag: damaged chunk", error.what());
      return nullptr;
    }
  }

 private:
  struct Kept {
    std::uint64_t begin;
    Memory records;
  };
  const FileBytes& file_;
  std::mutex mutex_;
  std::list<Kept> kept_;  // the last used first
  std::size_t bytes_ = 0;
  std::set<std::uint64_t> damaged_;
};

/// A message's head, and the rest.
struct MessageRecord {
  std::uint16_t channel = 0;
  TimeNs log_ns = 0;
  Bytes bytes;
};

MessageRecord message_of(Bytes content) {
  RecordReader reader(content);
  MessageRecord message;
  message.channel = reader.number<std::uint16_t>();
  static_cast<void>(reader.number<std::uint32_t>());
  message.log_ns = static_cast<TimeNs>(reader.number<std::uint64_t>());
  static_cast<void>(reader.number<std::uint64_t>());
  message.bytes = reader.rest();
  return message;
}

/// Walks over the messages of some channels within one section.
class SectionWalk {
 public:
  SectionWalk(const FileBytes& file, const std::set<std::uint16_t>& channels) : file_(file), channels_(channels) {}

  void begin(const Section& section, Memory records) {
    section_ = section;
    records_ = std::move(records);
    at_ = records_ ? 0 : section.begin;
  }

  /// Throws RecordError or InputError where a record cannot be; the section is then at its end.
  std::optional<BagMessage> next() {
    const std::uint64_t end = records_ ? records_->size() : section_.end;
    while (at_ < end) {
      if (auto message = records_ ? in_chunk() : in_file(end)) return message;
    }
    return std::nullopt;
  }

 private:
  std::optional<BagMessage> in_chunk() {
    RecordReader reader({records_->data() + at_, records_->size() - static_cast<std::size_t>(at_)});
    const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
    const Bytes content = reader.take(reader.number<std::uint64_t>());
    at_ += kRecordHead + content.size;
    if (opcode != Opcode::message) return std::nullopt;
    const MessageRecord message = message_of(content);
    if (channels_.count(message.channel) == 0) return std::nullopt;
    return BagMessage{message.log_ns, message.bytes, records_};
  }

  std::optional<BagMessage> in_file(std::uint64_t end) {
    const std::uint64_t at = std::exchange(at_, end);  // in case of an error
    const RecordHead head = read_head(file_, at, end);
    at_ = head.end();
    if (head.opcode != Opcode::message || head.length < kMessageHead || head.length > kLargestPiece)
      return std::nullopt;
    const std::vector<std::uint8_t> id = file_.read(head.content, sizeof(std::uint16_t));
    if (channels_.count(RecordReader({id.data(), id.size()}).number<std::uint16_t>()) == 0) return std::nullopt;
    auto content = std::make_shared<const std::vector<std::uint8_t>>(file_.read(head.content, head.length));
    const MessageRecord message = message_of({content->data(), content->size()});
    return BagMessage{message.log_ns, message.bytes, std::move(content)};
  }

  const FileBytes& file_;
  const std::set<std::uint16_t>& channels_;
  Section section_;
  Memory records_;
  std::uint64_t at_ = 0;
};

class McapCursor : public TopicCursor {
 public:
  McapCursor(const FileBytes& file, const McapIndex& index, Chunks& chunks, std::set<std::uint16_t> channels)
      : file_(file), index_(index), chunks_(chunks), channels_(std::move(channels)), walk_(file, channels_) {}

  std::optional<BagMessage> next(Warnings& warnings) override {
    while (true) {
      try {
        if (walking_) {
          if (auto message = walk_.next()) return message;
        }
      } catch (const std::runtime_error& error) {  // RecordError or InputError
        warnings.add("bag: damaged record", located(file_.file(), 0, "", error.what()));
      }
      walking_ = false;
      if (section_ == index_.sections.size()) return std::nullopt;
      walking_ = enter(index_.sections[section_++], warnings);
    }
  }

 private:
  bool enter(const Section& section, Warnings& warnings) {
    const bool known = !section.channels.empty();
    if (known && std::none_of(section.channels.begin(), section.channels.end(),
                              [&](std::uint16_t channel) { return channels_.count(channel) > 0; })) {
      return false;
    }
    Memory records = section.chunk ? chunks_.get(section, warnings) : nullptr;
    if (section.chunk && !records) return false;
    walk_.begin(section, std::move(records));
    return true;
  }

  const FileBytes& file_;
  const McapIndex& index_;
  Chunks& chunks_;
  std::set<std::uint16_t> channels_;
  SectionWalk walk_;
  std::size_t section_ = 0;
  bool walking_ = false;
};

class McapFile : public BagFile {
 public:
  McapFile(const std::filesystem::path& file, Warnings& warnings)
      : file_(file), index_(read_mcap_index(file_, warnings)), chunks_(file_) {
    std::set<std::string> names;
    for (const auto& [id, topic] : index_.channels) {
      if (names.insert(topic.name).second) topics_.push_back(topic);
    }
  }

  const std::vector<BagTopic>& topics() const override { return topics_; }

  std::unique_ptr<TopicCursor> open(const std::string& topic) const override {
    return std::make_unique<McapCursor>(file_, index_, chunks_, channels_of(topic));
  }

  std::optional<BagMessage> last(const std::string& topic) const override {
    const std::set<std::uint16_t> channels = channels_of(topic);
    for (auto section = index_.sections.rbegin(); section != index_.sections.rend(); ++section) {
      McapIndex one;
      one.sections = {*section};
      McapCursor cursor(file_, one, chunks_, channels);
      Warnings ignored;  // the reading itself reports them
      std::optional<BagMessage> last;
      while (auto message = cursor.next(ignored)) last = std::move(message);
      if (last) return last;
    }
    return std::nullopt;
  }

  std::map<std::string, std::string> attachments() const override {
    std::map<std::string, std::string> files;
    for (const auto& [name, place] : index_.attachments) {
      if (place.second > kLargestPiece) continue;
      const std::vector<std::uint8_t> content = file_.read(place.first, place.second);
      try {
        RecordReader record({content.data(), content.size()});
        static_cast<void>(record.take(16));  // times
        static_cast<void>(record.text());
        static_cast<void>(record.text());
        const Bytes data = record.take(record.number<std::uint64_t>());
        files[name] = {reinterpret_cast<const char*>(data.data), data.size};
      } catch (const RecordError& error) {
        throw InputError(located(file_.file(), 0, "attachment " + name, error.what()));
      }
    }
    return files;
  }

 private:
  std::set<std::uint16_t> channels_of(const std::string& topic) const {
    std::set<std::uint16_t> ids;
    for (const auto& [id, channel] : index_.channels) {
      if (channel.name == topic) ids.insert(id);
    }
    return ids;
  }

  FileBytes file_;
  McapIndex index_;
  mutable Chunks chunks_;
  std::vector<BagTopic> topics_;
};

}  // namespace

std::unique_ptr<BagFile> open_mcap(const std::filesystem::path& file, Warnings& warnings) {
  return std::make_unique<McapFile>(file, warnings);
}

}  // namespace ear::rosbag2
