// The same work many times, on several threads.
#pragma once

#include <cstddef>
#include <functional>

namespace ear::experiments {

/// Runs work(0) .. work(count - 1), each once, in no order, and waits. The first exception ends it and is thrown.
void in_parallel(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

}  // namespace ear::experiments
