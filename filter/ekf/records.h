// What came of the measurements of one frame: the innovation record of every sensor, and counts.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "ear/estimate.h"
#include "ear/health.h"

namespace ear {

/// An innovation against what was expected of it.
struct Innovation {
  double value = 0.0;     ///< measured - predicted
  double variance = 0.0;  ///< as expected, the state's share included
  double gate = 0.0;      ///< quantile of value^2 / variance
  bool fits = false;      ///< it passed the gate
  double score = 1.0;     ///< SourceRecord::score

  [[nodiscard]] static Innovation of(double value, double variance, double gate) {
    return {value, variance, gate, value * value <= gate * variance};
  }
};

/// One record a sensor: its last innovation, and how many fitted.
class InnovationLog {
 public:
  /// A new frame: counts start from zero; what was measured last stays.
  void start_frame() {
    for (SourceRecord& record : records_) record.used = record.rejected = 0;
  }

  void add(Source source, const Innovation& innovation, TimeNs t_ns) {
    add(source, innovation, innovation.fits ? 1 : 0, innovation.fits ? 0 : 1, t_ns);
  }
  /// Many at once, of which so many fitted: the features of one camera. `typical`: the root of their mean square.
  void add(Source source, const Innovation& typical, int used, int rejected, TimeNs t_ns) {
    SourceRecord& record = records_[index_of(source)];
    record.innovation = typical.value;
    record.variance = typical.variance;
    record.gate_ratio = typical.value * typical.value / (typical.gate * typical.variance);
    record.score = typical.score;
    record.used += used;
    record.rejected += rejected;
    if (used > 0) record.last_used_ns = t_ns;
  }

  /// SourceRecord::score of a sensor that is no innovation's.
  void set_score(Source source, double score) { records_[index_of(source)].score = score; }

  [[nodiscard]] const std::array<SourceRecord, kSourceCount>& records() const { return records_; }

 private:
  std::array<SourceRecord, kSourceCount> records_{};
};

/// What updates did to the biases: the corrections, and by how much they lowered the variances. Gyroscope [rad/s], then
/// accelerometer [m/s^2].
struct BiasChanges {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Vector6 correction = Vector6::Zero();
  Vector6 variance_lowered = Vector6::Zero();
  bool restarted = false;  ///< what came before does not count

  /// Of updates that were misled by another source.
  [[nodiscard]] static BiasChanges discarded() {
    BiasChanges changes;
    changes.restarted = true;
    return changes;
  }
  void add(const Vector6& more_correction, const Vector6& more_lowered) {
    correction += more_correction;
    variance_lowered += more_lowered.cwiseMax(0.0);
  }
};

/// What became of a track that was tested: did it update the filter?
struct TrackOutcome {
  std::uint64_t id = 0;
  bool used = false;
};

/// What the sources write while a frame is processed.
struct Records {
  FrameStatistics statistics;
  InnovationLog log;
  std::vector<TrackOutcome>* outcomes = nullptr;  ///< of this frame, for who asked: Estimator::report_tracks()
};

}  // namespace ear
