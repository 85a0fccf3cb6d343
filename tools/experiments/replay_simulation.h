// An estimator on a simulation's samples and feature tracks: how every experiment and every test runs one.
#pragma once

#include <functional>

#include "filter/estimator.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {

/// May alter a frame's features before the estimator gets them.
using ChangeFrame = std::function<void(FeatureFrame&)>;

/// Gives the sample that the filter gets in the place of a simulated one.
using ChangeEncoder = std::function<EncoderSample(const EncoderSample&)>;
using ChangeLaser = std::function<LaserSample(const LaserSample&)>;

/// Is given every estimate, and the time that it was asked for: a frame's stamp, or the stamp that a frame would have.
using OnEstimate = std::function<void(TimeNs stamp_ns, const Estimate& estimate)>;

/// Is called after each sample or frame was handed over.
using OnDelivery = std::function<void(const simulator::Delivery& delivery)>;

struct ReplayOptions {
  ChangeFrame change = {};
  ChangeEncoder change_encoder = {};
  ChangeLaser change_laser = {};
  OnDelivery after = {};
  bool camera = true;                ///< false: no frame is handed over
  double* processor_time = nullptr;  ///< if given, the estimator's [s] is added to it
  bool wheels = true;                ///< false: no steps while frames are missing (src/blind_steps.h)
};

/// Feeds all samples and frames in the order of their arrival, as `ear run` does.
void replay(const simulator::Simulation& simulation, Estimator& estimator, const OnEstimate& on_estimate,
            const ReplayOptions& options = {});

}  // namespace ear::experiments
