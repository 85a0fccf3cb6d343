// Window: the terms of (1) around the present values, and features that do not fit.
#include <algorithm>
#include <utility>

#include "smoother/feature_factor.h"
#include "smoother/imu_factor.h"
#include "smoother/standstill_factor.h"
#include "smoother/wheel_factor.h"
#include "smoother/window.h"

namespace ear::smoother {
namespace {

constexpr std::size_t kMostPoints = 80;      // features that are unknowns, those with most observations first
constexpr std::size_t kMinObservations = 2;  // frames that must have seen a feature

}  // namespace

/// All terms of (1) around the present values.
void Window::collect() {
  between_.clear();
  point_terms_.clear();
  points_used_.clear();
  collect_between();
  collect_points();
}

void Window::collect_between() {
  for (std::size_t j = 1; j < frames_.size(); ++j) {
    Frame& a = *frames_[j - 1];
    Frame& b = *frames_[j];
    const Interval& since = b.since;
    between_.push_back(
        {std::make_unique<ImuFactor>(since.imu), {a.pose.data(), a.motion.data(), b.pose.data(), b.motion.data()}});
    if (since.wheels) {
      const Eigen::Matrix3d covariance = since.wheels->covariance.topLeftCorner<3, 3>();
      between_.push_back({std::make_unique<WheelFactor>(*since.wheels, given_, covariance),
                          {a.pose.data(), a.motion.data(), b.pose.data(), wheels_.data()}});
    }
    if (since.still) {
      between_.push_back(
          {std::make_unique<StandstillFactor>(config_.standstill), {a.pose.data(), b.pose.data(), b.motion.data()}});
    }
  }
}

/// Features with most observations first.
void Window::collect_points() {
  std::vector<const Track*> chosen;
  for (const Track& track : tracks_) {
    if (track.observations.size() >= kMinObservations) chosen.push_back(&track);
  }
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const Track* a, const Track* b) { return a->observations.size() > b->observations.size(); });
  if (chosen.size() > kMostPoints) chosen.resize(kMostPoints);
  for (const Track* track : chosen) features_rejected_ += add_point(*track) ? 0 : 1;
}

/// Those that were too many to be unknowns, and lose their oldest frame now: with what they tell where they lie by the
/// present poses.
void Window::collect_leaving_points(std::uint64_t leaving) {
  std::vector<std::uint64_t> collected = points_used_;
  std::sort(collected.begin(), collected.end());
  for (const Track& track : tracks_) {
    if (track.observations.size() < kMinObservations || track.observations.front().frame != leaving) continue;
    if (std::binary_search(collected.begin(), collected.end(), track.id)) continue;
    if (!add_point(track)) continue;
    if (fits(point_terms_.back())) continue;
    point_terms_.pop_back();
    points_used_.pop_back();
  }
}

bool Window::add_point(const Track& track) {
  if (points_.find(track.id) == points_.end()) {
    const std::optional<InverseDepthPoint> point = triangulated(track);
    if (!point) return false;
    points_[track.id] = {*point, smoother::to_block(*point)};
  }
  Point& point = points_[track.id];
  PointTerm term;
  term.id = track.id;
  term.block = &point.block;
  for (const TrackObservation& o : track.observations) {
    Frame& frame = *frames_[index_of(o.frame)];
    Observation seen{o.left, sigma_ * frame.feature_noise, frame.rate_B, frame.v_B, frame.time_offset};
    term.factors.push_back({std::make_unique<LeftFactor>(seen, point.anchor),
                            {frame.pose.data(), camera_.data(), offset_.data(), point.block.data()},
                            &huber_});
    if (!o.has_right) continue;
    seen.uv = o.right;
    term.factors.push_back({std::make_unique<RightFactor>(seen, point.anchor),
                            {frame.pose.data(), camera_.data(), stereo_.data(), offset_.data(), point.block.data()},
                            &huber_});
  }
  points_used_.push_back(track.id);
  point_terms_.push_back(std::move(term));
  return true;
}

std::optional<InverseDepthPoint> Window::triangulated(const Track& track) const {
  const CameraState camera = cameras();
  std::vector<Sighting> sightings;
  for (const TrackObservation& o : track.observations) {
    const Pose T_WB = pose(index_of(o.frame));
    const Eigen::Matrix3d R_WC0 = T_WB.R * camera.T_BC0.R;
    const Eigen::Vector3d p_WC0 = T_WB.p + T_WB.R * camera.T_BC0.p;
    sightings.push_back({R_WC0.transpose(), p_WC0, o.left});
    if (!o.has_right) continue;
    sightings.push_back({(R_WC0 * camera.T_C0C1.R).transpose(), p_WC0 + R_WC0 * camera.T_C0C1.p, o.right});
  }
  return triangulate(sightings);
}

/// Are the feature's observations, each weighed as in the sum, no further off than noise?
bool Window::fits(const PointTerm& term) const {
  double sum = 0.0;
  for (const Factor& factor : term.factors) {
    Eigen::Vector2d r;
    if (!factor.cost->Evaluate(factor.blocks.data(), r.data(), nullptr)) return false;
    double rho[3];
    factor.loss->Evaluate(r.squaredNorm(), rho);
    sum += rho[1] * r.squaredNorm();
  }
  const int freedom = 2 * static_cast<int>(term.factors.size()) - 3;
  return gate_.fits_distance(sum, freedom) && (*term.block)[2] > 0.0;
}

/// Features that do not fit are used no more.
void Window::drop_outliers() {
  std::vector<std::uint64_t> wrong;
  for (const PointTerm& term : point_terms_) {
    if (!fits(term)) wrong.push_back(term.id);
  }
  if (wrong.empty()) return;
  std::sort(wrong.begin(), wrong.end());
  const auto is_wrong = [&](std::uint64_t id) { return std::binary_search(wrong.begin(), wrong.end(), id); };
  point_terms_.erase(std::remove_if(point_terms_.begin(), point_terms_.end(),
                                    [&](const PointTerm& term) { return is_wrong(term.id); }),
                     point_terms_.end());
  points_used_.erase(std::remove_if(points_used_.begin(), points_used_.end(), is_wrong), points_used_.end());
  tracks_.keep_if([&](const Track& track) { return !is_wrong(track.id); });
  for (const std::uint64_t id : wrong) points_.erase(id);
  features_rejected_ += static_cast<int>(wrong.size());
}

}  // namespace ear::smoother
