// Samples as they would be if an ingredient of the estimator could do nothing with them: for the ablation.
#pragma once

#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "tools/simulator/simulation.h"

namespace ear::paper {

/// Takes from the encoders' angles what the body turned about the axle, by the gyroscope. An estimator that adds it,
/// the paper's (5), then has the speed that one without this correction takes from the encoders as they are.
class WithoutPitch {
 public:
  WithoutPitch(const simulator::Simulation& simulation, const Calibration& calibration);

  [[nodiscard]] EncoderSample operator()(const EncoderSample& sample) const;

 private:
  [[nodiscard]] double pitch(TimeNs t_ns) const;

  EncoderCalibration encoder_;
  std::vector<TimeNs> times_;
  std::vector<double> pitch_;  ///< turned about the axle since the first inertial sample [rad]
};

/// All ranges, or none where one beam has no return.
[[nodiscard]] LaserSample together(const LaserSample& sample);

}  // namespace ear::paper
