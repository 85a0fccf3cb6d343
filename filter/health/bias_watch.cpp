#include "filter/health/bias_watch.h"

#include <cmath>

namespace ear {
namespace {

constexpr double kMemory = 0.5;                // [s]
constexpr double kSigmas = 6.0;                // of the sum of the corrections: these do not happen by chance,
constexpr double kSigmasOfImages = 5.0;        // nor these, with images alone;
constexpr double kSigmasWithoutImages = 12.0;  // measured on wheels of real robots, docs/filter.md

}  // namespace

ImuFault BiasWatch::judge(const BiasChanges& changes, TimeNs t_ns, bool image) {
  if (changes.restarted) all_ = by_images_ = BiasChange{};
  all_.add(changes.all.correction, changes.all.variance_lowered);
  by_images_.add(changes.by_images.correction, changes.by_images.variance_lowered);
  ImuFault jumped;
  const auto judge_by = [&jumped](const BiasChange& sum, double sigmas) {
    const BiasChange::Vector6 ratio = sum.correction.cwiseAbs2().cwiseQuotient(sum.variance_lowered.cwiseMax(1e-30));
    jumped.gyro = jumped.gyro || ratio.head<3>().maxCoeff() > sigmas * sigmas;
    jumped.accel = jumped.accel || ratio.tail<3>().maxCoeff() > sigmas * sigmas;
  };
  judge_by(all_, image ? kSigmas : kSigmasWithoutImages);
  judge_by(by_images_, kSigmasOfImages);
  const double kept = std::exp(-seconds_between(judged_ns_, t_ns) / kMemory);
  judged_ns_ = t_ns;
  for (BiasChange* const sum : {&all_, &by_images_}) {
    sum->correction *= kept;
    sum->variance_lowered *= kept * kept;
    const auto forget = [sum](int first) {
      sum->correction.segment<3>(first).setZero();
      sum->variance_lowered.segment<3>(first).setZero();
    };
    if (jumped.gyro) forget(0);
    if (jumped.accel) forget(3);
  }
  return jumped;
}

}  // namespace ear
