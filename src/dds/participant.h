// A member of a DDS domain, which reads and writes topics as ROS 2 does; Cyclone DDS behind it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "ear/types.h"
#include "src/dds/raw_type.h"

namespace ear::dds {

/// Somebody else who writes a topic.
struct Publication {
  std::string topic;  ///< as ROS calls it: "/imu"
  std::string type;   ///< "sensor_msgs/msg/Imu"
  bool reliable = false;
  bool transient_local = false;  ///< late readers get what was written before
  std::string user_data;         ///< what the writer says of itself
};

/// The domain that ROS_DOMAIN_ID names, or 0. Throws std::invalid_argument if it is no number from 0 to 232.
[[nodiscard]] int domain_of_environment();

class Participant {
 public:
  /// Throws std::runtime_error, with Cyclone's reason.
  explicit Participant(int domain);
  ~Participant();  ///< after all readers and writers
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  Participant(Participant&&) = delete;
  Participant& operator=(Participant&&) = delete;

  /// All topics of ROS that others write now. Any thread.
  [[nodiscard]] std::vector<Publication> publications() const;

  [[nodiscard]] std::int32_t entity() const { return entity_; }

 private:
  std::int32_t entity_ = 0;
  std::int32_t discovery_ = 0;  ///< reader of what others write
};

/// Writes one topic. Any thread.
class Writer {
 public:
  struct Options {
    bool reliable = true;
    bool transient_local = false;
    int depth = 10;         ///< samples that are kept for readers that are slow
    std::string user_data;  ///< what others are told of the writer
  };
  /// Throws std::runtime_error.
  Writer(const Participant& participant, const std::string& topic, const std::string& type, const Options& options);

  /// False: it could not be taken at once, and is gone.
  bool write(const std::vector<std::uint8_t>& cdr);
  /// Does anybody read it?
  [[nodiscard]] bool is_read() const;

 private:
  std::int32_t entity_ = 0;
  const ddsi_sertype* type_ = nullptr;
};

/// One topic that a subscription reads.
struct Wanted {
  std::string topic;
  std::string type;
  int depth = 10;  ///< samples that wait at most
};

/// One sample that came; the bytes are borrowed.
struct Received {
  const Wanted& what;
  RawBytes cdr;
};

/// Reads topics on a thread of its own. Each reader asks for what its publishers offer, reliable or best-effort, so
/// that either kind is received, also after one was replaced by the other.
class Subscription {
 public:
  Subscription(const Participant& participant, std::vector<Wanted> wanted, std::function<void(const Received&)> take);
  ~Subscription();
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  Subscription(Subscription&&) = delete;
  Subscription& operator=(Subscription&&) = delete;

  /// By one other thread, a few times a second: what changed, in words: a publisher that came or went, one of another
  /// type, one whose quality of service does not fit.
  [[nodiscard]] std::vector<std::string> look();

 private:
  struct Reader;

  void run();
  void adapt();
  bool read(Reader& reader);

  const Participant& participant_;
  std::function<void(const Received&)> take_;
  std::vector<std::unique_ptr<Reader>> readers_;
  std::int32_t waitset_ = 0;
  std::mutex mutex_;  ///< of the words
  std::vector<std::string> words_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;  ///< last: it uses all else
};

}  // namespace ear::dds
