// A queue of fixed capacity: all memory is taken at construction.
#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

namespace ear {

template <typename T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : items_(capacity) {}

  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == items_.size(); }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const T& front() const { return items_[first_]; }
  [[nodiscard]] const T& back() const { return (*this)[size_ - 1]; }
  /// Oldest first.
  [[nodiscard]] const T& operator[](std::size_t i) const { return items_[(first_ + i) % items_.size()]; }
  [[nodiscard]] T& operator[](std::size_t i) { return items_[(first_ + i) % items_.size()]; }

  /// Appends; it must not be full.
  void push(const T& item) {
    assert(!full());
    items_[(first_ + size_++) % items_.size()] = item;
  }

  /// Keeps the oldest, and every other one after that.
  void keep_every_other() {
    const std::size_t kept = (size_ + 1) / 2;
    for (std::size_t i = 1; i < kept; ++i) (*this)[i] = (*this)[2 * i];
    size_ = kept;
  }

  void clear() { size_ = 0; }

  void pop() {
    assert(!empty());
    first_ = (first_ + 1) % items_.size();
    --size_;
  }

 private:
  std::vector<T> items_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace ear
