// The state at the rate of the inertial samples, for their thread, whatever keeps the estimator's thread.
#pragma once

#include <cstddef>
#include <optional>

#include "ear/estimate.h"
#include "filter/ring.h"
#include "filter/state.h"
#include "src/latest_value.h"

namespace ear {

/// One thread, the estimator's, tells a state now and then; another, the inertial sensor's, carries it on with every
/// sample. Neither waits for the other.
class LiveState {
 public:
  /// Remembers so many samples: states told may be as much older than the newest one.
  explicit LiveState(std::size_t samples) : samples_(samples) {}

  /// By the estimator's thread: the state at the sample with this stamp, or nothing where there is none.
  void tell(const std::optional<NavState>& state, TimeNs sample_ns);

  /// By the inertial sensor's thread, for each sample.
  void add(const ImuSample& sample);
  /// By the same: the state at the newest sample. Nothing before the first that was told, after nothing was told, and
  /// once the newest that was told is kLongest old: no estimate is that rests on inertia alone for so long.
  [[nodiscard]] std::optional<NavState> state() const;

  static constexpr double kLongest = 2.0;  ///< [s] as in docs/health.md

 private:
  struct Told {
    std::optional<NavState> state;
    TimeNs sample_ns = 0;
  };

  void take(const ImuSample& sample);
  void begin(const Told& told);
  void carry_on(const ImuSample& from, const ImuSample& to);

  LatestValue<Told> told_;
  Ring<ImuSample> samples_;
  std::optional<ImuState> state_;
  double age_ = 0.0;  ///< [s] since the state that was told
};

}  // namespace ear
