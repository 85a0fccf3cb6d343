#include "tools/paper/measure/run.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "filter/estimator.h"
#include "src/recording/recording.h"
#include "tools/estimators.h"
#include "tools/evaluation/evaluate.h"
#include "tools/evaluation/read.h"
#include "tools/experiments/replay_simulation.h"
#include "tools/experiments/simulation_truth.h"
#include "tools/paper/measure/changed_samples.h"
#include "tools/processor_time.h"
#include "tools/replay.h"

namespace ear::paper {
namespace {

constexpr double kDegPerRad = 180.0 / M_PI;

/// What is collected while the estimator runs.
struct Record {
  evaluation::Estimate estimate;
  std::vector<double> frame_times;  ///< [s]
  bool finite = true;

  void add(const Estimate& e) {
    finite = finite && e.state.p_WB.allFinite() && e.state.q_WB.coeffs().allFinite() && e.covariance.allFinite();
    if (finite) experiments::append(estimate, e);
  }
};

/// Value that a share of them does not exceed.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

Moment moment_of(const evaluation::Frame& frame, TimeNs start_ns) {
  const Eigen::Vector3d& p = frame.aligned.p_WB;
  const Eigen::Vector3d& truth = frame.match.truth.p_WB;
  return {seconds_between(start_ns, frame.match.truth.t_ns),
          frame.distance,
          p.x(),
          p.y(),
          p.z(),
          truth.x(),
          truth.y(),
          truth.z(),
          frame.position_error.norm(),
          frame.nees_position};
}

void take_figures(const evaluation::Evaluation& evaluation, TimeNs start_ns, Result& result) {
  result.estimated = true;
  result.coverage = evaluation.coverage;
  result.length = evaluation.length;
  result.ate = evaluation.position_rmse;
  result.z = evaluation.z_rmse;
  result.rotation = kDegPerRad * evaluation.rotation_rmse;
  result.start_to_end = evaluation.start_to_end.error;
  result.end_distance = evaluation.start_to_end.estimated;
  result.true_end_distance = evaluation.start_to_end.truth;
  if (evaluation.nees && evaluation.nees->frames > 0) {
    result.nees_position = evaluation.nees->position.mean;
    result.nees_orientation = evaluation.nees->orientation.mean;
  }
  const std::size_t count = evaluation.frames.size();
  const std::size_t step = std::max<std::size_t>(1, (count + kMoments - 1) / kMoments);
  for (std::size_t i = 0; i < count; i += step) result.moments.push_back(moment_of(evaluation.frames[i], start_ns));
}

Result result_of(const Record& record, const evaluation::Trajectory& truth) {
  Result result;
  result.frame_ms = 1e3 * quantile(record.frame_times, 0.5);
  result.worst_frame_ms = 1e3 * quantile(record.frame_times, 0.99);
  if (!record.finite || record.estimate.poses.size() < 2) return result;
  take_figures(evaluation::evaluate(record.estimate, truth, evaluation::AlignmentKind::yaw), truth.front().t_ns,
               result);
  return result;
}

MakeEstimator maker_of(const Configuration& configuration) {
  if (!is_built(configuration.estimator)) throw std::logic_error("this program has no " + configuration.name);
  return tools::estimator_named(name_of(configuration.estimator));
}

}  // namespace

Result run_on_tracks(const simulator::Simulation& simulation, const Configuration& configuration) {
  const Calibration calibration = given(configuration, simulation.calibration());
  const FilterConfig& config = configuration.config.filter;
  const std::unique_ptr<ear::Estimator> estimator = maker_of(configuration)(config, calibration);
  Record record;
  experiments::ReplayOptions options;
  options.wheels = calibration.encoder && config.odometer.model != OdometerModel::none;
  if (!configuration.pitch_rate) options.change_encoder = WithoutPitch(simulation, calibration);
  if (configuration.beams_together) options.change_laser = together;
  double begin = 0.0;
  options.change = [&](FeatureFrame&) {
    begin = tools::thread_time();
  };  // the last thing before the estimator has the frame
  options.after = [&](const simulator::Delivery& delivery) {
    if (delivery.stream == simulator::SensorStream::camera) record.frame_times.push_back(tools::thread_time() - begin);
  };
  experiments::replay(
      simulation, *estimator, [&](TimeNs, const Estimate& estimate) { record.add(estimate); }, options);

  std::vector<TimeNs> times;
  for (const evaluation::Pose& pose : record.estimate.poses) times.push_back(pose.t_ns);
  return result_of(record, experiments::truth_of(simulation, times).poses);
}

Result run_on_images(const std::filesystem::path& recording, double camera_rate_hz,
                     const Configuration& configuration) {
  RecordingOptions options;
  options.camera_rate_hz = camera_rate_hz;
  Recording samples(recording, options);
  Odometry odometry =
      OdometryFactory::make(configuration.config, given(configuration, samples.calibration()), maker_of(configuration));
  Record record;
  double begin = 0.0;
  const auto before_sample = [&](const Sample&) {
    begin = tools::thread_time();
  };  // a frame goes with the sample after it
  const auto on_frame = [&](const tools::ReplayedFrame& frame) {
    record.frame_times.push_back(tools::thread_time() - begin);
    if (frame.estimate) record.add(*frame.estimate);
  };
  tools::replay(samples, odometry, on_frame, before_sample);
  return result_of(record, evaluation::read_truth(recording));
}

}  // namespace ear::paper
