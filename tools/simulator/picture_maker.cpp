#include "tools/simulator/picture_maker.h"

#include <algorithm>

#include "tools/simulator/moving_panel.h"
#include "tools/simulator/obstruction.h"
#include "tools/simulator/sensors.h"

namespace ear::simulator {
namespace {

constexpr double kStrikeLasts = 0.25;   // [s] at most
constexpr double kAroundStrike = 0.03;  // [s] an exposure, and the smoothing of the motion

}  // namespace

bool changed_by_faults(const Simulation& simulation, const Shot& shot) {
  const double t = motion_time(simulation.exposures().at(shot.exposure));
  const std::vector<Fault>& faults = simulation.options().faults;
  const Light light = light_at(faults, shot.camera, t);
  if (light.covered || light.gain != 1.0) return true;
  return std::any_of(faults.begin(), faults.end(), [&](const Fault& fault) {
    if (fault.kind == FaultKind::people) return fault.active(t);
    if (fault.kind != FaultKind::hard_landing) return false;
    const std::vector<double>& touchdowns = simulation.plan().touchdowns;
    return std::any_of(touchdowns.begin(), touchdowns.end(), [&](double touchdown) {
      return fault.active(touchdown) && t > touchdown - kAroundStrike && t < touchdown + kStrikeLasts + kAroundStrike;
    });
  });
}

PictureMaker::PictureMaker(const Simulation& simulation)
    : simulation_(simulation),
      appearance_(paint_room(simulation.scene(), simulation.options().seed)),
      renderer_(simulation.scene(), appearance_, simulation.true_calibration().cameras) {
  for (const Passerby& passerby : simulation.passersby()) {
    people_.push_back(paint_passerby(passerby, simulation.options().seed));
  }
  if (simulation.board()) board_ = paint_board();
  for (const CameraCalibration& camera : simulation.true_calibration().cameras) {
    brightness_.push_back(vignetting(camera));
    rays_.push_back(make_rays(camera, Eigen::Vector2d::Zero()));
  }
}

cv::Mat PictureMaker::make(const Shot& shot) const {
  const std::uint64_t seed = simulation_.options().seed;
  const Shot source = shown(simulation_.exposures(), simulation_.options().faults, shot);
  const TimeNs taken_ns = simulation_.exposures().at(source.exposure);
  const double t = motion_time(taken_ns);
  const CameraCalibration& camera = simulation_.true_calibration().cameras.at(source.camera);
  const Trajectory& trajectory = simulation_.plan().trajectory;
  const Light light = light_at(simulation_.options().faults, source.camera, t);
  const Obstruction& obstruction = simulation_.obstruction();

  cv::Mat grey(camera.height, camera.width, CV_32FC1, cv::Scalar(0.0));
  if (!light.covered && !obstruction.covered(t)) {
    const Exposure exposure = exposure_at(t, seed);
    grey = renderer_.render(source.camera, trajectory, t, exposure);
    for (std::size_t i = 0; i < people_.size(); ++i) {
      const Passerby& passerby = simulation_.passersby()[i];
      if (!passerby.fault().active(t)) continue;
      draw_moving_panel([&](double instant) { return passerby.panel(instant); }, people_[i], camera, trajectory, t,
                        exposure, brightness_[source.camera], grey);
    }
    if (board_ && simulation_.board()->held(t)) {
      draw_moving_panel([&](double instant) { return simulation_.board()->panel(instant); }, *board_, camera,
                        trajectory, t, exposure, brightness_[source.camera], grey);
    }
  }
  draw_obstruction(obstruction, rays_[source.camera], source.camera, t, grey);
  grey *= light.gain;
  if (light.covered) grey.setTo(kCoverGrey);
  return sensor_.read(grey, picture_key(seed, taken_ns, source.camera));
}

}  // namespace ear::simulator
