#include "filter/sources/cameras/track_update.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kNotAveraged = 2.0;  // measured, docs/decisions/0053: what is left out is alike in many features
constexpr int kIterations = 2;        // measured, docs/decisions/0059: one gives 3/4 of the gain, three no more
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
    : config_(config), focal_px_(focal_px), information_(config.window + 1, config.max_track_updates, config.kernels) {
  const auto clones = static_cast<std::size_t>(config.window) + 1;
  cameras_.reserve(2 * clones);
  sightings_.reserve(2 * clones);
  observations_.reserve(2 * clones);
  selected_.reserve(2 * kFeatureCapacity);
  used_.reserve(2 * kFeatureCapacity);
  found_.clones.reserve(clones);
  moved_.setZero(err::clone(config.window + 1));
}

void TrackUpdate::update(bool oldest_goes, CameraUpdate calibration, TrackTable& tracks, Ekf& ekf, Records& records) {
  const State& x = ekf.state();
  select(x, oldest_goes, tracks);
  linearize(tracks, x, false, ekf);
  if (most_left_out_ > 1.0) iterate(tracks, calibration, ekf);  // more than an image's noise
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
void TrackUpdate::select(const State& x, bool oldest_goes, const TrackTable& tracks) {
  selected_.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    if (track.observations.size() < kMinObservations) continue;
    const bool fills_window = oldest_goes && track.observations.front().frame == x.clones.front().frame;
    if (!continues(track, x) || fills_window) selected_.push_back(i);
  }
  const auto longer = [&](std::size_t a, std::size_t b) {
    const std::size_t observations_a = tracks[a].observations.size();
    const std::size_t observations_b = tracks[b].observations.size();
    return observations_a != observations_b ? observations_a > observations_b : a < b;
  };
  std::sort(selected_.begin(), selected_.end(), longer);
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

/// The update is where the sum of squares, of the prior too, is least: found by Gauss-Newton, whose first step is the
/// ordinary update (Bell and Cathey 1993). The rows are those of where the step before ended.
void TrackUpdate::iterate(const TrackTable& tracks, CameraUpdate calibration, Ekf& ekf) {
  auto moved = moved_.head(ekf.state().error_size());
  for (int i = 0; i < kIterations && information_.residual().size() > 0; ++i) {
    moved = ekf.correction(information_.H(), err::camera, information_.residual(), calibration);
    found_ = ekf.state();
    boxplus(found_, moved);
    linearize(tracks, found_, true, ekf);
    information_.take_back(moved.tail(moved.size() - err::camera));
  }
}

bool TrackUpdate::add(const Track& track, const State& x, bool again, const Ekf& ekf) {
  sightings_.clear();
  for_each_view(track, x, [&](int clone, std::size_t camera, const Eigen::Vector2d& uv) {
    const CameraPose& pose = cameras_[2 * static_cast<std::size_t>(clone) + camera];
    sightings_.push_back({pose.R_CW, pose.p_WC, x.camera.lens_error[camera].corrected(uv)});
  });
  const std::optional<InverseDepthPoint> point = triangulate(sightings_);
  if (!point) return false;
  const double sigma = config_.feature_sigma_px / focal_px_;
  const double unseen = kNotAveraged * left_out(track, point->inverse_depth, again, ekf) / sigma;
  most_left_out_ = std::max(most_left_out_, unseen);
  const double noise = std::hypot(1.0, unseen);
  observations_.clear();
  for_each_view(track, x, [&](int clone, std::size_t camera, const Eigen::Vector2d& uv) {
    observations_.push_back(linearize_observation(x, clone, static_cast<int>(camera), *point, uv));
    observations_.back().noise *= noise;
    residuals_[camera].squares_px2 += focal_px_ * focal_px_ * observations_.back().residual.squaredNorm();
    residuals_[camera].count += 2;
  });
  return information_.add(observations_, sigma, config_.huber_px / config_.feature_sigma_px, ekf.covariance().matrix(),
                          ekf.gate());
}

/// One camera shows the product of how far it moved and how near the feature is, of which the filter takes the first
/// order. What that leaves out is the square of the way's uncertainty over the way, of the parallax; two cameras are as
/// far apart as they are. docs/decisions/0053.
double TrackUpdate::left_out(const Track& track, double inverse_depth, bool again, const Ekf& ekf) const {
  if (sightings_.size() > track.observations.size()) return 0.0;  // a right camera saw it, too
  const Eigen::Vector3d& p_from = sightings_.front().p_WC;
  const auto farthest =
      std::max_element(sightings_.begin(), sightings_.end(), [&](const Sighting& a, const Sighting& b) {
        return (a.p_WC - p_from).squaredNorm() < (b.p_WC - p_from).squaredNorm();
      });
  if (farthest == sightings_.begin()) return 0.0;
  const Eigen::Vector3d& p_to = farthest->p_WC;
  const double way = (p_to - p_from).norm();
  const Eigen::RowVector3d along = (p_to - p_from).transpose() / way;
  Eigen::Matrix<double, 1, 2 * err::clone_size> J;  // of the way, by the errors of both clones
  J << along * skew(p_from), -along, -along * skew(p_to), along;
  const auto clone_of = [&](std::ptrdiff_t sighting) {
    return clone_index(ekf.state(), track.observations[static_cast<std::size_t>(sighting)].frame);
  };
  const int from = clone_of(0);
  const int to = clone_of(farthest - sightings_.begin());
  const Covariance& covariance = ekf.covariance();
  const auto P = [&](int a, int b) -> ClonePair {
    if (again) return covariance.corrected(err::clone(a), err::clone(b));
    return covariance.matrix().block<err::clone_size, err::clone_size>(err::clone(a), err::clone(b));
  };
  Eigen::Matrix<double, 2 * err::clone_size, 2 * err::clone_size> P_both;
  P_both << P(from, from), P(from, to), P(to, from), P(to, to);
  return std::abs(inverse_depth) * (J * P_both * J.transpose()).value() / way;
}

/// The newest that both cameras saw: what is wrong with the others is much the same.
void TrackUpdate::add_to_pattern(const Track& track, const CameraState& cameras) {
  const auto& seen = track.observations;
  const auto newest = std::find_if(seen.rbegin(), seen.rend(), [](const TrackObservation& o) { return o.has_right; });
  if (newest != seen.rend()) lens_pattern_.add(newest->left, newest->right, cameras);
}

/// What both cameras saw of this frame's features, against where they were found to be.
void TrackUpdate::log(const Ekf& ekf, Records& records) const {
  for (std::size_t camera = 0; camera < residuals_.size(); ++camera) {
    const Residuals& seen = residuals_[camera];
    if (seen.count == 0) continue;
    Innovation typical;  // [px]
    typical.value = std::sqrt(seen.squares_px2 / seen.count);
    typical.variance = config_.feature_sigma_px * config_.feature_sigma_px;
    typical.gate = ekf.gate().quantile(1);
    typical.score = 1.0 / ekf.state().clones.back().feature_noise;
    records.log.add(camera == 0 ? Source::camera_left : Source::camera_right, typical, records.statistics.features_used,
                    records.statistics.features_rejected, ekf.state().imu.t_ns);
  }
}

}  // namespace ear
