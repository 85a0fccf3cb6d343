#include "filter/sources/cameras/track_update.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "filter/ingest/limits.h"
#include "filter/sources/cameras/stereo_motion.h"

namespace ear {
namespace {

constexpr double kNotAveraged = 2.0;  // measured, docs/decisions/0053: what is left out is alike in many features
constexpr double kNegligible = 1e-4;  // measured, docs/performance.md: 2e-4 of a frame's information, 12 % of the rows

int clone_index(const State& x, std::uint64_t frame) {
  const auto clone = std::lower_bound(x.clones.begin(), x.clones.end(), frame,
                                      [](const Clone& c, std::uint64_t f) { return c.frame < f; });
  return static_cast<int>(clone - x.clones.begin());
}

/// Does the newest clone see the feature?
bool continues(const Track& track, const State& x) { return track.observations.back().frame == x.clones.back().frame; }

/// Calls see(clone, camera, where) for each place in an image where the feature was seen.
template <typename Function>
void for_each_view(const Track& track, const State& x, const Function& see) {
  for (const TrackObservation& o : track.observations) {
    const int clone = clone_index(x, o.frame);
    see(clone, 0, o.left);
    if (o.has_right) see(clone, 1, o.right);
  }
}

/// Where the gate refuses most features, those that pass agree by chance with what is wrong: they are refused too. True
/// then.
bool refuse_few(Records& records) {
  FrameStatistics& seen = records.statistics;
  if (!refuses_most(seen.features_used, seen.features_rejected)) return false;
  seen.features_rejected += std::exchange(seen.features_used, 0);
  if (records.outcomes != nullptr) {
    for (TrackOutcome& outcome : *records.outcomes) outcome.used = false;
  }
  return true;
}

}  // namespace

TrackUpdate::TrackUpdate(const FilterConfig& config, double focal_px)
    : config_(config),
      focal_px_(focal_px),
      information_(config.window + 1, config.max_track_updates, config.kernels),
      iterated_(config.window) {
  const auto clones = static_cast<std::size_t>(config.window) + 1;
  cameras_.reserve(2 * clones);
  sightings_.reserve(2 * clones);
  observations_.reserve(2 * clones);
  selected_.reserve(2 * kFeatureCapacity);
  used_.reserve(2 * kFeatureCapacity);
}

/// After a gap the tracks that span it are used at once: one after the other, each would move a state that is far off
/// by what it does not know of the others.
void TrackUpdate::update(UsedTracks use, CameraUpdate calibration, TrackTable& tracks, Ekf& ekf, Records& records) {
  const State& x = ekf.state();
  use_ = use;
  select(x, use, tracks);
  linearize(tracks, x, false, ekf);
  if (use == UsedTracks::all || most_left_out_ > 1.0) iterate(tracks, calibration, ekf);  // more than an image's noise
  for (std::size_t k = 0; k < selected_.size(); ++k) {
    const std::size_t i = selected_[k];
    const bool used = used_[k];
    if (used) add_to_pattern(tracks[i], x.camera);
    ++(used ? records.statistics.features_used : records.statistics.features_rejected);
    if (records.outcomes != nullptr) records.outcomes->push_back({tracks[i].id, used});
    tracks[i].observations.clear();  // each observation is used once
  }
  lens_pattern_.forget();
  const bool contradicted = refuse_few(records);
  log(ekf, records);
  if (!contradicted && information_.residual().size() > 0) {
    ekf.apply(information_.H(), err::camera, information_.residual(), calibration);
  }
  // Features that ended, used or not, are forgotten.
  tracks.keep_if([&](const Track& track) { return !track.observations.empty() && continues(track, x); });
}

/// The longest first.
void TrackUpdate::select(const State& x, UsedTracks use, const TrackTable& tracks) {
  selected_.clear();
  const bool all = use == UsedTracks::all;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    if (track.observations.size() < kMinObservations) continue;
    const bool fills_window =
        use == UsedTracks::oldest_too && track.observations.front().frame == x.clones.front().frame;
    if (all || fills_window || !continues(track, x)) selected_.push_back(i);
  }
  const auto sooner = [&](std::size_t a, std::size_t b) {
    const bool goes_on_a = all && continues(tracks[a], x), goes_on_b = all && continues(tracks[b], x);
    if (goes_on_a != goes_on_b) return goes_on_a;
    const std::size_t observations_a = tracks[a].observations.size();
    const std::size_t observations_b = tracks[b].observations.size();
    return observations_a != observations_b ? observations_a > observations_b : a < b;
  };
  std::sort(selected_.begin(), selected_.end(), sooner);
  const auto limit = static_cast<std::size_t>(config_.max_track_updates);
  if (selected_.size() > limit) selected_.resize(limit);
}

void TrackUpdate::linearize(const TrackTable& tracks, const State& at, bool again, const Ekf& ekf) {
  information_.start(at.error_size());
  residuals_ = {};
  most_left_out_ = 0.0;
  camera_poses(at, cameras_);
  used_.clear();
  for (const std::size_t i : selected_) used_.push_back(add(tracks[i], at, again, ekf));
  information_.compress(kNegligible);
}

void TrackUpdate::iterate(const TrackTable& tracks, CameraUpdate calibration, Ekf& ekf) {
  const auto any = [this] { return information_.residual().size() > 0; };
  if (!any()) return;
  iterated_.run(
      ekf.state(), [&] { return ekf.correction(information_.H(), err::camera, information_.residual(), calibration); },
      [&](const State& found, const auto& moved) {
        linearize(tracks, found, true, ekf);
        information_.take_back(moved.tail(moved.size() - err::camera));
        return any();
      });
}

bool TrackUpdate::add(const Track& track, const State& x, bool again, const Ekf& ekf) {
  sightings_.clear();
  for_each_view(track, x, [&](int clone, std::size_t camera, const Eigen::Vector2d& uv) {
    const CameraPose& pose = cameras_[2 * static_cast<std::size_t>(clone) + camera];
    sightings_.push_back({pose.R_CW, pose.p_WC, x.camera.lens_error[camera].corrected(uv)});
  });
  const std::optional<InverseDepthPoint> point = triangulate(sightings_);
  if (!point) return false;
  const double unseen = left_out(track, point->inverse_depth, again, ekf) / sigma();
  most_left_out_ = std::max(most_left_out_, unseen);
  const double noise = std::hypot(1.0, unseen);
  observations_.clear();
  for_each_view(track, x, [&](int clone, std::size_t camera, const Eigen::Vector2d& uv) {
    observations_.push_back(linearize_observation(x, clone, static_cast<int>(camera), *point, uv));
    observations_.back().noise *= noise;
    residuals_[camera].squares_px2 += focal_px_ * focal_px_ * observations_.back().residual.squaredNorm();
    residuals_[camera].count += 2;
  });
  return information_.add(observations_, sigma(), config_.huber_px / config_.feature_sigma_px,
                          ekf.covariance().matrix(), ekf.gate());
}

/// Where a feature is seen depends on the product of how near it is and how far the camera moved, of which the filter
/// takes the first order. The product of what is unknown of both is left out. By one camera a feature is as near as the
/// way says: docs/decisions/0053. By two it is as near as their noise says, each another one, and the way is known but
/// for a gap: docs/decisions/0066.
double TrackUpdate::left_out(const Track& track, double inverse_depth, bool again, const Ekf& ekf) const {
  const State& x = ekf.state();
  const auto clone_of = [&](const TrackObservation& o) { return clone_index(x, o.frame); };
  const std::vector<TrackObservation>& seen = track.observations;
  const std::size_t by_right = sightings_.size() - seen.size();
  if (by_right > 0) {
    if (use_ != UsedTracks::all) return 0.0;
    const double mean_sigma = sigma() / std::sqrt(static_cast<double>(by_right));
    const double variance = way_covariance(clone_of(seen.front()), clone_of(seen.back()), again, ekf).trace();
    return stereo_inverse_depth_sigma(x.camera, mean_sigma) * std::sqrt(std::max(0.0, variance));
  }
  const Eigen::Vector3d& p_from = sightings_.front().p_WC;
  const auto farthest =
      std::max_element(sightings_.begin(), sightings_.end(), [&](const Sighting& a, const Sighting& b) {
        return (a.p_WC - p_from).squaredNorm() < (b.p_WC - p_from).squaredNorm();
      });
  if (farthest == sightings_.begin()) return 0.0;
  const Eigen::Vector3d way = farthest->p_WC - p_from;
  const Eigen::Vector3d along = way.normalized();
  const TrackObservation& to = *(seen.begin() + (farthest - sightings_.begin()));
  const Eigen::Matrix3d covariance = way_covariance(clone_of(seen.front()), clone_of(to), again, ekf);
  return kNotAveraged * std::abs(inverse_depth) * along.dot(covariance * along) / way.norm();
}

Eigen::Matrix3d TrackUpdate::way_covariance(int from, int to, bool again, const Ekf& ekf) const {
  const auto camera = [this](int clone) -> ClonePoint {
    return {err::clone(clone), cameras_[2 * static_cast<std::size_t>(clone)].p_WC};
  };
  return ekf.covariance().of_way(camera(from), camera(to), again);
}

/// The newest that both cameras saw: what is wrong with the others is much the same.
void TrackUpdate::add_to_pattern(const Track& track, const CameraState& cameras) {
  const auto& seen = track.observations;
  const auto newest = std::find_if(seen.rbegin(), seen.rend(), [](const TrackObservation& o) { return o.has_right; });
  if (newest != seen.rend()) lens_pattern_.add(newest->left, newest->right, cameras);
}

/// What both cameras saw of this frame's features, against where they were found to be.
void TrackUpdate::log(const Ekf& ekf, Records& records) const {
  const Clone& newest = ekf.state().clones.back();
  for (std::size_t camera = 0; camera < residuals_.size(); ++camera) {
    const Residuals& seen = residuals_[camera];
    if (seen.count == 0) continue;
    Innovation typical;  // [px]
    typical.value = std::sqrt(seen.squares_px2 / seen.count);
    typical.variance = config_.feature_sigma_px * config_.feature_sigma_px;
    typical.gate = ekf.gate().quantile(1);
    typical.score = newest.weight / newest.feature_noise;
    records.log.add(camera == 0 ? Source::camera_left : Source::camera_right, typical, records.statistics.features_used,
                    records.statistics.features_rejected, ekf.state().imu.t_ns);
  }
}

}  // namespace ear
