// The newest value from one thread to one other: neither side waits, locks or allocates.
#pragma once

#include <array>
#include <atomic>

namespace ear {

/// One thread calls put(), one calls take(). Of three slots each side has one; the third is exchanged.
template <typename T>
class LatestValue {
 public:
  /// What was put before and not taken is gone.
  void put(const T& value) {
    slots_[writing_] = value;
    writing_ = exchanged_.exchange(writing_ | kNew, std::memory_order_acq_rel) & ~kNew;
  }

  /// The newest value, if it was not taken yet, else null. It stays until the next call.
  [[nodiscard]] const T* take() {
    if ((exchanged_.load(std::memory_order_relaxed) & kNew) == 0) return nullptr;
    reading_ = exchanged_.exchange(reading_, std::memory_order_acq_rel) & ~kNew;
    return &slots_[reading_];
  }

 private:
  static constexpr unsigned kNew = 4;  // added to a slot's index: put, and not taken

  std::array<T, 3> slots_{};
  unsigned writing_ = 0;
  unsigned reading_ = 1;
  std::atomic<unsigned> exchanged_{2};
};

}  // namespace ear
