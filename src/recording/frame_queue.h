// Decodes images ahead of their use, on one background thread, into a queue of fixed size.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "ear/types.h"
#include "src/recording/warnings.h"

namespace ear {

/// The images of one instant, with their memory. Copies share it.
struct RecordedFrame : StereoFrame {
  TimeNs arrival_ns = 0;               ///< the stamp, unless the recording states that the frame came later
  std::shared_ptr<const void> pixels;  ///< keeps what `left` and `right` point at
};

/// A frame, and the problems met on the way to it. Problems travel with the frame, so that their order does not depend
/// on how far ahead the thread is.
struct DecodedFrame {
  std::optional<RecordedFrame> frame;  ///< nothing: the end of the recording
  Warnings warnings;
};

/// Runs a producer of frames on its own thread, at most `kCapacity` frames ahead.
class FrameQueue {
 public:
  static constexpr std::size_t kCapacity = 4;

  /// Makes the next frame; called on the background thread only. After a frame of nothing it is not called again.
  using Produce = std::function<DecodedFrame()>;

  explicit FrameQueue(Produce produce);
  ~FrameQueue();
  FrameQueue(const FrameQueue&) = delete;
  FrameQueue& operator=(const FrameQueue&) = delete;
  FrameQueue(FrameQueue&&) = delete;
  FrameQueue& operator=(FrameQueue&&) = delete;

  /// Waits for the next frame. Rethrows what the producer threw. Not to be called after the end.
  [[nodiscard]] DecodedFrame pop();

 private:
  void run();
  [[nodiscard]] bool push(DecodedFrame frame);

  Produce produce_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<DecodedFrame> frames_;
  std::exception_ptr failure_;
  bool stopping_ = false;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace ear
