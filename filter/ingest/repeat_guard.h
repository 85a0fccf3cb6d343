// Inertial samples that repeat. Noise makes each one another: a driver that gives the last one again has no new one.
// Sensors that read in coarse steps, and drivers that are asked too fast, repeat as well; how often they do shows it.
// docs/ingest.md, "Samples that repeat".
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/types.h"

namespace ear {

class RepeatGuard {
 public:
  /// Samples in time order. Is this one the last one again, so often in a row that it is no chance?
  [[nodiscard]] bool repeats(const ImuSample& sample);

 private:
  using Values = Eigen::Matrix<double, 6, 1>;  ///< gyroscope, accelerometer

  void learn(const Values& step);
  [[nodiscard]] bool noisy() const;

  std::optional<Values> last_;
  Values step_ = Values::Zero();  ///< to it from the one before
  int run_ = 0;                   ///< repeats in a row
  // Means over the last samples, but for the run.
  double share_ = 1.0;  ///< of samples that repeat the one before
  double count_ = 1.0;
  Values rough_ = Values::Zero();  ///< share of the steps, per axis, that are unlike the one before
};

}  // namespace ear
