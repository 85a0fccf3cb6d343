// When the samples of one stream came: rate, gaps and jitter.
#pragma once

#include <cstddef>
#include <vector>

#include "ear/types.h"

namespace ear {

/// What the stamps of a stream show.
struct TimingReport {
  std::size_t count = 0;
  TimeNs first_ns = 0;
  TimeNs last_ns = 0;
  double rate_hz = 0.0;      ///< of the median interval: gaps do not lower it
  double jitter_s = 0.0;     ///< standard deviation of the intervals that are not gaps [s]
  std::size_t gaps = 0;      ///< intervals longer than three median ones
  double longest_gap = 0.0;  ///< the longest interval [s]
};

/// Collects the stamps of one stream: four bytes per sample.
class StreamTiming {
 public:
  /// Stamps must grow.
  void add(TimeNs t_ns);

  [[nodiscard]] TimingReport report() const;

 private:
  std::size_t count_ = 0;
  TimeNs first_ns_ = 0;
  TimeNs last_ns_ = 0;
  std::vector<float> intervals_;  // [s]
};

}  // namespace ear
