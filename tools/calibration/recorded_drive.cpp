#include "tools/calibration/recorded_drive.h"

#include <cmath>
#include <stdexcept>

#include "calibration/drive_recorder.h"
#include "calibration/parameters.h"
#include "src/odometry_factory.h"
#include "tools/evaluation/read.h"
#include "tools/replay.h"

namespace ear::calibration {

Calibration for_search(Calibration calibration) {
  if (calibration.cameras.size() < 2) return calibration;
  const Priors priors = priors_of(calibration);
  CameraCalibration& right = calibration.cameras[1];
  const double lens = std::sqrt(2.0) * priors.principal_point / right.fv;
  right.pose_sigma = PoseSigma{std::hypot(priors.stereo_rotation, lens), priors.stereo_position};
  return calibration;
}

Drive recorded_drive(Recording& recording, const std::string& name, const Config& config,
                     const std::function<void(double)>& progress) {
  Drive drive;
  drive.name = name;
  const MakeEstimator make = [&drive](const FilterConfig& filter, const Calibration& calibration) {
    return std::make_unique<DriveRecorder>(filter, calibration, drive);
  };
  Odometry odometry = OdometryFactory::make(config, for_search(recording.calibration()), make);
  const TimeSpan span = recording.span();
  const double duration = seconds_between(span.first_ns, span.last_ns);
  tools::replay(recording, odometry, [&](const tools::ReplayedFrame& frame) {
    progress(seconds_between(span.first_ns, frame.t_ns) / duration);
  });
  return drive;
}

void add_reference(const std::filesystem::path& file, double sigma, Drive& drive) {
  const evaluation::Trajectory positions = evaluation::read_truth_or_positions(file).poses;
  for (const evaluation::Pose& pose : positions) {
    if (pose.t_ns < drive.imu.front().t_ns || pose.t_ns > drive.imu.back().t_ns) continue;
    drive.reference.push_back({pose.t_ns, pose.p_WB});
  }
  if (drive.reference.empty()) throw std::runtime_error(file.string() + ": no position within " + drive.name);
  drive.reference_sigma = sigma;
}

}  // namespace ear::calibration
