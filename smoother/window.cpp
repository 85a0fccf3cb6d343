#include "smoother/window.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "smoother/minimum.h"
#include "smoother/normal_equations.h"
#include "smoother/wheel_chain.h"

namespace ear::smoother {
namespace {

// Standard deviations that nothing is known better than at the start: position [m], rotation [rad], calibration.
constexpr double kLeastPosition = 1e-4;
constexpr double kLeastRotation = 1e-5;
constexpr double kLeastCalibration = 1e-7;
constexpr int kCalibrationSteps = 25;

constexpr double kLongestInterval = 0.5;  // [s] between frames kept, but for a vehicle that stands
constexpr double kLongestRest = 10.0;     // [s] for one that does

/// Of the filter's covariance what the window has unknowns for.
Eigen::MatrixXd start_covariance(const Eigen::MatrixXd& P) {
  const std::vector<int> entries = filter_entries();
  Eigen::MatrixXd P_start = P(entries, entries);
  P_start.diagonal().head<3>().array() += kLeastRotation * kLeastRotation;
  P_start.diagonal().segment<3>(3).array() += kLeastPosition * kLeastPosition;
  P_start.diagonal().tail<kCalibrationSteps>().array() += kLeastCalibration * kLeastCalibration;
  return P_start;
}

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

/// What the factors and points show of all that they touch, the frame eliminated. Nothing if it is not finite.
std::unique_ptr<PriorFactor> without(const Unknowns::Frame& frame, const std::vector<PriorBlock>& blocks,
                                     const std::vector<const Factor*>& factors,
                                     const std::vector<PointFactors>& points) {
  const std::vector<const double*> touched = touched_by(factors, points);
  std::vector<PriorBlock> removed, kept;
  for (const PriorBlock& block : blocks) {
    if (block.block == frame.pose.data() || block.block == frame.motion.data()) {
      removed.push_back(block);
    } else if (std::find(touched.begin(), touched.end(), block.block) != touched.end()) {
      kept.push_back(block);
    }
  }
  return marginalize(factors, points, removed, kept);
}

}  // namespace

Window::Window(const FilterConfig& config, double focal_px, const State& x, const Eigen::Ref<const Eigen::MatrixXd>& P)
    : config_(config), focal_px_(focal_px), unknowns_(x), terms_(config, focal_px) {
  const Eigen::MatrixXd P_start = start_covariance(P);
  const Eigen::MatrixXd whitening =
      P_start.llt().matrixL().solve(Eigen::MatrixXd::Identity(P_start.rows(), P_start.cols()));
  set_prior(std::make_unique<PriorFactor>(unknowns_.blocks(), whitening, Eigen::VectorXd::Zero(P_start.rows())));
}

void Window::add(const NewFrame& frame, const std::vector<FeatureObservation>& features) {
  tracks_.add(unknowns_.append(frame, !features.empty()), features);
}

bool Window::optimize() {
  features_rejected_ = terms_.collect(unknowns_, tracks_);
  if (!minimise(prior_, terms_, unknowns_)) return false;
  features_rejected_ += terms_.drop_outliers(tracks_);
  return true;
}

std::optional<Eigen::MatrixXd> Window::covariance() const { return newest_covariance(prior_, terms_, unknowns_); }

void Window::make_room() {
  if (size() > static_cast<std::size_t>(config_.window)) {
    const std::size_t index = frame_to_drop();
    if (index == 0) {
      marginalize_oldest();
    } else {
      drop_frame(index);
    }
  }
  tracks_.keep_if([](const Track& track) { return !track.observations.empty(); });
  terms_.forget_points_without(tracks_);
}

void Window::forget_wheels(double duration) {
  double passed = 0.0;
  for (std::size_t i = size(); i-- > 1 && passed < duration;) {
    passed += unknowns_[i].since.imu.duration();
    unknowns_[i].since.wheels.reset();
  }
}

State Window::newest() const {
  State x;
  x.imu = unknowns_.newest();
  x.camera = unknowns_.cameras();
  x.odometer = unknowns_.odometer();
  return x;
}

/// As the filter does: the frame before the newest goes if it shows little that the one before it does not, unless all
/// of the window shows one place. Here, also if it has no image, or the vehicle stands; and frames are kept close
/// enough for the inertial samples between them to be worth something. Otherwise 0, the oldest.
std::size_t Window::frame_to_drop() {
  const std::size_t n = size();
  const Interval& before = unknowns_[n - 2].since;
  const Interval& after = unknowns_[n - 1].since;
  const double joined = before.imu.duration() + after.imu.duration();
  if (before.still && after.still) return joined < kLongestRest ? n - 2 : 0;
  if (joined > kLongestInterval) return 0;
  if (!unknowns_[n - 2].image) return n - 2;
  const bool copy = parallax_px(n - 3, n - 2) < config_.keyframe_parallax_px;
  return copy && !(parallax_px(0, n - 1) < config_.keyframe_parallax_px) ? n - 2 : 0;
}

double Window::parallax_px(std::size_t from, std::size_t to) const {
  const Eigen::Matrix3d R_BC0 = unknowns_.cameras().T_BC0.R;
  const FrameRotation a{unknowns_[from].number, unknowns_.pose(from).R * R_BC0};
  const FrameRotation b{unknowns_[to].number, unknowns_.pose(to).R * R_BC0};
  return focal_px_ * tracks_.median_parallax(a, b);
}

/// What the oldest frame and all features that it saw show of the others becomes part of the prior. These features'
/// later observations are used up with it: each observation counts once.
void Window::marginalize_oldest() {
  const Unknowns::Frame& oldest = unknowns_[0];
  terms_.collect_seen_from(unknowns_, tracks_, oldest.number);
  const auto seen_from_oldest = [&](const Factor& factor) { return factor.blocks.front() == oldest.pose.data(); };
  std::vector<const Factor*> factors = {&prior_};
  for (const Factor& factor : terms_.between()) {
    if (seen_from_oldest(factor)) factors.push_back(&factor);
  }
  std::vector<PointFactors> points;
  for (const PointTerm& term : terms_.points()) {
    if (!std::any_of(term.factors.begin(), term.factors.end(), seen_from_oldest)) continue;
    PointFactors point;
    point.point = term.block->data();
    for (const Factor& factor : term.factors) point.factors.push_back(&factor);
    points.push_back(std::move(point));
  }
  set_prior(without(oldest, unknowns_.blocks(), factors, points));
  const std::uint64_t number = oldest.number;
  tracks_.keep_if([&](const Track& track) { return track.observations.front().frame != number; });
  unknowns_.erase(0);
  terms_.clear();
}

/// What it saw is forgotten; what moved the vehicle to it and on is one interval now.
void Window::drop_frame(std::size_t index) {
  const Unknowns::Frame& frame = unknowns_[index];
  Interval& after = unknowns_[index + 1].since;
  after = joined(frame.since, after);
  const std::vector<double*>& known = prior_.blocks;
  if (std::find(known.begin(), known.end(), frame.pose.data()) != known.end()) {
    set_prior(without(frame, unknowns_.blocks(), {&prior_}, {}));
  }
  tracks_.forget_frame(frame.number);
  unknowns_.erase(index);
  terms_.clear();
}

/// Nothing in place of a prior that is no number: the old one would name blocks that are gone. What follows from that
/// is seen in the covariance.
void Window::set_prior(std::unique_ptr<PriorFactor> prior) {
  if (!prior) {
    const std::vector<PriorBlock> nothing = {unknowns_.blocks().back()};
    prior = std::make_unique<PriorFactor>(nothing, Eigen::MatrixXd::Identity(6, 6), Eigen::VectorXd::Zero(6));
  }
  Factor factor;
  for (const PriorBlock& block : prior->blocks()) factor.blocks.push_back(block.block);
  factor.cost = std::move(prior);
  prior_ = std::move(factor);
}

}  // namespace ear::smoother
