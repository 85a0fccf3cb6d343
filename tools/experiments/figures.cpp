#include "tools/experiments/figures.h"

#include <cmath>

#include "filter/filter.h"
#include "tools/experiments/replay_simulation.h"
#include "tools/experiments/simulation_truth.h"
#include "tools/simulator/lens.h"

namespace ear::experiments {
namespace {

constexpr double kDegPerRad = 180.0 / M_PI;

/// How many of something passed the gates.
struct Gated {
  int used = 0;
  int rejected = 0;

  void add(int more_used, int more_rejected) {
    used += more_used;
    rejected += more_rejected;
  }
  [[nodiscard]] std::optional<double> rejected_percent() const {
    if (used + rejected == 0) return std::nullopt;
    return 100.0 * rejected / (used + rejected);
  }
};

/// What is collected while the filter runs.
struct Record {
  evaluation::Estimate estimate;
  Gated features, wheel_rows, beams;
  bool finite = true;

  void add(const Estimate& e) {
    finite = finite && e.state.p_WB.allFinite() && e.state.q_WB.coeffs().allFinite() && e.covariance.allFinite();
    if (!finite) return;
    append(estimate, e);
    features.add(e.frame.features_used, e.frame.features_rejected);
    wheel_rows.add(e.frame.wheel_rows_used, e.frame.wheel_rows_rejected);
    beams.add(e.frame.beams_used, e.frame.beams_rejected);
  }
};

void take_nees(const evaluation::Evaluation& evaluation, Figures& figures) {
  double position = 0.0;
  double orientation = 0.0;
  double count = 0.0;
  for (std::size_t i = evaluation.frames.size() / 2; i < evaluation.frames.size(); ++i) {
    const evaluation::Frame& frame = evaluation.frames[i];
    if (!frame.nees_position) continue;
    position += *frame.nees_position;
    orientation += *frame.nees_orientation;
    count += 1.0;
  }
  if (count == 0.0) return;
  figures.nees_position = position / count;
  figures.nees_orientation = orientation / count;
}

void take_terrain(const evaluation::TerrainFigures& terrain, Figures& figures) {
  figures.z_rmse_ground = terrain.z_rmse;
  if (terrain.mode_agreement) figures.mode_agreement = 100.0 * *terrain.mode_agreement;
  if (terrain.along) {
    figures.slope_along_rmse = kDegPerRad * terrain.along->rmse;
    figures.slope_along_inside = 100.0 * terrain.along->inside;
  }
  if (terrain.across) {
    figures.slope_across_rmse = kDegPerRad * terrain.across->rmse;
    figures.slope_across_inside = 100.0 * terrain.across->inside;
  }
}

void take_errors(const evaluation::Evaluation& evaluation, Figures& figures) {
  figures.coverage = 100.0 * evaluation.coverage;
  figures.length = evaluation.length;
  figures.ate_rmse = evaluation.position_rmse;
  if (evaluation.position_ratio) figures.ate_percent = 100.0 * *evaluation.position_ratio;
  figures.z_rmse = evaluation.z_rmse;
  figures.rotation_rmse = kDegPerRad * evaluation.rotation_rmse;
  figures.start_to_end = evaluation.start_to_end.error;
  take_nees(evaluation, figures);
  if (evaluation.false_tracking) figures.false_tracking = 100.0 * evaluation.false_tracking->share;
  if (evaluation.terrain) take_terrain(*evaluation.terrain, figures);
}

}  // namespace

Figures measure(const simulator::Simulation& simulation, const Calibration& calibration, const FilterConfig& config,
                evaluation::AlignmentKind alignment, const OnHealth& on_health, const EstimatorChoice& choice) {
  const std::unique_ptr<Estimator> made =
      choice.make ? choice.make(config, calibration) : std::make_unique<Filter>(config, calibration);
  Estimator& estimator = *made;
  Record record;
  double processor_time = 0.0;
  ReplayOptions options;
  if (choice.timed) options.processor_time = &processor_time;
  options.camera = !calibration.cameras.empty();
  options.wheels = calibration.encoder && config.odometer.model != OdometerModel::none;
  options.change = [&](FeatureFrame& frame) {
    simulator::change_lenses(simulation.calibration().cameras, calibration.cameras, frame);
  };
  if (on_health) {
    options.after = [&](const simulator::Delivery& delivery) { on_health(delivery.arrival_ns, estimator.health()); };
  }
  replay(
      simulation, estimator, [&](TimeNs, const Estimate& estimate) { record.add(estimate); }, options);
  if (config.odometer.model == OdometerModel::none) record.estimate.terrain.clear();  // it was not asked

  Figures figures;
  const evaluation::Estimate& estimate = record.estimate;
  figures.coverage = 0.0;
  if (!record.finite || estimate.poses.size() < 2) return figures;

  std::vector<TimeNs> times;
  for (const evaluation::Pose& pose : estimate.poses) times.push_back(pose.t_ns);
  const SimulationTruth truth = truth_of(simulation, times);
  take_errors(evaluation::evaluate(estimate, truth.poses, alignment, truth.terrain), figures);
  const evaluation::PoseCovariance& last = estimate.covariance.back();
  figures.sigma_position = std::sqrt(last.topLeftCorner<3, 3>().trace());
  figures.sigma_orientation = kDegPerRad * std::sqrt(last.bottomRightCorner<3, 3>().trace());
  if (choice.timed) figures.frame_time = 1e3 * processor_time / static_cast<double>(estimate.poses.size());
  figures.features_rejected = record.features.rejected_percent();
  figures.wheel_rows_rejected = record.wheel_rows.rejected_percent();
  figures.beams_rejected = record.beams.rejected_percent();
  return figures;
}

}  // namespace ear::experiments
