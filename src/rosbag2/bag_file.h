// One file of a bag, whatever its format: topics, and each topic's messages in the order of the file.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ear/types.h"
#include "src/recording/warnings.h"
#include "src/ros2/cdr.h"

namespace ear::rosbag2 {

using ros2::Bytes;

/// No message, and no chunk of messages once it is unpacked, is larger: what a false length may cost.
inline constexpr std::size_t kLargestPiece = std::size_t{256} << 20U;

struct BagTopic {
  std::string name;
  std::string type;      ///< "sensor_msgs/msg/Imu"
  std::string encoding;  ///< "cdr"
  std::map<std::string, std::string> metadata;
};

struct BagMessage {
  TimeNs received_ns = 0;
  Bytes bytes;
  std::shared_ptr<const void> memory;  ///< keeps them
};

/// One pass over one topic, for one thread.
class TopicCursor {
 public:
  virtual ~TopicCursor() = default;
  /// Nothing at the end. What a damaged file does not give is counted. Throws InputError.
  [[nodiscard]] virtual std::optional<BagMessage> next(Warnings& warnings) = 0;
};

/// Any number of cursors may be used at a time, each by a thread of its own. They may not outlive the file.
class BagFile {
 public:
  virtual ~BagFile() = default;
  [[nodiscard]] virtual const std::vector<BagTopic>& topics() const = 0;
  [[nodiscard]] virtual std::unique_ptr<TopicCursor> open(const std::string& topic) const = 0;
  /// A topic's last message; nothing if it has none.
  [[nodiscard]] virtual std::optional<BagMessage> last(const std::string& topic) const = 0;
  /// Files that it holds beside messages, by name.
  [[nodiscard]] virtual std::map<std::string, std::string> attachments() const { return {}; }
};

}  // namespace ear::rosbag2
