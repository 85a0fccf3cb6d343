// One record per sensor: what it measured last against what was expected, and how often it fitted.
#pragma once

#include <array>

#include "ear/health.h"

namespace ear {

class SourceLog {
 public:
  /// A new frame: counts start from zero; what was measured last stays.
  void start_frame();

  /// A measurement of one number. `gate`: the threshold of its squared Mahalanobis distance.
  void add(Source source, double innovation, double variance, double gate, TimeNs t_ns);

  /// Features of one camera: how many fitted, how many did not. `rms` [px] of all observations tested, `variance`
  /// expected; `gate`: of the squared distance of one observation.
  struct Features {
    int used = 0;
    int rejected = 0;
    double rms_px = 0.0;
    double variance_px2 = 0.0;
  };
  void add(Source source, const Features& features, double gate, TimeNs t_ns);

  /// Something that has no expected value did fit, or did not.
  void count(Source source, bool fits, TimeNs t_ns);

  [[nodiscard]] const std::array<SourceRecord, kSourceCount>& records() const { return records_; }

 private:
  std::array<SourceRecord, kSourceCount> records_{};
};

}  // namespace ear
