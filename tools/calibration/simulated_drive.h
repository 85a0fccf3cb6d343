// A calibration of a simulated vehicle on its feature tracks, beside the truth: for tests and tables.
#pragma once

#include <vector>

#include "calibration/calibrate.h"
#include "tools/simulator/simulation.h"

namespace ear::calibration {

/// How wrong the simulator's drawn calibrations are, times `factor`.
[[nodiscard]] Priors drawn_priors(double factor);

struct SimulatedCalibration {
  Result result;
  std::vector<double> errors;  ///< true less calibrated, of each finding in its unit
};

/// True less calibrated, of each finding in its unit. `given` and `priors`: what `result` was found from.
[[nodiscard]] std::vector<double> errors_left(const Result& result, const Calibration& given, const Calibration& truth,
                                              const Priors& priors);

/// The simulation's samples and tracks.
[[nodiscard]] Drive recorded_drive(const simulator::Simulation& simulation);

/// With the priors that the calibration was drawn from; Options::calibration_error must be stated.
[[nodiscard]] SimulatedCalibration calibrate_simulated(const simulator::Simulation& simulation,
                                                       const Settings& settings);

}  // namespace ear::calibration
