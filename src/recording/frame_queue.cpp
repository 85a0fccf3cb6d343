#include "src/recording/frame_queue.h"

#include <utility>

namespace ear {

FrameQueue::FrameQueue(Produce produce) : produce_(std::move(produce)), thread_([this] { run(); }) {}

FrameQueue::~FrameQueue() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

DecodedFrame FrameQueue::pop() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !frames_.empty() || failure_; });
  if (frames_.empty()) std::rethrow_exception(failure_);
  DecodedFrame frame = std::move(frames_.front());
  frames_.pop_front();
  lock.unlock();
  changed_.notify_all();
  return frame;
}

void FrameQueue::run() {
  try {
    bool more = true;
    while (more) {
      DecodedFrame frame = produce_();
      more = frame.frame.has_value();
      if (!push(std::move(frame))) return;
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    changed_.notify_all();
  }
}

bool FrameQueue::push(DecodedFrame frame) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stopping_ || frames_.size() < kCapacity; });
  if (stopping_) return false;
  frames_.push_back(std::move(frame));
  lock.unlock();
  changed_.notify_all();
  return true;
}

}  // namespace ear
