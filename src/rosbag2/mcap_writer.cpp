#include "src/rosbag2/mcap_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "src/log/log.h"
#include "src/recording/input_error.h"
#include "src/ros2/definition.h"
#include "src/rosbag2/compression.h"

namespace ear::rosbag2 {
namespace {

std::uint64_t unsigned_time(TimeNs t_ns) { return t_ns > 0 ? static_cast<std::uint64_t>(t_ns) : 0; }

Bytes bytes_of(const std::string& text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

}  // namespace

McapWriter::McapWriter(std::filesystem::path file, McapOptions options)
    : file_(std::move(file)), options_(std::move(options)) {
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw InputError(located(file_, 0, "", std::string("cannot be created: ") + strerror(errno)));
  RecordWriter start;
  start.bytes({kMcapMagic.data(), kMcapMagic.size()});
  start.record(Opcode::header, RecordWriter().text("ros2").text(options_.library));
  put(start);
}

McapWriter::~McapWriter() {
  try {
    close();
  } catch (const std::exception& error) {
    log_error(error.what());
  }
  if (descriptor_ >= 0) ::close(descriptor_);
}

McapWriter::Channel McapWriter::add_channel(const std::string& topic, const std::string& type,
                                            const std::map<std::string, std::string>& metadata,
                                            const std::string& definition) {
  if (channels_.size() >= 65535) throw InputError(located(file_, 0, topic, "more than 65535 topics"));
  const auto channel = static_cast<Channel>(channels_.size());
  ChannelState state;
  const auto [schema, is_new] =
      summary_.schema_ids.emplace(type, static_cast<std::uint16_t>(summary_.schema_ids.size() + 1));
  const std::string text = definition.empty() ? ros2::definition_of(type) : definition;
  RecordWriter schema_record;
  schema_record.number(schema->second).text(type).text("ros2msg");
  schema_record.number(static_cast<std::uint32_t>(text.size())).bytes(bytes_of(text));
  state.records.record(Opcode::schema, schema_record);
  if (is_new) summary_.schemas.record(Opcode::schema, schema_record);

  RecordWriter record;
  record.number(channel).number(schema->second).text(topic).text("cdr").texts(metadata);
  state.records.record(Opcode::channel, record);
  summary_.channels.record(Opcode::channel, record);
  channels_.push_back(std::move(state));
  return channel;
}

void McapWriter::begin(std::uint64_t log_ns) {
  chunk_.any = true;
  chunk_.first_ns = chunk_.last_ns = log_ns;
}

void McapWriter::write(Channel channel, TimeNs log_ns, TimeNs publish_ns, Bytes bytes) {
  if (descriptor_ < 0) throw InputError(located(file_, 0, "", "takes no more messages"));
  ChannelState& state = channels_.at(channel);
  const std::uint64_t time = unsigned_time(log_ns);
  const bool old = chunk_.any && time > chunk_.first_ns + unsigned_time(options_.chunk_ns);
  if (old || chunk_.records.size() >= options_.chunk_bytes) flush();
  if (!chunk_.any) begin(time);
  if (!std::exchange(state.described, true)) chunk_.records.bytes(state.records.view());
  state.index.emplace_back(time, chunk_.records.size());
  chunk_.records.number(static_cast<std::uint8_t>(Opcode::message)).number(std::uint64_t{kMessageHead + bytes.size});
  chunk_.records.number(channel).number(state.messages++).number(time).number(unsigned_time(publish_ns)).bytes(bytes);
  chunk_.first_ns = std::min(chunk_.first_ns, time);
  chunk_.last_ns = std::max(chunk_.last_ns, time);
}

void McapWriter::flush() {
  if (!chunk_.any) return;
  const std::vector<std::uint8_t> packed = compressed_zstd(chunk_.records.view(), options_.zstd_level);
  RecordWriter content;
  content.number(chunk_.first_ns).number(chunk_.last_ns).number(std::uint64_t{chunk_.records.size()});
  content.number(crc32_of(chunk_.records.view())).text("zstd");
  content.number(std::uint64_t{packed.size()}).bytes({packed.data(), packed.size()});
  RecordWriter out;
  out.record(Opcode::chunk, content);

  RecordWriter offsets;  // where each channel's index is
  const std::uint64_t chunk_length = out.size();
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    auto& index = channels_[i].index;
    if (index.empty()) continue;
    offsets.number(static_cast<std::uint16_t>(i)).number(offset_ + out.size());
    RecordWriter entries;
    for (const auto& [time, at] : index) entries.number(time).number(at);
    out.record(Opcode::message_index, RecordWriter()
                                          .number(static_cast<std::uint16_t>(i))
                                          .number(static_cast<std::uint32_t>(entries.size()))
                                          .bytes(entries.view()));
    summary_.messages += index.size();
    index.clear();
  }
  RecordWriter entry;
  entry.number(chunk_.first_ns).number(chunk_.last_ns).number(offset_).number(chunk_length);
  entry.number(static_cast<std::uint32_t>(offsets.size())).bytes(offsets.view());
  entry.number(std::uint64_t{out.size()} - chunk_length).text("zstd");
  entry.number(std::uint64_t{packed.size()}).number(std::uint64_t{chunk_.records.size()});
  put(out);
  summary_.chunks.record(Opcode::chunk_index, entry);
  const bool first = summary_.chunk_count++ == 0;
  summary_.first_ns = first ? chunk_.first_ns : std::min(summary_.first_ns, chunk_.first_ns);
  summary_.last_ns = std::max(summary_.last_ns, chunk_.last_ns);
  chunk_.records.clear();
  chunk_.any = false;
}

void McapWriter::attach(const std::string& name, const std::string& media_type, const std::string& content) {
  flush();
  RecordWriter record;
  record.number(std::uint64_t{0}).number(std::uint64_t{0}).text(name).text(media_type);
  record.number(std::uint64_t{content.size()}).bytes(bytes_of(content));
  record.number(crc32_of(record.view()));
  RecordWriter out;
  out.record(Opcode::attachment, record);
  RecordWriter entry;
  entry.number(offset_).number(std::uint64_t{out.size()}).number(std::uint64_t{0}).number(std::uint64_t{0});
  entry.number(std::uint64_t{content.size()}).text(name).text(media_type);
  put(out);
  summary_.attachments.record(Opcode::attachment_index, entry);
  ++summary_.attachment_count;
}

RecordWriter McapWriter::statistics() const {
  RecordWriter counts;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    counts.number(static_cast<std::uint16_t>(i)).number(std::uint64_t{channels_[i].messages});
  }
  RecordWriter content;
  content.number(summary_.messages).number(static_cast<std::uint16_t>(summary_.schema_ids.size()));
  content.number(static_cast<std::uint32_t>(channels_.size())).number(summary_.attachment_count);
  content.number(std::uint32_t{0}).number(summary_.chunk_count).number(summary_.first_ns).number(summary_.last_ns);
  content.number(static_cast<std::uint32_t>(counts.size())).bytes(counts.view());
  RecordWriter record;
  record.record(Opcode::statistics, content);
  return record;
}

void McapWriter::close() {
  if (descriptor_ < 0) return;
  flush();
  RecordWriter end;
  end.record(Opcode::data_end, RecordWriter().number(std::uint32_t{0}));
  const std::uint64_t start = offset_ + end.size();

  RecordWriter summary, offsets;
  const auto group = [&](Opcode opcode, const RecordWriter& records) {
    if (records.size() == 0) return;
    offsets.record(Opcode::summary_offset, RecordWriter()
                                               .number(static_cast<std::uint8_t>(opcode))
                                               .number(start + summary.size())
                                               .number(std::uint64_t{records.size()}));
    summary.bytes(records.view());
  };
  group(Opcode::schema, summary_.schemas);
  group(Opcode::channel, summary_.channels);
  group(Opcode::chunk_index, summary_.chunks);
  group(Opcode::attachment_index, summary_.attachments);
  group(Opcode::statistics, statistics());
  const std::uint64_t offsets_start = start + summary.size();
  summary.bytes(offsets.view());
  // The footer's checksum is of all from the summary's start to itself.
  summary.number(static_cast<std::uint8_t>(Opcode::footer)).number(std::uint64_t{kFooterSize});
  summary.number(start).number(offsets_start);
  summary.number(crc32_of(summary.view())).bytes({kMcapMagic.data(), kMcapMagic.size()});
  end.bytes(summary.view());
  put(end);
  const int descriptor = std::exchange(descriptor_, -1);
  if (::close(descriptor) != 0) throw InputError(located(file_, 0, "", std::string("at its end: ") + strerror(errno)));
}

void McapWriter::put(const RecordWriter& records) {
  if (descriptor_ < 0) throw InputError(located(file_, 0, "", "takes no more records"));
  Bytes rest = records.view();
  while (rest.size > 0) {
    const ssize_t written = ::write(descriptor_, rest.data, rest.size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const std::string reason = strerror(errno);
      const bool cut = ::ftruncate(descriptor_, static_cast<off_t>(offset_)) == 0;
      ::close(std::exchange(descriptor_, -1));
      throw InputError(located(file_, 0, "",
                               "cannot be written: " + reason + "; it holds what was written up to byte " +
                                   std::to_string(offset_) + (cut ? "" : ", and a torn rest")));
    }
    rest.data += written;
    rest.size -= static_cast<std::size_t>(written);
  }
  offset_ += records.size();
}

}  // namespace ear::rosbag2
