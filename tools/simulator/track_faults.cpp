#include "tools/simulator/track_faults.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <unordered_map>
#include <utility>

#include "tools/simulator/camera_pose.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/sensors.h"

namespace ear::simulator {
namespace {

constexpr double kBorder = 3.0;               // [px] front ends keep away from the border
constexpr std::size_t kPointsOnPeople = 150;  // more than are in view at a time
constexpr double kPatience = 0.25;            // [s] without a new image, after which no track can be taken up again
constexpr double kSamePlace = 1e-9;           // [m]

struct Seen {
  std::uint64_t id;
  Eigen::Vector2d ray;  // normalized
};
// What one camera sees, and what both do: left, right.
using Eye = std::vector<Seen>;
using Eyes = std::array<Eye, 2>;

Eyes split(const FeatureFrame& frame) {
  Eyes eyes;
  for (const FeatureObservation& seen : frame.features) {
    eyes[0].push_back({seen.id, seen.left});
    if (seen.has_right) eyes[1].push_back({seen.id, seen.right});
  }
  return eyes;
}

std::vector<FeatureObservation> join(const Eyes& eyes) {
  std::unordered_map<std::uint64_t, Eigen::Vector2d> right;
  for (const Seen& seen : eyes[1]) right[seen.id] = seen.ray;
  std::vector<FeatureObservation> features;
  for (const Seen& seen : eyes[0]) {
    FeatureObservation feature{seen.id, seen.ray, Eigen::Vector2d::Zero(), false};
    if (const auto match = right.find(seen.id); match != right.end()) {
      feature.right = match->second;
      feature.has_right = true;
    }
    features.push_back(feature);
  }
  return features;
}

void remove_if(Eye& eye, const std::function<bool(const Seen&)>& lost) {
  eye.erase(std::remove_if(eye.begin(), eye.end(), lost), eye.end());
}

// The ray moved on by as many pixels as its point is moved.
Eigen::Vector2d shifted(const CameraCalibration& camera, const Eigen::Vector2d& ray, const Eigen::Vector2d& from_px,
                        const Eigen::Vector2d& to_px) {
  return to_ray(camera, to_pixel(camera, ray) + to_px - from_px);
}

Eigen::Vector2d noisy(const CameraCalibration& camera, const Eigen::Vector2d& ray, double sigma_px, Rng& rng) {
  const double du = normal(rng, sigma_px);
  const double dv = normal(rng, sigma_px);
  return to_ray(camera, to_pixel(camera, ray) + Eigen::Vector2d(du, dv));
}

// A vehicle that strikes the ground otherwise than planned sees its points from elsewhere.
void move_eyes(Eyes& eyes, const TrackFaults& setting, const std::vector<Eigen::Vector3d>& points_W, double t) {
  for (std::size_t c = 0; c < 2; ++c) {
    const CameraCalibration& camera = setting.cameras[c];
    const Eigen::Isometry3d clean_T_CW = camera_pose(setting.clean_motion.at(t), camera.T_BC).inverse();
    const Eigen::Isometry3d T_CW = camera_pose(setting.motion.at(t), camera.T_BC).inverse();
    if ((clean_T_CW.matrix() - T_CW.matrix()).norm() < kSamePlace) continue;
    Eye moved;
    for (const Seen& seen : eyes[c]) {
      const Eigen::Vector3d& p_W = points_W.at(seen.id - 1);
      const auto from = project(camera, clean_T_CW * p_W);
      const auto to = project(camera, T_CW * p_W, kBorder);
      if (from && to) moved.push_back({seen.id, shifted(camera, seen.ray, *from, *to)});
    }
    eyes[c] = std::move(moved);
  }
}

// The features on people, at fixed places of them.
class PeopleTracks {
 public:
  PeopleTracks(const Passerby& passerby, std::uint64_t first_id, std::uint64_t seed)
      : passerby_(passerby), first_id_(first_id), rng_(fault_rng(passerby.fault(), seed)) {
    const Panel panel = passerby.panel(passerby.fault().start);
    for (std::size_t i = 0; i < kPointsOnPeople; ++i) {
      const double a = uniform(rng_, 0.0, panel.width);
      places_.emplace_back(a, uniform(rng_, 0.0, panel.height));
    }
  }

  void apply(Eyes& eyes, const TrackFaults& setting, const std::vector<Eigen::Vector3d>& points_W, double t) {
    if (!passerby_.fault().active(t)) return;
    const Panel panel = passerby_.panel(t);
    for (std::size_t c = 0; c < 2; ++c) {
      const CameraCalibration& camera = setting.cameras[c];
      const Eigen::Isometry3d T_WC = camera_pose(setting.motion.at(t), camera.T_BC);
      remove_if(eyes[c], [&](const Seen& seen) {
        // Other people cross each other's way unhindered.
        return seen.id <= points_W.size() && hides(panel, T_WC.translation(), points_W[seen.id - 1]);
      });
      for (std::size_t i = 0; i < places_.size(); ++i) {
        if (eyes[c].size() >= static_cast<std::size_t>(setting.options.max_features)) break;
        const Eigen::Vector3d p_W = panel.corner_W + places_[i].x() * panel.u_W + places_[i].y() * panel.v_W;
        const Eigen::Vector3d p_C = T_WC.inverse() * p_W;
        if (!project(camera, p_C, kBorder)) continue;
        eyes[c].push_back({first_id_ + i, noisy(camera, p_C.hnormalized(), setting.options.sigma_px, rng_)});
      }
    }
  }

 private:
  const Passerby& passerby_;
  std::uint64_t first_id_;
  Rng rng_;
  std::vector<Eigen::Vector2d> places_;  // on the panel [m]
};

// Of the tracks, some can still be followed in bad light, less well: which, chance decides once for each.
class BadLight {
 public:
  BadLight(const Fault& fault, std::uint64_t seed) : fault_(fault), rng_(fault_rng(fault, seed)) {
    const double gain = fault.parameter;
    if (fault.kind == FaultKind::camera_dark) {  // contrast falls with the light, the noise of the sensor stays
      share_ = std::min(1.0, 4.0 * gain);
      noise_ = std::max(1.0, 0.2 / gain);
    } else {  // what is not white yet becomes flat
      share_ = 1.0 / gain;
      noise_ = std::sqrt(gain);
    }
  }

  void apply(Eyes& eyes, const TrackFaults& setting, double t) {
    if (!fault_.active(t)) return;
    const double added_sigma = setting.options.sigma_px * std::sqrt(noise_ * noise_ - 1.0);
    for (std::size_t c = 0; c < 2; ++c) {
      if (!fault_.hits(c)) continue;
      remove_if(eyes[c], [this](const Seen& seen) { return luck_of(seen.id) >= share_; });
      for (Seen& seen : eyes[c]) seen.ray = noisy(setting.cameras[c], seen.ray, added_sigma, rng_);
    }
  }

 private:
  double luck_of(std::uint64_t id) {
    const auto known = luck_.find(id);
    return known != luck_.end() ? known->second : luck_.emplace(id, uniform(rng_, 0.0, 1.0)).first->second;
  }

  Fault fault_;
  Rng rng_;
  double share_ = 1.0;  // of the tracks that are left
  double noise_ = 1.0;  // times the usual one
  std::unordered_map<std::uint64_t, double> luck_;
};

// Gives interrupted tracks new ids.
class Renaming {
 public:
  explicit Renaming(std::uint64_t next_id) : next_id_(next_id) {}

  // `fresh`: the left image is a new one. `patience`: longest time without a new image [s].
  void apply(FeatureFrame& frame, double t, bool fresh, double patience) {
    ++frame_;
    for (FeatureObservation& feature : frame.features) {
      const auto [entry, is_new] = tracks_.try_emplace(feature.id, Track{feature.id, frame_, t});
      Track& track = entry->second;
      const bool interrupted = track.last_frame + 1 < frame_ || (fresh && t - track.last_fresh > patience);
      if (!is_new && interrupted) track.id = next_id_++;
      track.last_frame = frame_;
      if (fresh) track.last_fresh = t;
      feature.id = track.id;
    }
  }

 private:
  struct Track {
    std::uint64_t id;
    std::size_t last_frame;  // in which it was
    double last_fresh;       // [s]
  };
  std::uint64_t next_id_;
  std::size_t frame_ = 0;
  std::unordered_map<std::uint64_t, Track> tracks_;  // by the id that they have without interruptions
};

}  // namespace

std::vector<FeatureFrame> fault_tracks(const Tracks& clean, const std::vector<Frame>& frames,
                                       const TrackFaults& setting) {
  std::uint64_t next_id = clean.points_W.size() + 1;
  std::vector<PeopleTracks> people;
  for (const Passerby& passerby : setting.passersby) {
    people.emplace_back(passerby, next_id, setting.seed);
    next_id += kPointsOnPeople;
  }
  std::vector<BadLight> lights;
  for (const Fault& fault : setting.faults) {
    const bool light = fault.kind == FaultKind::camera_dark || fault.kind == FaultKind::camera_overexposed;
    if (light) lights.emplace_back(fault, setting.seed);
  }

  std::vector<TimeNs> exposures;
  std::vector<Eyes> seen;  // per exposure
  for (const FeatureFrame& frame : clean.frames) {
    const double t = motion_time(frame.t_ns);
    Eyes eyes = split(frame);
    move_eyes(eyes, setting, clean.points_W, t);
    for (PeopleTracks& tracks : people) tracks.apply(eyes, setting, clean.points_W, t);
    for (BadLight& light : lights) light.apply(eyes, setting, t);
    for (std::size_t c = 0; c < 2; ++c) {
      if (light_at(setting.faults, c, t).covered) eyes[c].clear();
    }
    exposures.push_back(frame.t_ns);
    seen.push_back(std::move(eyes));
  }

  std::vector<FeatureFrame> result;
  std::optional<Shot> before;  // what the left image of the last frame shows
  Renaming renaming(next_id);
  const double interval = exposures.size() < 2 ? 0.0 : seconds_between(exposures[0], exposures[1]);
  for (const Frame& frame : frames) {
    Eyes eyes;
    for (std::size_t c = 0; c < 2; ++c) {
      const Shot shot = shown(exposures, setting.faults, {frame.exposure, c});
      eyes[c] = seen[shot.exposure][shot.camera];
      if (shot.camera == c) continue;
      for (Seen& point : eyes[c]) {  // the pixel is that of one lens, which the other one's model removes
        point.ray = to_ray(setting.cameras[c], to_pixel(setting.cameras[shot.camera], point.ray));
      }
    }
    FeatureFrame faulty{frame.t_ns, join(eyes)};
    const Shot left = shown(exposures, setting.faults, {frame.exposure, 0});
    faulty.repeated = before && left.exposure == before->exposure && left.camera == before->camera;
    before = left;
    const bool fresh = left.exposure == frame.exposure;
    renaming.apply(faulty, motion_time(frame.taken_ns), fresh, std::max(kPatience, 1.5 * interval));
    result.push_back(std::move(faulty));
  }
  return result;
}

}  // namespace ear::simulator
