#include "src/rosbag2/bag.h"

#include <algorithm>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "src/recording/input_error.h"
#include "src/recording/yaml_map.h"
#include "src/rosbag2/compression.h"
#include "src/rosbag2/mcap_file.h"
#include "src/rosbag2/sqlite_file.h"

namespace ear::rosbag2 {
namespace {

namespace fs = std::filesystem;

bool is_packed(const fs::path& file) { return file.extension() == ".zstd" || file.extension() == ".zst"; }

/// ".mcap" or ".db3", also of a file that is compressed as a whole.
std::string storage_of(const fs::path& file) {
  return (is_packed(file) ? file.stem() : file.filename()).extension().string();
}

bool is_bag_file(const fs::path& file) { return storage_of(file) == ".mcap" || storage_of(file) == ".db3"; }

std::vector<fs::path> bag_files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && is_bag_file(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// What metadata.yaml says.
struct Metadata {
  std::vector<fs::path> files;
  bool packed_messages = false;
};

Metadata read_metadata(const fs::path& folder) {
  const fs::path file = folder / "metadata.yaml";
  const YamlMap map = YamlMap::load(file).child("rosbag2_bagfile_information");
  Metadata metadata;
  const auto storage = map.get<std::string>("storage_identifier");
  if (storage != "mcap" && storage != "sqlite3") {
    throw map.error("storage_identifier", "'" + storage + "' is not known: mcap, sqlite3");
  }
  for (const std::string& name : map.texts("relative_file_paths")) {
    const bool inside = fs::exists(folder / name);  // the first versions of rosbag2 put the folder's name before it
    metadata.files.push_back(folder / (inside ? fs::path(name) : fs::path(name).filename()));
  }
  const auto format = map.get_or("compression_format", std::string());
  const auto mode = map.get_or("compression_mode", std::string());
  if (!format.empty() && format != "zstd") throw map.error("compression_format", "'" + format + "' is not known: zstd");
  metadata.packed_messages = mode == "MESSAGE" || mode == "message";
  return metadata;
}

}  // namespace

bool is_bag(const fs::path& path) {
  if (!fs::is_directory(path)) return is_bag_file(path);
  return fs::exists(path / "metadata.yaml") ||
         (!fs::is_directory(path / "mav0") && !fs::is_directory(path / "imu0") && !bag_files_in(path).empty());
}

Bag::Bag(fs::path path, Warnings& warnings) : path_(std::move(path)) {
  Metadata metadata;
  if (!fs::is_directory(path_)) {
    metadata.files = {path_};
  } else if (fs::exists(path_ / "metadata.yaml")) {
    metadata = read_metadata(path_);
  } else {
    metadata.files = bag_files_in(path_);
    warnings.add("bag: no metadata.yaml", located(path_, 0, "", "all bag files in it are read, by name"));
  }
  messages_are_packed_ = metadata.packed_messages;
  try {
    for (const fs::path& file : metadata.files) open(file, warnings);
  } catch (...) {
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
    throw;
  }
  for (const auto& file : files_) {
    for (const BagTopic& topic : file->topics()) {
      if (find(topic.name) == nullptr) topics_.push_back(topic);
    }
  }
  std::sort(topics_.begin(), topics_.end(), [](const BagTopic& a, const BagTopic& b) { return a.name < b.name; });
}

Bag::~Bag() {
  files_.clear();
  std::error_code ignored;  // a temporary folder that stays is no reason to fail
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

void Bag::open(const fs::path& file, Warnings& warnings) {
  if (!fs::is_regular_file(file)) throw InputError(located(file, 0, "", "no such file"));
  fs::path plain = file;
  if (is_packed(file)) {
    if (temporary_.empty()) {
      std::string name = (fs::temp_directory_path() / "ear-bag-XXXXXX").string();
      if (mkdtemp(name.data()) == nullptr) throw InputError(located(name, 0, "", "cannot be created"));
      temporary_ = name;
    }
    plain = temporary_ / file.stem();
    decompress_zstd_file(file, plain);
  }
  files_.push_back(plain.extension() == ".db3" ? open_sqlite(plain) : open_mcap(plain, warnings));
}

const BagTopic* Bag::find(const std::string& topic) const {
  const auto found = std::find_if(topics_.begin(), topics_.end(), [&](const BagTopic& t) { return t.name == topic; });
  return found == topics_.end() ? nullptr : &*found;
}

BagPass Bag::pass(const std::vector<std::string>& topics) const {
  BagPass pass(*this);
  for (const std::string& name : topics) {
    const BagTopic* const topic = find(name);
    if (topic == nullptr) continue;
    if (topic->encoding != "cdr") {
      throw InputError(located(path_, 0, name, "messages are '" + topic->encoding + "', not cdr"));
    }
    BagPass::Stream stream;
    stream.topic = topic;
    pass.streams_.push_back(std::move(stream));
  }
  return pass;
}

OwnedMessage Bag::message(const BagTopic& topic, BagMessage from) const {
  OwnedMessage message;
  message.topic = topic.name;
  message.type = topic.type;
  message.received_ns = from.received_ns;
  message.bytes = from.bytes;
  message.memory = std::move(from.memory);
  if (!messages_are_packed_) return message;
  try {
    auto plain = std::make_shared<const std::vector<std::uint8_t>>(decompressed(from.bytes, "zstd", kLargestPiece));
    message.bytes = {plain->data(), plain->size()};
    message.memory = std::move(plain);
  } catch (const InputError& error) {
    throw InputError(located(path_, 0, topic.name, error.what()));
  }
  return message;
}

std::optional<OwnedMessage> Bag::last(const std::string& topic) const {
  const BagTopic* const found = find(topic);
  if (found == nullptr) return std::nullopt;
  for (auto file = files_.rbegin(); file != files_.rend(); ++file) {
    if (auto last = (*file)->last(topic)) return message(*found, std::move(*last));
  }
  return std::nullopt;
}

std::map<std::string, std::string> Bag::attachments() const {
  std::map<std::string, std::string> all;
  for (const auto& file : files_) all.merge(file->attachments());
  return all;
}

void BagPass::refill(Stream& stream, Warnings& warnings) {
  while (!stream.ahead && !stream.ended) {
    if (stream.cursor) {
      if (auto message = stream.cursor->next(warnings)) {
        stream.ahead = bag_->message(*stream.topic, std::move(*message));
        return;
      }
    }
    stream.ended = stream.file == bag_->files_.size();
    if (!stream.ended) stream.cursor = bag_->files_[stream.file++]->open(stream.topic->name);
  }
}

std::optional<OwnedMessage> BagPass::next(Warnings& warnings) {
  Stream* first = nullptr;
  for (Stream& stream : streams_) {
    refill(stream, warnings);
    if (!stream.ahead) continue;
    if (first == nullptr || stream.ahead->received_ns < first->ahead->received_ns) first = &stream;
  }
  if (first == nullptr) return std::nullopt;
  return std::exchange(first->ahead, std::nullopt);
}

}  // namespace ear::rosbag2
