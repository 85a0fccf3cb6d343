#include "calibration/drive_recorder.h"

#include <cmath>

namespace ear::calibration {

DriveRecorder::DriveRecorder(const FilterConfig& config, const Calibration& calibration, Drive& drive, double interval)
    : filter_(config, calibration), drive_(drive), interval_ns_(static_cast<TimeNs>(std::llround(1e9 * interval))) {}

void DriveRecorder::add_imu(const ImuSample& sample) {
  if (drive_.imu.empty() || sample.t_ns > drive_.imu.back().t_ns) drive_.imu.push_back(sample);
  filter_.add_imu(sample);
}

void DriveRecorder::add_encoder(const EncoderSample& sample) {
  if (drive_.encoders.empty() || sample.t_ns > drive_.encoders.back().t_ns) drive_.encoders.push_back(sample);
  filter_.add_encoder(sample);
}

void DriveRecorder::add_laser(const LaserSample& sample) {
  if (drive_.lasers.empty() || sample.t_ns > drive_.lasers.back().t_ns) drive_.lasers.push_back(sample);
  filter_.add_laser(sample);
}

bool DriveRecorder::due(TimeNs t_ns) const {
  constexpr TimeNs kTolerance = 5'000'000;  // images at 30 Hz: every sixth one for 0.2 s
  return drive_.states.empty() || duration_ns(drive_.states.back().state.t_ns, t_ns) >= interval_ns_ - kTolerance;
}

std::optional<Estimate> DriveRecorder::process(const FeatureFrame& frame) {
  std::optional<Estimate> estimate = filter_.process(frame);
  if (estimate && due(estimate->state.t_ns)) drive_.states.push_back({estimate->state, frame.t_ns, frame.features});
  return estimate;
}

std::optional<Estimate> DriveRecorder::process_without_image(TimeNs t_ns) {
  std::optional<Estimate> estimate = filter_.process_without_image(t_ns);
  if (estimate && due(estimate->state.t_ns)) drive_.states.push_back({estimate->state, t_ns, {}});
  return estimate;
}

FilterConfig config_for_first_guess(FilterConfig config, const Calibration& calibration) {
  if (!calibration.cameras.empty()) config.odometer.model = OdometerModel::none;
  return config;
}

}  // namespace ear::calibration
