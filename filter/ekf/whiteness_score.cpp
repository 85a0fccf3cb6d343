#include "filter/ekf/whiteness_score.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kMemory = 10.0;  // [s] measured: 3 s wavers, docs/decisions/0048

}  // namespace

/// The sum of n white ones has the variance n. What it has beyond that raises the factor until they are white.
void WhitenessScore::add(double innovation, double variance, TimeNs t_ns) {
  if (!from_ns_ || seconds_between(*from_ns_, t_ns) > 2.0 * kLasting) {
    from_ns_ = t_ns;
    sum_ = 0.0;
    count_ = 0;
  }
  sum_ += innovation / std::sqrt(variance);
  ++count_;
  const double duration = seconds_between(*from_ns_, t_ns);
  if (duration < kLasting) return;
  if (count_ >= kConfirmed) {
    const double square = std::min(kClear * kClear, sum_ * sum_ / count_);  // of what is no number too
    log_factor_ = std::clamp(log_factor_ + duration / kMemory * (square - 1.0), 0.0, std::log(kFarthest));
  }
  from_ns_.reset();
}

double WhitenessScore::factor() const { return std::exp(0.5 * log_factor_); }

}  // namespace ear
