#include "filter/bias_watch.h"

#include <cmath>

namespace ear {
namespace {

constexpr double kMemory = 0.5;          // [s]
constexpr double kSigmas = 6.0;          // of the sum of the corrections: these do not happen by chance,
constexpr double kSigmasOfImages = 5.0;  // nor these, with images alone

}  // namespace

void BiasWatch::add(const Vector6& correction, const Vector6& variance_lowered, bool by_image) {
  const auto add_to = [&](Sum& sum) {
    sum.correction += correction;
    sum.variance += variance_lowered.cwiseMax(0.0);
  };
  add_to(all_);
  if (by_image) add_to(images_);
}

BiasWatch::Verdict BiasWatch::judge(double dt) {
  Verdict verdict;
  const auto judge_by = [&verdict](const Sum& sum, double sigmas) {
    const Vector6 ratio = sum.correction.cwiseAbs2().cwiseQuotient(sum.variance.cwiseMax(1e-30));
    verdict.gyro = verdict.gyro || ratio.head<3>().maxCoeff() > sigmas * sigmas;
    verdict.accel = verdict.accel || ratio.tail<3>().maxCoeff() > sigmas * sigmas;
  };
  judge_by(all_, kSigmas);
  judge_by(images_, kSigmasOfImages);
  const double kept = std::exp(-dt / kMemory);
  for (Sum* const sum : {&all_, &images_}) {
    sum->correction *= kept;
    sum->variance *= kept * kept;
    const auto forget = [sum](int first) {
      sum->correction.segment<3>(first).setZero();
      sum->variance.segment<3>(first).setZero();
    };
    if (verdict.gyro) forget(0);
    if (verdict.accel) forget(3);
  }
  return verdict;
}

void BiasWatch::clear() { *this = BiasWatch{}; }

}  // namespace ear
