#include "tools/calibration/recorded_drive.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "calibration/drive_recorder.h"
#include "calibration/parameters.h"
#include "src/odometry_factory.h"
#include "src/recording/input_error.h"
#include "src/swapped_cameras.h"
#include "tools/evaluation/read.h"
#include "tools/replay.h"

namespace ear::calibration {
namespace {

constexpr double kTorn = 2.0;  // [s] that one sensor ends before another

/// The images as they come, until it is known which camera is which.
class CamerasAsStated {
 public:
  CamerasAsStated(const Calibration& calibration, std::string name) : name_(std::move(name)) {
    if (calibration.cameras.size() > 1) check_.emplace(calibration.cameras[0], calibration.cameras[1]);
  }

  void require(const Sample& sample) {
    const auto* frame = std::get_if<RecordedFrame>(&sample);
    if (!check_ || frame == nullptr || frame->left.empty() || frame->right.empty()) return;
    check_->add(frame->left, frame->right);
    if (check_->verdict() == SwappedCameras::Verdict::swapped) {
      throw InputError(name_ + ": cam0, cam1: left and right are swapped: " + std::to_string(check_->exchanged()) +
                       " of " + std::to_string(check_->exchanged() + check_->as_stated()) +
                       " features that both see would lie behind them");
    }
    if (check_->verdict() == SwappedCameras::Verdict::right) check_.reset();
  }

 private:
  std::string name_;
  std::optional<SwappedCameras> check_;
};

}  // namespace

Calibration for_search(Calibration calibration) {
  if (calibration.cameras.size() < 2) return calibration;
  const Priors priors = priors_of(calibration);
  calibration.cameras[1].pose_sigma = PoseSigma{priors.stereo_rotation, priors.stereo_position};
  for (std::size_t i = 0; i < 2; ++i) {
    CameraCalibration& camera = calibration.cameras[i];
    camera.intrinsics_sigma = IntrinsicsSigma{priors.focal_length[i] * camera.fu, priors.principal_point[i]};
  }
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
  CamerasAsStated cameras(recording.calibration(), name);
  tools::replay(
      recording, odometry,
      [&](const tools::ReplayedFrame& frame) { progress(seconds_between(span.first_ns, frame.t_ns) / duration); },
      [&](const Sample& sample) { cameras.require(sample); });
  return drive;
}

std::vector<std::string> ends_early(const Drive& drive) {
  struct End {
    const char* sensor;
    TimeNs t_ns;
  };
  std::vector<End> ends;
  if (!drive.imu.empty()) ends.push_back({"imu0", drive.imu.back().t_ns});
  if (!drive.encoders.empty()) ends.push_back({"encoder0", drive.encoders.back().t_ns});
  if (!drive.lasers.empty()) ends.push_back({"laser0", drive.lasers.back().t_ns});
  if (!drive.frames.empty()) ends.push_back({"cam0", drive.frames.back().t_ns});
  const auto sees_right = [](const FeatureFrame& frame) {
    return std::any_of(frame.features.begin(), frame.features.end(),
                       [](const FeatureObservation& feature) { return feature.has_right; });
  };
  const auto last_right = std::find_if(drive.frames.rbegin(), drive.frames.rend(), sees_right);
  if (last_right != drive.frames.rend()) ends.push_back({"cam1", last_right->t_ns});
  std::vector<std::string> words;
  if (ends.empty()) return words;
  const TimeNs last_ns =
      std::max_element(ends.begin(), ends.end(), [](const End& a, const End& b) { return a.t_ns < b.t_ns; })->t_ns;
  for (const End& end : ends) {
    const double missing = seconds_between(end.t_ns, last_ns);
    if (missing < kTorn) continue;
    words.push_back(drive.name + ": " + end.sensor + " ends " + std::to_string(std::lround(missing)) +
                    " s before other sensors: is its file whole?");
  }
  return words;
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
