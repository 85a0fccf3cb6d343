#include "calibration/drive_recorder.h"

namespace ear::calibration {
namespace {

/// Later samples only: what comes twice or too late is left to the filter to count.
template <typename Sample>
void append(std::vector<Sample>& samples, const Sample& sample) {
  if (samples.empty() || sample.t_ns > samples.back().t_ns) samples.push_back(sample);
}

}  // namespace

void DriveRecorder::add_imu(const ImuSample& sample) {
  append(drive_.imu, sample);
  filter_.add_imu(sample);
}

void DriveRecorder::add_encoder(const EncoderSample& sample) {
  append(drive_.encoders, sample);
  filter_.add_encoder(sample);
}

void DriveRecorder::add_laser(const LaserSample& sample) {
  append(drive_.lasers, sample);
  filter_.add_laser(sample);
}

std::optional<Estimate> DriveRecorder::process(const FeatureFrame& frame) {
  append(drive_.frames, frame);
  return filter_.process(frame);
}

}  // namespace ear::calibration
