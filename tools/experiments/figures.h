// One run of the filter on one simulation, and its figures.
#pragma once

#include <functional>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/health.h"
#include "src/odometry_factory.h"
#include "tools/evaluation/evaluate.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {

/// What a run came to. A figure is missing where the run does not have it: no estimate, no travel, no known slope.
/// Definitions: docs/evaluation.md.
struct Figures {
  std::optional<double> length;               ///< travelled while there was an estimate [m]
  std::optional<double> ate_rmse;             ///< [m]
  std::optional<double> ate_percent;          ///< of the length
  std::optional<double> z_rmse;               ///< [m]
  std::optional<double> z_rmse_ground;        ///< of the poses on the ground [m]
  std::optional<double> rotation_rmse;        ///< [deg]
  std::optional<double> start_to_end;         ///< [m]
  std::optional<double> nees_position;        ///< mean over the second half; 3 is consistent
  std::optional<double> nees_orientation;     ///< the same
  std::optional<double> sigma_position;       ///< at the end, root of the covariance's trace [m]
  std::optional<double> sigma_orientation;    ///< the same [deg]
  std::optional<double> slope_along_rmse;     ///< [deg]
  std::optional<double> slope_across_rmse;    ///< [deg]
  std::optional<double> slope_along_inside;   ///< share within three standard deviations [%]
  std::optional<double> slope_across_inside;  ///< the same
  std::optional<double> mode_agreement;       ///< share of the poses that agree with the truth on ground or air [%]
  std::optional<double> coverage;             ///< frames with an estimate [%]
  std::optional<double> false_tracking;       ///< time far off while the health says "tracking" [%]
  std::optional<double> features_rejected;    ///< share of the features tried [%]
  std::optional<double> wheel_rows_rejected;  ///< share of the odometer's rows [%]
  std::optional<double> beams_rejected;       ///< share of the laser ranges [%]
  std::optional<double> frame_time;           ///< of the processor per estimate, all samples between included [ms]
};

/// The time is when the sample arrived.
using OnHealth = std::function<void(TimeNs arrival_ns, const Health& health)>;

/// Which estimator is run.
struct EstimatorChoice {
  MakeEstimator make = {};  ///< none: the filter
  bool timed = false;       ///< with Figures::frame_time, which is never the same twice
};

/// Runs a new filter that is given `calibration`, its lenses too; without cameras in it, without images. A run whose
/// estimate stops being finite keeps only its coverage. `on_health`, if given, is told what the health is after every
/// sample and frame.
[[nodiscard]] Figures measure(const simulator::Simulation& simulation, const Calibration& calibration,
                              const FilterConfig& config, evaluation::AlignmentKind alignment,
                              const OnHealth& on_health = {}, const EstimatorChoice& choice = {});

}  // namespace ear::experiments
