// Window: which frame leaves, and what stays of what it told.
#include <algorithm>
#include <utility>

#include "smoother/wheel_chain.h"
#include "smoother/window.h"

namespace ear::smoother {
namespace {

constexpr double kLongestInterval = 0.5;  // [s] between frames kept, but for a vehicle that stands
constexpr double kLongestRest = 10.0;     // [s] for one that does

Interval joined(const Interval& first, const Interval& second) {
  Interval both = first;
  both.imu.append(second.imu);
  both.still = first.still && second.still;
  both.wheels.reset();
  if (first.wheels && second.wheels) both.wheels = chained(*first.wheels, *second.wheels);
  return both;
}

std::vector<const double*> touched_by(const std::vector<const Factor*>& factors,
                                      const std::vector<PointFactors>& points) {
  std::vector<const double*> touched;
  const auto add = [&](const Factor* factor) {
    touched.insert(touched.end(), factor->blocks.begin(), factor->blocks.end());
  };
  for (const Factor* factor : factors) add(factor);
  for (const PointFactors& point : points) std::for_each(point.factors.begin(), point.factors.end(), add);
  return touched;
}

}  // namespace

void Window::make_room() {
  if (frames_.size() > static_cast<std::size_t>(config_.window)) {
    const std::size_t leaving = frame_to_leave();
    if (leaving == 0) {
      marginalize_oldest();
    } else {
      skip_frame(leaving);
    }
  }
  forget_points_without_tracks();
}

/// As the filter does: the frame before the newest goes if it shows little that its elder does not, unless all of the
/// window shows one place. Here, also if it has no image, or the vehicle stands; and frames are kept close enough for
/// the inertial samples between them to be worth something.
std::size_t Window::frame_to_leave() const {
  const std::size_t n = frames_.size();
  const Interval& before = frames_[n - 2]->since;
  const Interval& after = frames_[n - 1]->since;
  const double joined = before.imu.duration() + after.imu.duration();
  if (before.still && after.still) return joined < kLongestRest ? n - 2 : 0;
  if (joined > kLongestInterval) return 0;
  if (!frames_[n - 2]->image) return n - 2;
  const bool copy = parallax_px(n - 3, n - 2) < config_.keyframe_parallax_px;
  return copy && !(parallax_px(0, n - 1) < config_.keyframe_parallax_px) ? n - 2 : 0;
}

/// What the oldest frame and all features that it saw tell of the others becomes part of the prior. These features'
/// later observations are used up with it: each observation counts once.
void Window::marginalize_oldest() {
  Frame& oldest = *frames_.front();
  collect_leaving_points(oldest.number);
  const auto seen_from_oldest = [&](const Factor& factor) { return factor.blocks.front() == oldest.pose.data(); };
  std::vector<const Factor*> factors = {&prior_};
  for (const Factor& factor : between_) {
    if (seen_from_oldest(factor)) factors.push_back(&factor);
  }
  std::vector<PointFactors> points;
  for (const PointTerm& term : point_terms_) {
    if (!std::any_of(term.factors.begin(), term.factors.end(), seen_from_oldest)) continue;
    PointFactors point;
    point.point = term.block->data();
    for (const Factor& factor : term.factors) point.factors.push_back(&factor);
    points.push_back(std::move(point));
  }
  const auto [removed, kept] = divided(touched_by(factors, points), oldest);
  set_prior(smoother::marginalize(factors, points, removed, kept));

  tracks_.keep_if([&](const Track& track) { return track.observations.front().frame != oldest.number; });
  erase_frame(0);
}

/// Of the blocks that are touched, those of the frame, and the others.
std::pair<std::vector<PriorBlock>, std::vector<PriorBlock>> Window::divided(const std::vector<const double*>& touched,
                                                                            const Frame& frame) const {
  std::vector<PriorBlock> removed, kept;
  for (const PriorBlock& block : blocks()) {
    if (block.block == frame.pose.data() || block.block == frame.motion.data()) {
      removed.push_back(block);
    } else if (std::find(touched.begin(), touched.end(), block.block) != touched.end()) {
      kept.push_back(block);
    }
  }
  return {removed, kept};
}

/// What it saw is forgotten; what moved the vehicle to it and on is one interval now.
void Window::skip_frame(std::size_t index) {
  Frame& frame = *frames_[index];
  Interval& after = frames_[index + 1]->since;
  after = joined(frame.since, after);
  const std::vector<double*>& known = prior_.blocks;
  if (std::find(known.begin(), known.end(), frame.pose.data()) != known.end()) {
    const auto [removed, kept] = divided(touched_by({&prior_}, {}), frame);
    set_prior(smoother::marginalize({&prior_}, {}, removed, kept));
  }
  tracks_.forget_frame(frame.number);
  erase_frame(index);
}

void Window::erase_frame(std::size_t index) {
  frames_.erase(frames_.begin() + static_cast<std::ptrdiff_t>(index));
  between_.clear();
  point_terms_.clear();
}

/// Nothing in place of a prior that is no number: the old one would name blocks that are gone. What follows from that
/// is seen in the covariance.
void Window::set_prior(std::unique_ptr<PriorFactor> prior) {
  if (!prior) {
    const std::vector<PriorBlock> nothing = {blocks().back()};
    prior = std::make_unique<PriorFactor>(nothing, Eigen::MatrixXd::Identity(6, 6), Eigen::VectorXd::Zero(6));
  }
  Factor factor;
  for (const PriorBlock& block : prior->blocks()) factor.blocks.push_back(block.block);
  factor.cost = std::move(prior);
  prior_ = std::move(factor);
}

void Window::forget_points_without_tracks() {
  tracks_.keep_if([](const Track& track) { return !track.observations.empty(); });
  for (auto point = points_.begin(); point != points_.end();) {
    const auto track = std::lower_bound(tracks_.begin(), tracks_.end(), point->first,
                                        [](const Track& t, std::uint64_t id) { return t.id < id; });
    const bool lives = track != tracks_.end() && track->id == point->first;
    point = lives ? std::next(point) : points_.erase(point);
  }
}

}  // namespace ear::smoother
