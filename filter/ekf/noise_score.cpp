#include "filter/ekf/noise_score.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kPrior = 4.0;  // innovations that the usual noise counts for; measured: 4 to 16 differ little
constexpr int kIterations = 3;  // chosen: of the two equations of the belief; more change nothing that matters

}  // namespace

double NoiseScore::factor(double square, double count) const {
  return std::max(1.0, (kPrior + squares_ + square) / (kPrior + count_ + count));
}

/// The mean-field equations: given the factor, the update leaves `share` of the residual, and of the state's variance,
/// to the noise; the factor is the mean of the noises' squares.
double NoiseScore::add(double residual, const Expected& expected, TimeNs t_ns) {
  const double dt = last_ns_ ? std::max(0.0, seconds_between(*last_ns_, t_ns)) : 0.0;
  last_ns_ = t_ns;
  const double kept = std::exp(-dt / memory_);
  squares_ *= kept;
  count_ *= kept;
  double believed = factor(0.0, 0.0);
  double square = 0.0;
  for (int i = 0; i < kIterations; ++i) {
    const double share = believed * expected.noise / (expected.state + believed * expected.noise);
    square = (residual * residual * share + expected.state) * share / expected.noise;
    square = std::min(farthest_, square);  // of what is no number too
    believed = factor(square, 1.0);
  }
  squares_ += square;
  count_ += 1.0;
  return expected.adapts ? believed : 1.0;
}

double NoiseScore::weight() const { return 1.0 / std::sqrt(factor(0.0, 0.0)); }

/// Noise of kClear times the usual is not chance.
bool NoiseScore::fits() const { return weight() > 1.0 / kClear; }

}  // namespace ear
