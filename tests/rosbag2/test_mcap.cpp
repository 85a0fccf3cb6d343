#include <doctest/doctest.h>
#include <lz4frame.h>
#include <sys/resource.h>

#include <csignal>
#include <functional>

#include "src/ros2/outgoing.h"
#include "src/rosbag2/compression.h"
#include "src/rosbag2/mcap_file.h"
#include "src/rosbag2/mcap_writer.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::rosbag2;
using ear::test::contains;
using ear::test::input_error_of;
using ear::test::TempFolder;

namespace fs = std::filesystem;

namespace {

Bytes view(const std::vector<std::uint8_t>& bytes) { return {bytes.data(), bytes.size()}; }

std::vector<std::uint8_t> content(int i) {
  return std::vector<std::uint8_t>(100 + std::size_t(i % 7), std::uint8_t(i));
}

/// `count` messages on /a, and on /b every tenth, 1 ms apart, in chunks of about 1 kB.
void write_file(const fs::path& file, int count, const std::function<void(McapWriter&)>& then = {}) {
  McapOptions options;
  options.chunk_bytes = 1000;
  McapWriter writer(file, options);
  const auto a = writer.add_channel("/a", "sensor_msgs/msg/Imu");
  const auto b = writer.add_channel("/b", "sensor_msgs/msg/Imu", {{"key", "value"}});
  for (int i = 0; i < count; ++i) {
    writer.write(a, i * 1'000'000, i, view(content(i)));
    if (i % 10 == 0) writer.write(b, i * 1'000'000, i, view(content(i + 1)));
  }
  if (then) then(writer);
  writer.close();
}

/// How many messages there are; all are as write_file() made them, and none is missing before the last.
int count(const fs::path& file, const std::string& topic, Warnings& warnings) {
  const auto bag = open_mcap(file, warnings);
  const auto cursor = bag->open(topic);
  int i = 0;
  while (const auto message = cursor->next(warnings)) {
    const int number = topic == "/a" ? i : 10 * i;
    CHECK(message->received_ns == number * 1'000'000);
    CHECK(std::vector<std::uint8_t>(message->bytes.data, message->bytes.data + message->bytes.size) ==
          content(topic == "/a" ? number : number + 1));
    ++i;
  }
  return i;
}

int count(const fs::path& file, const std::string& topic) {
  Warnings warnings;
  const int found = count(file, topic, warnings);
  CHECK(warnings.empty());
  return found;
}

/// A file of one chunk with two messages of /a, by hand.
std::string file_with_chunk(const std::string& compression, std::uint64_t says, const std::vector<std::uint8_t>& packed,
                            std::uint32_t crc) {
  RecordWriter out;
  out.bytes({kMcapMagic.data(), kMcapMagic.size()});
  out.record(Opcode::header, RecordWriter().text("ros2").text("hand"));
  RecordWriter chunk;
  chunk.number(std::uint64_t{0}).number(std::uint64_t{1}).number(says).number(crc).text(compression);
  chunk.number(std::uint64_t{packed.size()}).bytes(view(packed));
  out.record(Opcode::chunk, chunk).record(Opcode::data_end, RecordWriter().number(std::uint32_t{0}));
  return {reinterpret_cast<const char*>(out.view().data), out.size()};
}

std::vector<std::uint8_t> two_messages() {
  RecordWriter records;
  records.record(Opcode::schema, RecordWriter().number(std::uint16_t{1}).text("t/msg/T").text("").number(0U));
  records.record(Opcode::channel,
                 RecordWriter().number(std::uint16_t{0}).number(std::uint16_t{1}).text("/a").text("cdr").texts({}));
  for (int i = 0; i < 2; ++i) {
    RecordWriter message;
    message.number(std::uint16_t{0})
        .number(std::uint32_t(i))
        .number(std::uint64_t(i) * 1'000'000U)
        .number(std::uint64_t{0});
    records.record(Opcode::message, message.bytes(view(content(i))));
  }
  return {records.view().data, records.view().data + records.size()};
}

std::vector<std::uint8_t> lz4_of(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> packed(LZ4F_compressFrameBound(bytes.size(), nullptr));
  packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  return packed;
}

}  // namespace

TEST_CASE("mcap: what is written is read, topic by topic") {
  const TempFolder folder;
  write_file(folder / "a.mcap", 100, [](McapWriter& writer) { writer.attach("note.txt", "text/plain", "hello"); });
  CHECK(count(folder / "a.mcap", "/a") == 100);
  CHECK(count(folder / "a.mcap", "/b") == 10);
  CHECK(count(folder / "a.mcap", "/none") == 0);
  Warnings warnings;
  const auto file = open_mcap(folder / "a.mcap", warnings);
  REQUIRE(file->topics().size() == 2);
  CHECK(file->topics()[1].name == "/b");
  CHECK(file->topics()[1].type == "sensor_msgs/msg/Imu");
  CHECK(file->topics()[1].encoding == "cdr");
  CHECK(file->topics()[1].metadata.at("key") == "value");
  CHECK(file->attachments().at("note.txt") == "hello");
  CHECK(file->last("/b")->received_ns == 90'000'000);
  CHECK_FALSE(file->last("/none"));
}

TEST_CASE("mcap: an empty file is one") {
  const TempFolder folder;
  write_file(folder / "a.mcap", 0);
  CHECK(count(folder / "a.mcap", "/a") == 0);
}

TEST_CASE("mcap: a file that ends anywhere is read up to there") {
  const TempFolder folder;
  write_file(folder / "a.mcap", 60);
  const std::string whole = test::read_text(folder / "a.mcap");
  int before = 0;
  for (std::size_t size = kMcapMagic.size(); size < whole.size(); size += size < 400 ? 1 : 61) {
    CAPTURE(size);
    test::write_text(folder / "torn.mcap", whole.substr(0, size));
    Warnings warnings;
    const int found = count(folder / "torn.mcap", "/a", warnings);
    CHECK(found >= before);
    before = found;
  }
  CHECK(before == 60);  // all is there without its end
  test::write_text(folder / "torn.mcap", whole.substr(0, whole.size() / 2));
  Warnings warnings;
  CHECK(count(folder / "torn.mcap", "/a", warnings) > 10);
  REQUIRE(warnings.list().size() == 1);
  CHECK(warnings.list()[0].kind == "bag: torn");
  CHECK(contains(warnings.list()[0].first, "torn.mcap: byte "));
}

TEST_CASE("mcap: any byte may be wrong") {
  const TempFolder folder;
  write_file(folder / "a.mcap", 30);
  const std::string whole = test::read_text(folder / "a.mcap");
  for (std::size_t at = 0; at < whole.size(); at += 3) {
    CAPTURE(at);
    std::string wrong = whole;
    wrong[at] = static_cast<char>(wrong[at] ^ 0xff);
    test::write_text(folder / "wrong.mcap", wrong);
    Warnings warnings;
    try {
      const auto file = open_mcap(folder / "wrong.mcap", warnings);
      const auto cursor = file->open("/a");
      int found = 0;
      while (cursor->next(warnings)) ++found;
      CHECK(found <= 30);
      static_cast<void>(file->last("/b"));
      static_cast<void>(file->attachments());
    } catch (const InputError& error) {
      CHECK(contains(error.what(), "wrong.mcap"));
    }
  }
}

TEST_CASE("mcap: a damaged chunk is left out, and counted once") {
  const TempFolder folder;
  write_file(folder / "a.mcap", 60);
  std::string wrong = test::read_text(folder / "a.mcap");
  const std::size_t at = wrong.find("zstd") + 30;  // within the first chunk's records
  wrong[at] = static_cast<char>(wrong[at] ^ 0x10);
  test::write_text(folder / "a.mcap", wrong);
  Warnings warnings;
  const auto file = open_mcap(folder / "a.mcap", warnings);
  for (int pass = 0; pass < 2; ++pass) {
    const auto cursor = file->open("/a");
    int found = 0;
    while (cursor->next(warnings)) ++found;
    CHECK(found > 40);
    CHECK(found < 60);
  }
  REQUIRE(warnings.list().size() == 1);
  CHECK(warnings.list()[0].kind == "bag: damaged chunk");
  CHECK(warnings.list()[0].count == 1);
}

TEST_CASE("mcap: chunks by lz4 and by nothing, and false sizes of them") {
  const TempFolder folder;
  const std::vector<std::uint8_t> plain = two_messages();
  const auto write = [&](const std::string& compression, std::uint64_t says, const std::vector<std::uint8_t>& packed,
                         std::uint32_t crc) {
    test::write_text(folder / "a.mcap", file_with_chunk(compression, says, packed, crc));
    Warnings warnings;
    const int found = count(folder / "a.mcap", "/a", warnings);
    return std::to_string(found) + (warnings.empty() ? "" : ": " + warnings.list()[0].first);
  };
  const std::vector<std::uint8_t> lz4 = lz4_of(plain), zstd = compressed_zstd(view(plain), 3);
  const std::uint32_t crc = crc32_of(view(plain));
  CHECK(write("", plain.size(), plain, crc) == "2");
  CHECK(write("lz4", plain.size(), lz4, crc) == "2");
  CHECK(write("zstd", plain.size(), zstd, 0) == "2");
  CHECK(contains(write("zstd", plain.size(), zstd, crc + 1), "0: "));
  CHECK(contains(write("zstd", plain.size(), zstd, crc + 1), "has another checksum"));
  CHECK(contains(write("zstd", plain.size() - 1, zstd, crc), "says"));
  CHECK(contains(write("zstd", ~std::uint64_t{0}, zstd, crc), "says it unpacks to 18446744073709551615 bytes"));
  CHECK(contains(write("lz4", plain.size(), zstd, crc), "not lz4, or damaged"));
  CHECK(contains(write("zstd", plain.size(), lz4, crc), "not zstd, or damaged"));
  CHECK(contains(write("zstd", plain.size(), {zstd.begin(), zstd.end() - 5}, crc), "zstd: ends early"));
  CHECK(contains(write("lz4", plain.size(), {lz4.begin(), lz4.end() - 9}, crc), "lz4: ends early"));
  CHECK(contains(write("snappy", plain.size(), zstd, crc), "compression 'snappy' is not known: zstd, lz4"));
}

TEST_CASE("mcap: what is no such file is refused by name") {
  const TempFolder folder;
  test::write_text(folder / "text.mcap", "no bag, but a text\n");
  test::write_text(folder / "empty.mcap", "");
  Warnings warnings;
  for (const char* name : {"text.mcap", "empty.mcap"}) {
    CHECK(contains(input_error_of([&] { static_cast<void>(open_mcap(folder / name, warnings)); }),
                   std::string(name) + ": is no MCAP file"));
  }
  CHECK(contains(input_error_of([&] { static_cast<void>(open_mcap(folder / "missing.mcap", warnings)); }),
                 "missing.mcap: cannot be read"));
}

TEST_CASE("mcap writer: a file is never written over") {
  const TempFolder folder;
  write_file(folder / "a.mcap", 3);
  CHECK(contains(input_error_of([&] { const McapWriter again(folder / "a.mcap"); }), "a.mcap: cannot be created"));
  CHECK(count(folder / "a.mcap", "/a") == 3);
}

TEST_CASE("mcap writer: what was flushed is in the file, and time makes chunks, too") {
  const TempFolder folder;
  Warnings warnings;
  McapWriter writer(folder / "a.mcap");
  const auto a = writer.add_channel("/a", "sensor_msgs/msg/Imu");
  writer.write(a, 0, 0, view(content(0)));
  CHECK(count(folder / "a.mcap", "/b", warnings) == 0);
  writer.flush();
  CHECK(count(folder / "a.mcap", "/a", warnings) == 1);
  for (int i = 1; i <= 1003; ++i) writer.write(a, i * 1'000'000, 0, view(content(i)));
  CHECK(count(folder / "a.mcap", "/a", warnings) == 1002);
  writer.close();
  CHECK(contains(input_error_of([&] { writer.write(a, 0, 0, view(content(0))); }), "takes no more messages"));
  CHECK(count(folder / "a.mcap", "/a") == 1004);
}

TEST_CASE("mcap writer: on a full disk all that was written stays, without a torn end") {
  const TempFolder folder;
  const auto ignore = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit limit = before;
  limit.rlim_cur = 3000;
  setrlimit(RLIMIT_FSIZE, &limit);
  const std::string said = input_error_of([&] { write_file(folder / "a.mcap", 1000); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, ignore);
  CHECK(contains(said, "a.mcap: cannot be written: File too large; it holds what was written up to byte"));
  Warnings warnings;
  CHECK(count(folder / "a.mcap", "/a", warnings) > 5);
  REQUIRE(warnings.list().size() == 1);
  CHECK(contains(warnings.list()[0].first, "has no end: read up to its last record"));
}
