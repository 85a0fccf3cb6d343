#include "tools/evaluation/evaluate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace ear::evaluation {
namespace {

constexpr double kLengthStep = 0.1;                                // [m] of distance_travelled()
constexpr std::array<double, 4> kDistances{1.0, 5.0, 10.0, 20.0};  // [m] of RelativeError
constexpr double kLongestStretch = 1.5;                            // times the distance: longer ones have a gap

Eigen::Isometry3d isometry(const Pose& pose) { return Eigen::Translation3d(pose.p_WB) * pose.q_WB; }

Pose moved(const Eigen::Isometry3d& T, const Pose& pose) {
  return {pose.t_ns, Eigen::Quaterniond(T.linear()) * pose.q_WB, T * pose.p_WB};
}

/// Rotation vector of the shorter way, |result| <= pi [rad].
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd turn(q);
  return turn.angle() * turn.axis();
}

double root_mean(const std::vector<Frame>& frames, const std::function<double(const Frame&)>& squared) {
  const double sum = std::accumulate(frames.begin(), frames.end(), 0.0,
                                     [&](double total, const Frame& frame) { return total + squared(frame); });
  return std::sqrt(sum / static_cast<double>(frames.size()));
}

std::string seconds_text(TimeNs t_ns) { return std::to_string(1e-9 * static_cast<double>(t_ns)) + " s"; }

void require_overlap(const Association& association, const Estimate& estimate, const Trajectory& truth) {
  if (association.matches.size() >= 2) return;
  throw std::runtime_error("estimate '" + estimate.name + "' (" + seconds_text(estimate.poses.front().t_ns) + " to " +
                           seconds_text(estimate.poses.back().t_ns) + ") and truth (" +
                           seconds_text(truth.front().t_ns) + " to " + seconds_text(truth.back().t_ns) + ") share " +
                           std::to_string(association.matches.size()) + " poses: at least 2 are needed");
}

/// e^T P^-1 e, or nothing if P is not positive definite.
std::optional<double> normalized_square(const Eigen::Vector3d& e, const Eigen::Matrix3d& P) {
  const Eigen::LLT<Eigen::Matrix3d> llt(P);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return llt.matrixL().solve(e).squaredNorm();
}

Trajectory truths_of(const Association& association) {
  Trajectory truths;
  for (const Match& match : association.matches) truths.push_back(match.truth);
  return truths;
}

Trajectory estimates_of(const Association& association, const Estimate& estimate) {
  Trajectory poses;
  for (const Match& match : association.matches) poses.push_back(estimate.poses[match.index]);
  return poses;
}

Eigen::Vector3d unknown_vector() { return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()); }

/// `T_TE` aligns all poses, `T_ET_start` moves the truth into the estimate's world by the first pose alone.
Frame compare(const Match& match, const Pose& estimated, const Eigen::Isometry3d& T_TE,
              const Eigen::Isometry3d& T_ET_start, bool has_attitude) {
  Frame frame;
  frame.match = match;
  frame.aligned = moved(T_TE, estimated);
  const Pose truth_E = moved(T_ET_start, match.truth);
  frame.position_error = truth_E.p_WB - estimated.p_WB;
  frame.rotation_error = has_attitude ? rotation_vector(truth_E.q_WB * estimated.q_WB.conjugate()) : unknown_vector();
  return frame;
}

/// The first frame is left out: aligned to the truth, it has no error whatever its covariance says.
void add_nees(const std::vector<PoseCovariance>& covariance, bool has_attitude, std::vector<Frame>& frames) {
  for (std::size_t i = 1; i < frames.size(); ++i) {
    Frame& frame = frames[i];
    const PoseCovariance& P = covariance[frame.match.index];
    frame.nees_position = normalized_square(frame.position_error, P.topLeftCorner<3, 3>());
    if (!has_attitude) continue;
    frame.nees_orientation = normalized_square(frame.rotation_error, P.bottomRightCorner<3, 3>());
    if (frame.nees_position && frame.nees_orientation) continue;
    frame.nees_position.reset();
    frame.nees_orientation.reset();
  }
}

Consistency consistency(const std::vector<double>& values) {
  if (values.empty()) return {};
  const auto count = static_cast<double>(values.size());
  const auto inside =
      std::count_if(values.begin(), values.end(), [](double value) { return value >= kNeesLow && value <= kNeesHigh; });
  return {std::accumulate(values.begin(), values.end(), 0.0) / count, static_cast<double>(inside) / count};
}

Nees summarize_nees(const std::vector<Frame>& frames) {
  std::vector<double> position;
  std::vector<double> orientation;
  for (const Frame& frame : frames) {
    if (!frame.nees_position) continue;
    position.push_back(*frame.nees_position);
    if (frame.nees_orientation) orientation.push_back(*frame.nees_orientation);
  }
  return {position.size(), frames.size() - 1 - position.size(), consistency(position), consistency(orientation)};
}

/// Error of the motion between two frames: what it misses of the true motion.
Eigen::Isometry3d motion_error(const Frame& from, const Frame& to) {
  const Eigen::Isometry3d truth = isometry(from.match.truth).inverse() * isometry(to.match.truth);
  const Eigen::Isometry3d estimated = isometry(from.aligned).inverse() * isometry(to.aligned);
  return truth.inverse() * estimated;
}

std::optional<RelativeError> relative_error(const std::vector<Frame>& frames, double distance) {
  RelativeError result;
  result.distance = distance;
  for (std::size_t i = 0, j = 0; i < frames.size(); ++i) {
    while (j < frames.size() && frames[j].distance - frames[i].distance < distance) ++j;
    if (j == frames.size()) break;
    const double travelled = frames[j].distance - frames[i].distance;
    if (travelled > kLongestStretch * distance) continue;
    const Eigen::Isometry3d error = motion_error(frames[i], frames[j]);
    result.translation += error.translation().norm() / travelled;
    result.rotation += Eigen::AngleAxisd(error.linear()).angle() / travelled;
    ++result.stretches;
  }
  if (result.stretches == 0) return std::nullopt;
  result.translation /= static_cast<double>(result.stretches);
  result.rotation /= static_cast<double>(result.stretches);
  return result;
}

StartToEnd start_to_end(const std::vector<Frame>& frames) {
  const Frame& first = frames.front();
  const Frame& last = frames.back();
  StartToEnd result;
  result.error = last.position_error.norm();
  result.estimated = (last.aligned.p_WB - first.aligned.p_WB).norm();
  result.truth = (last.match.truth.p_WB - first.match.truth.p_WB).norm();
  result.difference = std::abs(result.estimated - result.truth);
  return result;
}

/// The frames whose ground the truth knows.
std::vector<TerrainComparison> compare_terrain(const std::vector<Frame>& frames, const Estimate& estimate,
                                               const std::vector<TerrainTruth>& terrain) {
  std::vector<TerrainComparison> result;
  for (const Frame& frame : frames) {
    const std::optional<TerrainTruth> truth = terrain_at(terrain, frame.match.truth.t_ns);
    if (!truth) continue;
    TerrainComparison comparison{*truth, std::nullopt, frame.match.truth.p_WB.z() - frame.aligned.p_WB.z()};
    if (!estimate.terrain.empty()) comparison.estimate = estimate.terrain[frame.match.index];
    result.push_back(comparison);
  }
  return result;
}

/// Moves the truth into the estimate's world by the first matched pose; a truth without attitudes has its yaw from
/// T_TE.
Eigen::Isometry3d first_pose_alignment(AlignmentKind kind, const Pose& estimated, const Match& first,
                                       const Eigen::Isometry3d& T_TE, bool has_attitude) {
  if (!has_attitude) return around_centre(T_TE.linear(), {estimated}, {first.truth}).inverse();
  return align_pose(kind, estimated, first.truth).inverse();
}

/// All frames with their errors. `distances`: along the truth, at each match [m].
std::vector<Frame> compare_all(const Association& association, const Estimate& estimate, const Truth& truth,
                               const std::vector<double>& distances, const Eigen::Isometry3d& T_TE,
                               AlignmentKind kind) {
  // An estimate with covariance is one that knows gravity: its tilt at the start is an error, not a choice of axes.
  const AlignmentKind start_kind = estimate.covariance.empty() ? kind : AlignmentKind::yaw;
  const Match& first = association.matches.front();
  const Eigen::Isometry3d T_ET_start =
      first_pose_alignment(start_kind, estimate.poses[first.index], first, T_TE, truth.has_attitude);

  std::vector<Frame> frames;
  for (const Match& match : association.matches) {
    frames.push_back(compare(match, estimate.poses[match.index], T_TE, T_ET_start, truth.has_attitude));
    frames.back().distance = distances[frames.size() - 1];
  }
  if (!estimate.covariance.empty()) add_nees(estimate.covariance, truth.has_attitude, frames);
  return frames;
}

/// Fills every figure that follows from the frames.
void summarize(Evaluation& result) {
  const std::vector<Frame>& frames = result.frames;
  const auto error = [](const Frame& frame) -> Eigen::Vector3d { return frame.match.truth.p_WB - frame.aligned.p_WB; };

  result.duration = seconds_between(frames.front().match.truth.t_ns, frames.back().match.truth.t_ns);
  result.length = frames.back().distance - frames.front().distance;
  result.position_rmse = root_mean(frames, [&](const Frame& frame) { return error(frame).squaredNorm(); });
  result.z_rmse = root_mean(frames, [&](const Frame& frame) { return std::pow(error(frame).z(), 2); });
  for (const Frame& frame : frames) result.position_max = std::max(result.position_max, error(frame).norm());
  if (result.length >= kLengthStep) result.position_ratio = result.position_rmse / result.length;
  result.start_to_end = start_to_end(frames);
  if (!result.truth_has_attitude) return;
  result.rotation_rmse = root_mean(frames, [](const Frame& frame) {
    return std::pow(frame.match.truth.q_WB.angularDistance(frame.aligned.q_WB), 2);
  });
  for (const double distance : kDistances)
    if (const auto relative = relative_error(frames, distance)) result.relative.push_back(*relative);
}

}  // namespace

std::vector<double> distance_travelled(const Trajectory& truth, const Trajectory& at, double shortest) {
  std::vector<double> distances;
  distances.reserve(at.size());
  Eigen::Vector3d last_step = truth.front().p_WB;
  double steps = 0.0;
  double reached = 0.0;  // never less than before: swaying within one step is no way back
  std::size_t next = 1;
  for (const Pose& pose : at) {
    for (; next < truth.size() && truth[next].t_ns <= pose.t_ns; ++next) {
      const double step = (truth[next].p_WB - last_step).norm();
      if (step < shortest) continue;
      steps += step;
      last_step = truth[next].p_WB;
    }
    reached = std::max(reached, steps + (pose.p_WB - last_step).norm());
    distances.push_back(reached);
  }
  return distances;
}

Evaluation evaluate(const Estimate& estimate, const Trajectory& truth, AlignmentKind kind,
                    const std::vector<TerrainTruth>& terrain) {
  return evaluate(estimate, Truth{truth}, kind, terrain);
}

Evaluation evaluate(const Estimate& estimate, const Truth& truth, AlignmentKind kind,
                    const std::vector<TerrainTruth>& terrain) {
  const Association association = associate(estimate.poses, truth.poses);
  require_overlap(association, estimate, truth.poses);
  const Trajectory truths = truths_of(association);
  const Alignment alignment = align(kind, estimates_of(association, estimate), truths, truth.has_attitude);
  const std::vector<double> distances = distance_travelled(truth.poses, truths, std::max(kLengthStep, truth.error));

  Evaluation result;
  result.name = estimate.name;
  result.kind = kind;
  result.truth_has_attitude = truth.has_attitude;
  result.rotation_from_attitude = alignment.rotation_from_attitude;
  result.poses = estimate.poses.size();
  result.matched = association.matches.size();
  result.outside = association.outside;
  result.in_gaps = association.in_gaps;
  result.coverage = coverage(estimate.poses, truth.poses);
  result.frames = compare_all(association, estimate, truth, distances, alignment.T_TE, kind);
  summarize(result);
  if (!estimate.covariance.empty()) result.nees = summarize_nees(result.frames);
  if (!estimate.health.empty()) result.false_tracking = false_tracking(estimate, truth, association, distances);
  if (!terrain.empty()) result.terrain = terrain_figures(compare_terrain(result.frames, estimate, terrain));
  return result;
}

}  // namespace ear::evaluation
