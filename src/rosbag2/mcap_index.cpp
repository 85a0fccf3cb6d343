#include "src/rosbag2/mcap_index.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "src/recording/input_error.h"
#include "src/rosbag2/compression.h"

namespace ear::rosbag2 {
namespace {

constexpr std::uint64_t kTail = kRecordHead + kFooterSize + kMcapMagic.size();  // footer record and magic

bool is_magic(const std::vector<std::uint8_t>& bytes) {
  return std::equal(kMcapMagic.begin(), kMcapMagic.end(), bytes.begin(), bytes.end());
}

/// Collects schemas and channels.
class Channels {
 public:
  void schema(RecordReader record) {
    const auto id = record.number<std::uint16_t>();
    types_[id] = record.text();
  }
  void channel(RecordReader record, McapIndex& index) {
    const auto id = record.number<std::uint16_t>();
    const auto type = types_.find(record.number<std::uint16_t>());
    BagTopic topic;
    topic.type = type == types_.end() ? "" : ros2::canonical_type(type->second);
    topic.name = record.text();
    topic.encoding = record.text();
    topic.metadata = record.texts();
    index.channels[id] = std::move(topic);
  }
  /// True if the record was one of them.
  bool take(Opcode opcode, Bytes content, McapIndex& index) {
    if (opcode == Opcode::schema) schema(RecordReader(content));
    if (opcode == Opcode::channel) channel(RecordReader(content), index);
    return opcode == Opcode::schema || opcode == Opcode::channel;
  }

 private:
  std::map<std::uint16_t, std::string> types_;
};

Section chunk_of(RecordReader record, const FileBytes& file) {
  Section section;
  section.chunk = true;
  section.first_ns = record.number<std::uint64_t>();
  static_cast<void>(record.number<std::uint64_t>());
  const auto offset = record.number<std::uint64_t>();
  const auto length = record.number<std::uint64_t>();
  if (offset > file.size() || length < kRecordHead || length > file.size() - offset) {
    throw RecordError("the index names a chunk beyond the file's end");
  }
  section.begin = offset + kRecordHead;
  section.end = offset + length;
  RecordReader offsets(record.take(record.number<std::uint32_t>()));
  while (offsets.any()) {
    section.channels.push_back(offsets.number<std::uint16_t>());
    static_cast<void>(offsets.number<std::uint64_t>());
  }
  return section;
}

void attachment_of(RecordReader record, McapIndex& index) {
  const auto offset = record.number<std::uint64_t>();
  const auto length = record.number<std::uint64_t>();
  for (int skipped = 0; skipped < 3; ++skipped) static_cast<void>(record.number<std::uint64_t>());
  if (length >= kRecordHead) index.attachments[record.text()] = {offset + kRecordHead, length - kRecordHead};
}

/// Nothing if there is no summary, or it does not say what is needed.
std::optional<McapIndex> from_summary(const FileBytes& file) {
  if (file.size() < kMcapMagic.size() + kTail) return std::nullopt;
  const std::uint64_t footer = file.size() - kTail;
  if (!is_magic(file.read(file.size() - kMcapMagic.size(), kMcapMagic.size()))) return std::nullopt;
  const std::vector<std::uint8_t> footer_bytes = file.read(footer, kRecordHead + kFooterSize);
  if (footer_bytes[0] != static_cast<std::uint8_t>(Opcode::footer)) return std::nullopt;
  RecordReader fields({footer_bytes.data() + kRecordHead, kFooterSize});
  const auto start = fields.number<std::uint64_t>();
  static_cast<void>(fields.number<std::uint64_t>());
  const auto crc = fields.number<std::uint32_t>();
  if (start < kMcapMagic.size() || start >= footer) return std::nullopt;

  const std::vector<std::uint8_t> summary = file.read(start, footer - start);
  const std::uint32_t part = crc32_of({summary.data(), summary.size()});
  if (crc != 0 && crc != crc32_of({footer_bytes.data(), footer_bytes.size() - sizeof(crc)}, part)) {
    throw RecordError("the summary's checksum is another one");
  }
  McapIndex index;
  Channels channels;
  std::optional<std::uint64_t> messages;
  for_each_record({summary.data(), summary.size()}, [&](Opcode opcode, Bytes content) {
    if (channels.take(opcode, content, index)) return;
    if (opcode == Opcode::chunk_index) index.sections.push_back(chunk_of(RecordReader(content), file));
    if (opcode == Opcode::attachment_index) attachment_of(RecordReader(content), index);
    if (opcode == Opcode::statistics) messages = RecordReader(content).number<std::uint64_t>();
  });
  const bool nothing_there = messages && *messages == 0;
  if (index.channels.empty() && !nothing_there) return std::nullopt;
  if (index.sections.empty() && !nothing_there) return std::nullopt;  // no chunks, or none in the index: look
  std::stable_sort(index.sections.begin(), index.sections.end(),
                   [](const Section& a, const Section& b) { return a.first_ns < b.first_ns; });
  return index;
}

/// Reads through a file from its beginning.
class Scan {
 public:
  Scan(const FileBytes& file, Warnings& warnings) : file_(file), warnings_(warnings) {}

  McapIndex run() {
    std::uint64_t at = kMcapMagic.size();
    bool ended = false;
    while (!ended && at < file_.size()) {
      try {
        const RecordHead head = read_head(file_, at, file_.size());
        ended = head.opcode == Opcode::data_end || head.opcode == Opcode::footer;
        take(head, at);
        at = head.end();
      } catch (const InputError& error) {
        warnings_.add("bag: torn", error.what());
        return index_;
      }
    }
    if (!ended) warnings_.add("bag: torn", located(file_.file(), 0, "", "has no end: read up to its last record"));
    return index_;
  }

 private:
  void take(const RecordHead& head, std::uint64_t at) {
    try {
      if (head.opcode == Opcode::chunk) return take_chunk(head);
      if (head.opcode == Opcode::message) return take_message(head, at);
      if (head.opcode == Opcode::attachment) return take_attachment(head);
      if (head.opcode != Opcode::schema && head.opcode != Opcode::channel) return;
      const std::vector<std::uint8_t> content = file_.read(head.content, head.length);
      static_cast<void>(channels_.take(head.opcode, {content.data(), content.size()}, index_));
    } catch (const RecordError& error) {
      warnings_.add("bag: damaged record", located(file_.file(), 0, "byte " + std::to_string(at), error.what()));
    }
  }

  void take_chunk(const RecordHead& head) {
    Section section{head.content, head.end(), true, 0, {}};
    std::vector<std::uint8_t> records;
    try {
      records = unpack_chunk(file_, section);
    } catch (const InputError& error) {
      warnings_.add("bag: damaged chunk", error.what());
      return;
    }
    std::vector<bool> seen(65536);
    for_each_record({records.data(), records.size()}, [&](Opcode opcode, Bytes content) {
      if (channels_.take(opcode, content, index_) || opcode != Opcode::message) return;
      const auto channel = RecordReader(content).number<std::uint16_t>();
      if (!seen[channel]) section.channels.push_back(channel);
      seen[channel] = true;
    });
    if (!section.channels.empty()) index_.sections.push_back(std::move(section));
  }

  /// Messages outside of chunks that follow each other are one section.
  void take_message(const RecordHead& head, std::uint64_t at) {
    const bool joins = !index_.sections.empty() && !index_.sections.back().chunk;
    if (!joins) index_.sections.push_back({at, at, false, 0, {}});
    index_.sections.back().end = head.end();
  }

  void take_attachment(const RecordHead& head) {
    const std::vector<std::uint8_t> content = file_.read(head.content, head.length);
    RecordReader record({content.data(), content.size()});
    static_cast<void>(record.take(16));  // times
    index_.attachments[record.text()] = {head.content, head.length};
  }

  const FileBytes& file_;
  Warnings& warnings_;
  McapIndex index_;
  Channels channels_;
};

}  // namespace

FileBytes::FileBytes(std::filesystem::path file) : file_(std::move(file)) {
  descriptor_ = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    const std::string reason = strerror(errno);
    if (descriptor_ >= 0) ::close(descriptor_);
    throw InputError(located(file_, 0, "", "cannot be read: " + reason));
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

FileBytes::~FileBytes() { ::close(descriptor_); }

std::vector<std::uint8_t> FileBytes::read(std::uint64_t offset, std::uint64_t count) const {
  if (offset > size_ || count > size_ - offset) {
    throw InputError(located(file_, 0, "byte " + std::to_string(offset),
                             std::to_string(count) + " bytes wanted, but the file ends at " + std::to_string(size_)));
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(count));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw InputError(located(file_, 0, "byte " + std::to_string(offset + done), "cannot be read"));
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

RecordHead read_head(const FileBytes& file, std::uint64_t offset, std::uint64_t end) {
  const std::string place = "byte " + std::to_string(offset);
  if (offset > end || end - offset < kRecordHead) {
    throw InputError(located(file.file(), 0, place, "ends within a record: read up to there"));
  }
  const std::vector<std::uint8_t> bytes = file.read(offset, kRecordHead);
  RecordReader reader({bytes.data(), bytes.size()});
  RecordHead head;
  head.opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
  head.length = reader.number<std::uint64_t>();
  head.content = offset + kRecordHead;
  if (head.length > end - head.content) {
    throw InputError(located(file.file(), 0, place,
                             "a record of " + std::to_string(head.length) + " bytes, but " +
                                 std::to_string(end - head.content) + " are left: read up to there"));
  }
  return head;
}

std::vector<std::uint8_t> unpack_chunk(const FileBytes& file, const Section& section) {
  const std::vector<std::uint8_t> content = file.read(section.begin, section.end - section.begin);
  const auto damaged = [&](const std::string& what) {
    return InputError(located(file.file(), 0, "chunk at byte " + std::to_string(section.begin), what));
  };
  try {
    RecordReader reader({content.data(), content.size()});
    static_cast<void>(reader.take(16));  // times
    const auto size = reader.number<std::uint64_t>();
    const auto crc = reader.number<std::uint32_t>();
    const std::string compression = reader.text();
    const Bytes packed = reader.take(reader.number<std::uint64_t>());
    if (size > kLargestPiece) throw damaged("says it unpacks to " + std::to_string(size) + " bytes");
    std::vector<std::uint8_t> records = decompressed(packed, compression, static_cast<std::size_t>(size) + 1);
    if (records.size() != size)
      throw damaged("unpacks to " + std::to_string(records.size()) + " bytes, says " + std::to_string(size));
    if (crc != 0 && crc != crc32_of({records.data(), records.size()})) throw damaged("has another checksum");
    for_each_record({records.data(), records.size()}, [](Opcode /*opcode*/, Bytes /*content*/) {});
    return records;
  } catch (const RecordError& error) {
    throw damaged(error.what());
  } catch (const InputError& error) {
    const std::string what = error.what();
    throw what.find("chunk at byte") == std::string::npos ? damaged(what) : error;
  }
}

McapIndex read_mcap_index(const FileBytes& file, Warnings& warnings) {
  if (file.size() < kMcapMagic.size() || !is_magic(file.read(0, kMcapMagic.size()))) {
    throw InputError(located(file.file(), 0, "", "is no MCAP file: its first bytes are others"));
  }
  try {
    if (std::optional<McapIndex> index = from_summary(file)) return std::move(*index);
  } catch (const RecordError& error) {
    warnings.add("bag: damaged index", located(file.file(), 0, "summary", error.what()));
  }
  return Scan(file, warnings).run();
}

}  // namespace ear::rosbag2
