// An object that one thread uses at a time, while Python's other threads go on.
#pragma once

#include <mutex>
#include <utility>

#include "python/binding/convert.h"

namespace ear::python {

template <typename T>
class Guarded {
 public:
  template <typename... A>
  explicit Guarded(A&&... given) : value_(std::forward<A>(given)...) {}

  /// Work that takes a while: without Python's lock.
  template <typename Work>
  auto work(const Work& of) {
    const py::gil_scoped_release released;
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    return of(value_);
  }

  /// Work of microseconds: Python's lock is only given up to wait for another thread's work to end.
  template <typename Work>
  auto quick(const Work& of) {
    std::unique_lock<std::recursive_mutex> lock(mutex_, std::try_to_lock);
    if (!lock) {
      const py::gil_scoped_release released;
      lock.lock();
    }
    return of(value_);
  }

 private:
  T value_;
  std::recursive_mutex mutex_;  ///< recursive: a callback may ask the object that called it
};

}  // namespace ear::python
