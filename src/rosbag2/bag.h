// A bag of ROS 2, whatever its storage: one file, or a folder with metadata.yaml and one or more.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/ros2/raw_message.h"
#include "src/ros2/topics.h"
#include "src/rosbag2/bag_file.h"

namespace ear::rosbag2 {

/// A message, with its memory.
struct OwnedMessage : ros2::RawMessage {
  std::shared_ptr<const void> memory;
};

class Bag;

/// One pass over some topics of a bag, in the order in which they were recorded. For one thread.
class BagPass {
 public:
  /// Nothing at the end. Throws InputError.
  [[nodiscard]] std::optional<OwnedMessage> next(Warnings& warnings);

 private:
  friend class Bag;
  struct Stream {
    const BagTopic* topic = nullptr;
    std::size_t file = 0;                 // the next one
    std::unique_ptr<TopicCursor> cursor;  // of the one before
    std::optional<OwnedMessage> ahead;
    bool ended = false;
  };
  explicit BagPass(const Bag& bag) : bag_(&bag) {}
  void refill(Stream& stream, Warnings& warnings);

  const Bag* bag_;
  std::vector<Stream> streams_;
};

class Bag {
 public:
  /// `path`: FILE.mcap, FILE.db3, either with .zstd behind it, or a folder of rosbag2. Files that are compressed as a
  /// whole are unpacked to a temporary folder, which the end of this object deletes. Throws InputError.
  Bag(std::filesystem::path path, Warnings& warnings);
  ~Bag();
  Bag(const Bag&) = delete;
  Bag& operator=(const Bag&) = delete;
  Bag(Bag&&) = delete;
  Bag& operator=(Bag&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// All topics, by name.
  [[nodiscard]] const std::vector<BagTopic>& topics() const { return topics_; }
  [[nodiscard]] const BagTopic* find(const std::string& topic) const;
  /// Of those topics that are there; empty names are passed over. Throws InputError for a topic whose messages are not
  /// CDR. The pass may not outlive the bag.
  [[nodiscard]] BagPass pass(const std::vector<std::string>& topics) const;
  [[nodiscard]] std::optional<OwnedMessage> last(const std::string& topic) const;
  [[nodiscard]] std::map<std::string, std::string> attachments() const;

 private:
  friend class BagPass;
  void open(const std::filesystem::path& file, Warnings& warnings);
  [[nodiscard]] OwnedMessage message(const BagTopic& topic, BagMessage from) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  bool messages_are_packed_ = false;
  std::vector<std::unique_ptr<BagFile>> files_;
  std::vector<BagTopic> topics_;
};

/// Is this path one that Bag takes?
[[nodiscard]] bool is_bag(const std::filesystem::path& path);

}  // namespace ear::rosbag2
