#include "filter/ingest/repeat_guard.h"

#include <algorithm>

#include "filter/ingest/limits.h"

namespace ear {

void RepeatGuard::learn(const Values& step) {
  count_ = std::min<double>(count_ + 1.0, kCapacity);
  share_ += ((step.isZero(0.0) ? 1.0 : 0.0) - share_) / count_;
  const Values unlike =
      ((step - step_).array().abs() > kAlike * (step.array().abs() + step_.array().abs())).cast<double>();
  rough_ += (unlike - rough_) / count_;
  step_ = step;
}

/// Is there noise in any axis? Where there is none, as in a simulation, samples repeat at rest.
bool RepeatGuard::noisy() const { return rough_.maxCoeff() > kAlike; }

/// What a run says of all this counts after it.
bool RepeatGuard::repeats(const ImuSample& sample) {
  Values values;
  values << sample.gyro_B, sample.accel_B;
  if (!last_) {
    last_ = values;
    return false;
  }
  if (values == *last_) {
    run_ = std::min(run_ + 1, static_cast<int>(kCapacity));
    return noisy() && is_no_chance(share_, run_);
  }
  for (; run_ > 0; --run_) learn(Values::Zero());
  learn(values - *last_);
  last_ = values;
  return false;
}

}  // namespace ear
