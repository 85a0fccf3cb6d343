// The state at the rate of the inertial samples, for their thread, whatever keeps the estimator's thread.
#pragma once

#include <cstddef>
#include <optional>

#include "ear/estimate.h"
#include "filter/ekf/state.h"
#include "filter/ingest/ring.h"
#include "src/latest_value.h"

namespace ear {

/// One thread, the estimator's, sets a state now and then; another, the inertial sensor's, carries it on with every
/// sample. Neither waits for the other. States are as in Odometry::predict().
class LiveState {
 public:
  /// Keeps so many samples: a state may be older than the newest one by as many.
  explicit LiveState(std::size_t samples) : samples_(samples) {}

  /// By the estimator's thread: the state at the sample with this stamp [ns], or nothing where there is none.
  void set(const std::optional<NavState>& state, TimeNs sample_ns);

  /// By the inertial sensor's thread, for each sample.
  void add(const ImuSample& sample);
  /// By the same: the state at the newest sample. Nothing before the first one was set, after nothing was set, and once
  /// the newest one that was set is kLongest old: none is given that rests on inertia alone for so long.
  [[nodiscard]] std::optional<NavState> state() const;

  static constexpr double kLongest = 2.0;  ///< [s] as in docs/health.md

 private:
  struct Given {
    std::optional<NavState> state;
    TimeNs sample_ns = 0;
  };

  void take(const ImuSample& sample);
  void begin(const Given& given);
  void carry_on(const ImuSample& from, const ImuSample& to);

  LatestValue<Given> latest_;
  Ring<ImuSample> samples_;
  std::optional<ImuState> state_;
  double age_ = 0.0;  ///< [s] since the state that was set
};

}  // namespace ear
