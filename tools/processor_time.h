// Processor time: what other programs do meanwhile does not count.
#pragma once

#include <ctime>

namespace ear::tools {

/// [s] since some moment, of one of the clocks that follow.
inline double processor_time(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Of the calling thread [s].
inline double thread_time() { return processor_time(CLOCK_THREAD_CPUTIME_ID); }

/// Of all threads of this program [s].
inline double process_time() { return processor_time(CLOCK_PROCESS_CPUTIME_ID); }

}  // namespace ear::tools
