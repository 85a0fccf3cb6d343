// What came in and what went out, to an MCAP file, on a thread of its own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "src/live/live_estimator.h"
#include "src/recording/recording.h"

namespace ear::rosbag2 {
class RecordingWriter;
}

namespace ear::live {

/// Sensors' threads hand in samples and do not wait for the disk: what it does not take in time is left out, and
/// counted. Samples become messages as `ear export --format mcap` writes them, so that `ear run` reads the file.
class Recorder {
 public:
  /// The file must not be there yet. `calibration_folder` has the <sensor>/sensor.yaml that `calibration` was read
  /// from; they go into the file. Throws InputError.
  Recorder(const std::filesystem::path& file, const Calibration& calibration,
           const std::filesystem::path& calibration_folder);
  ~Recorder();  ///< as close()
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  Recorder(Recorder&&) = delete;
  Recorder& operator=(Recorder&&) = delete;

  /// Any thread. Images are copied.
  void add(const ImuSample& sample) { push({sample, sizeof(sample)}); }
  void add(const EncoderSample& sample) { push({sample, sizeof(sample)}); }
  void add(const QueuedOdometry::Ranges& ranges);
  void add(const StereoFrame& frame);
  /// A message that went out.
  void add(const std::string& topic, const std::string& type, TimeNs t_ns, std::vector<std::uint8_t> cdr);

  /// Writes what waits, and completes the file.
  void close();

  /// Messages that the disk was too slow for, or that came after it failed.
  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }
  /// By one thread: words about a disk that is too slow or takes no more, each once.
  [[nodiscard]] std::vector<std::string> look();

 private:
  struct Message {
    std::string topic;
    std::string type;
    TimeNs t_ns = 0;
    std::vector<std::uint8_t> cdr;
  };
  struct Item {
    std::variant<ImuSample, EncoderSample, LaserSample, RecordedFrame, Message> what;
    std::size_t bytes = 0;
  };

  void push(Item item);
  void run();

  std::unique_ptr<rosbag2::RecordingWriter> writer_;  ///< the thread's
  std::size_t beams_ = 0;                             ///< of the calibration
  bool said_failure_ = false, said_left_out_ = false;
  std::mutex mutex_;  ///< of what follows, up to the counter
  std::condition_variable changed_;
  std::deque<Item> items_;
  std::size_t bytes_ = 0;  ///< of these
  bool end_ = false;
  std::string failure_;
  std::atomic<std::uint64_t> left_out_{0};
  std::thread thread_;  ///< last: it uses all else
};

}  // namespace ear::live
