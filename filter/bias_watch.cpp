#include "filter/bias_watch.h"

#include <cmath>

namespace ear {
namespace {

constexpr double kMemory = 0.5;  // [s]
constexpr double kSigmas = 5.0;  // of the sum of the corrections: these do not happen by chance

}  // namespace

void BiasWatch::add(const Vector6& correction, const Vector6& variance_lowered) {
  sum_ += correction;
  variance_ += variance_lowered.cwiseMax(0.0);
}

BiasWatch::Verdict BiasWatch::judge(double dt) {
  const Vector6 ratio = sum_.cwiseAbs2().cwiseQuotient(variance_.cwiseMax(1e-30));
  const Verdict verdict{ratio.head<3>().maxCoeff() > kSigmas * kSigmas, ratio.tail<3>().maxCoeff() > kSigmas * kSigmas};
  const double kept = std::exp(-dt / kMemory);
  sum_ *= kept;
  variance_ *= kept * kept;
  const auto forget = [this](int first) {
    sum_.segment<3>(first).setZero();
    variance_.segment<3>(first).setZero();
  };
  if (verdict.gyro) forget(0);
  if (verdict.accel) forget(3);
  return verdict;
}

void BiasWatch::clear() { *this = BiasWatch{}; }

}  // namespace ear
