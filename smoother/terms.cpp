#include "smoother/terms.h"

#include <algorithm>
#include <array>
#include <utility>

#include "smoother/feature_factor.h"
#include "smoother/imu_factor.h"
#include "smoother/standstill_factor.h"
#include "smoother/wheel_factor.h"

namespace ear::smoother {
namespace {

constexpr std::size_t kMostPoints = 80;  // features that are unknowns, those with most observations first

std::optional<InverseDepthPoint> triangulated(const Unknowns& unknowns, const Track& track) {
  const CameraState camera = unknowns.cameras();
  std::vector<Sighting> sightings;
  for (const TrackObservation& o : track.observations) {
    const Pose T_WB = unknowns.pose(unknowns.index_of(o.frame));
    const Eigen::Matrix3d R_WC0 = T_WB.R * camera.T_BC0.R;
    const Eigen::Vector3d p_WC0 = T_WB.p + T_WB.R * camera.T_BC0.p;
    sightings.push_back({R_WC0.transpose(), p_WC0, o.left});
    if (!o.has_right) continue;
    sightings.push_back({(R_WC0 * camera.T_C0C1.R).transpose(), p_WC0 + R_WC0 * camera.T_C0C1.p, o.right});
  }
  return triangulate(sightings);
}

}  // namespace

Terms::Terms(const FilterConfig& config, double focal_px)
    : standstill_(config.standstill),
      sigma_(config.feature_sigma_px / focal_px),
      gate_(config.gate_probability, 4 * (config.window + 1)),
      huber_(config.huber_px / config.feature_sigma_px) {}

int Terms::collect(Unknowns& unknowns, const TrackTable& tracks) {
  clear();
  collect_between(unknowns);
  std::vector<const Track*> chosen;
  for (const Track& track : tracks) {
    if (track.observations.size() >= kMinObservations) chosen.push_back(&track);
  }
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const Track* a, const Track* b) { return a->observations.size() > b->observations.size(); });
  if (chosen.size() > kMostPoints) chosen.resize(kMostPoints);
  int nowhere = 0;
  for (const Track* track : chosen) nowhere += add_point(unknowns, *track) ? 0 : 1;
  return nowhere;
}

void Terms::collect_between(Unknowns& unknowns) {
  for (std::size_t j = 1; j < unknowns.size(); ++j) {
    Unknowns::Frame& a = unknowns[j - 1];
    Unknowns::Frame& b = unknowns[j];
    const Interval& since = b.since;
    between_.push_back(
        {std::make_unique<ImuFactor>(since.imu), {a.pose.data(), a.motion.data(), b.pose.data(), b.motion.data()}});
    if (since.wheels) {
      const Eigen::Matrix3d covariance = since.wheels->covariance.topLeftCorner<3, 3>();
      between_.push_back({std::make_unique<WheelFactor>(*since.wheels, unknowns.given(), covariance),
                          {a.pose.data(), a.motion.data(), b.pose.data(), unknowns.calibration().wheels.data()}});
    }
    if (since.still) {
      between_.push_back(
          {std::make_unique<StandstillFactor>(standstill_), {a.pose.data(), b.pose.data(), b.motion.data()}});
    }
  }
}

void Terms::collect_seen_from(Unknowns& unknowns, const TrackTable& tracks, std::uint64_t frame) {
  std::vector<std::uint64_t> collected;
  for (const PointTerm& term : point_terms_) collected.push_back(term.id);
  std::sort(collected.begin(), collected.end());
  for (const Track& track : tracks) {
    if (track.observations.size() < kMinObservations || track.observations.front().frame != frame) continue;
    if (std::binary_search(collected.begin(), collected.end(), track.id)) continue;
    if (!add_point(unknowns, track)) continue;
    if (!fits(point_terms_.back())) point_terms_.pop_back();
  }
}

bool Terms::add_point(Unknowns& unknowns, const Track& track) {
  if (points_.find(track.id) == points_.end()) {
    const std::optional<InverseDepthPoint> point = triangulated(unknowns, track);
    if (!point) return false;
    points_[track.id] = {*point, to_block(*point)};
  }
  Point& point = points_[track.id];
  CalibrationBlocks& calibration = unknowns.calibration();
  double* const camera = calibration.camera.data();
  double* const imaging = calibration.imaging.data();
  PointTerm term;
  term.id = track.id;
  term.block = &point.block;
  for (const TrackObservation& o : track.observations) {
    Unknowns::Frame& frame = unknowns[unknowns.index_of(o.frame)];
    Observation seen{o.left, sigma_ * frame.feature_noise, frame.rate_B, frame.v_B, frame.time_offset};
    term.factors.push_back({std::make_unique<LeftFactor>(seen, point.anchor),
                            {frame.pose.data(), camera, imaging, point.block.data()},
                            &huber_});
    if (!o.has_right) continue;
    seen.uv = o.right;
    term.factors.push_back({std::make_unique<RightFactor>(seen, point.anchor),
                            {frame.pose.data(), camera, calibration.stereo.data(), imaging, point.block.data()},
                            &huber_});
  }
  point_terms_.push_back(std::move(term));
  return true;
}

/// Are the feature's observations, each weighed as in the sum, no further off than noise?
bool Terms::fits(const PointTerm& term) const {
  double sum = 0.0;
  for (const Factor& factor : term.factors) {
    Eigen::Vector2d r;
    if (!factor.cost->Evaluate(factor.blocks.data(), r.data(), nullptr)) return false;
    std::array<double, 3> rho{};
    factor.loss->Evaluate(r.squaredNorm(), rho.data());
    sum += rho[1] * r.squaredNorm();
  }
  const int freedom = 2 * static_cast<int>(term.factors.size()) - 3;
  return gate_.fits(sum, 1.0, freedom) && (*term.block)[2] > 0.0;
}

int Terms::drop_outliers(TrackTable& tracks) {
  std::vector<std::uint64_t> wrong;
  for (const PointTerm& term : point_terms_) {
    if (!fits(term)) wrong.push_back(term.id);
  }
  if (wrong.empty()) return 0;
  std::sort(wrong.begin(), wrong.end());
  const auto is_wrong = [&](std::uint64_t id) { return std::binary_search(wrong.begin(), wrong.end(), id); };
  point_terms_.erase(std::remove_if(point_terms_.begin(), point_terms_.end(),
                                    [&](const PointTerm& term) { return is_wrong(term.id); }),
                     point_terms_.end());
  tracks.keep_if([&](const Track& track) { return !is_wrong(track.id); });
  for (const std::uint64_t id : wrong) points_.erase(id);
  return static_cast<int>(wrong.size());
}

void Terms::clear() {
  between_.clear();
  point_terms_.clear();
}

void Terms::forget_points_without(const TrackTable& tracks) {
  for (auto point = points_.begin(); point != points_.end();) {
    const auto track = std::lower_bound(tracks.begin(), tracks.end(), point->first,
                                        [](const Track& t, std::uint64_t id) { return t.id < id; });
    const bool lives = track != tracks.end() && track->id == point->first;
    point = lives ? std::next(point) : points_.erase(point);
  }
}

}  // namespace ear::smoother
