// A bounded queue from one thread to one other: neither side waits, locks or allocates.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace ear {

/// Of fixed capacity. The elements are made once and reused, so that one that owns memory keeps it. One thread calls
/// slot_to_fill() and push(), one calls front() and pop().
template <typename T>
class SampleQueue {
 public:
  SampleQueue(std::size_t capacity, const T& element) : slots_(capacity + 1, element) {}  // one stays free

  /// Where the next element is to be written, or null if the queue is full.
  [[nodiscard]] T* slot_to_fill() {
    const std::size_t end = end_.load(std::memory_order_relaxed);
    return after(end) == begin_.load(std::memory_order_acquire) ? nullptr : &slots_[end];
  }
  /// The slot that was filled belongs to the other thread now.
  void push() { end_.store(after(end_.load(std::memory_order_relaxed)), std::memory_order_release); }

  /// The oldest element, or null.
  [[nodiscard]] const T* front() const {
    const std::size_t begin = begin_.load(std::memory_order_relaxed);
    return begin == end_.load(std::memory_order_acquire) ? nullptr : &slots_[begin];
  }
  /// The same, to take out what it owns; what is left there is used again.
  [[nodiscard]] T* front_to_empty() { return const_cast<T*>(front()); }
  void pop() { begin_.store(after(begin_.load(std::memory_order_relaxed)), std::memory_order_release); }

  /// Seen from the thread that takes out, as is the next.
  [[nodiscard]] std::size_t size() const {
    const std::size_t begin = begin_.load(std::memory_order_relaxed);
    const std::size_t end = end_.load(std::memory_order_acquire);
    return end >= begin ? end - begin : end + slots_.size() - begin;
  }
  [[nodiscard]] std::size_t capacity() const { return slots_.size() - 1; }
  [[nodiscard]] bool full() const {
    return after(end_.load(std::memory_order_acquire)) == begin_.load(std::memory_order_relaxed);
  }

 private:
  [[nodiscard]] std::size_t after(std::size_t i) const { return i + 1 == slots_.size() ? 0 : i + 1; }

  std::vector<T> slots_;
  alignas(64) std::atomic<std::size_t> begin_{0};  // each on a cache line of its own: two threads write them
  alignas(64) std::atomic<std::size_t> end_{0};
};

}  // namespace ear
