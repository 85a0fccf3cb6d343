#include "tools/evaluation/false_tracking.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "tools/evaluation/alignment.h"

namespace ear::evaluation {
namespace {

constexpr TimeNs kStart = 2'000'000'000;        // [ns] averages the truth's noise, and is too short for a drift
constexpr double kMostSigmas = 5.0;             // an honest covariance is exceeded so far once in 65 000 times
constexpr double kMostOfLength = 0.05;          // of the path: whoever drifts faster has lost a sensor or a scale
constexpr TimeNs kShortest = 1'000'000'000;     // [ns] a shorter one may be the truth's: a marker lost, a late stamp
constexpr std::string_view kWord = "tracking";  // the health's first; the load step may follow

/// One matched pose.
struct Judgement {
  TimeNs t_ns = 0;
  int segment = 0;
  bool tracking = false;
  double error = 0.0;      ///< [m]
  double travelled = 0.0;  ///< since the start [m]
  double sigmas = 0.0;     ///< the error in standard deviations
  bool far_off = false;
};

/// What the yaw between the worlds does to a position: its covariance.
Eigen::Matrix3d covariance_of_yaw(const StartAlignment& start, const Eigen::Vector3d& p_E) {
  const Eigen::Vector3d lever = start.sigma_yaw * Eigen::Vector3d::UnitZ().cross(p_E - start.p_E);
  return lever * lever.transpose();
}

/// Mahalanobis distance: how many standard deviations, in the direction in which these are the most.
double standard_deviations(const Eigen::Vector3d& e, const Eigen::Matrix3d& P) {
  return std::sqrt(std::max(0.0, e.dot(P.ldlt().solve(e))));
}

std::vector<Judgement> judge(const Estimate& estimate, const Truth& truth, const Association& association,
                             const std::vector<double>& distances) {
  const StartAlignment start = align_start(estimate, truth, association);
  const Eigen::Isometry3d T_ET = start.T_TE.inverse();
  // So that an error that may be the truth's own is never more than kMostSigmas of them.
  const Eigen::Matrix3d P_truth = std::pow(truth.error / kMostSigmas, 2) * Eigen::Matrix3d::Identity();

  std::vector<Judgement> judgements;
  judgements.reserve(association.matches.size());
  for (const Match& match : association.matches) {
    const Eigen::Vector3d& p_E = estimate.poses[match.index].p_WB;
    const Eigen::Vector3d e = T_ET * match.truth.p_WB - p_E;
    Judgement judgement;
    judgement.t_ns = match.truth.t_ns;
    judgement.segment = match.segment;
    judgement.tracking = estimate.health[match.index].compare(0, kWord.size(), kWord) == 0;
    judgement.error = e.norm();
    judgement.travelled = distances[judgements.size()] - distances.front();
    if (!estimate.covariance.empty()) {
      const PoseCovariance& P = estimate.covariance[match.index];
      judgement.sigmas = standard_deviations(e, P.topLeftCorner<3, 3>() + P_truth + covariance_of_yaw(start, p_E));
    }
    judgement.far_off =
        judgement.error > std::max(truth.error, kMostOfLength * judgement.travelled) || judgement.sigmas > kMostSigmas;
    judgements.push_back(judgement);
  }
  return judgements;
}

/// The judgements from `first` to `last`, both included. What the health says holds until the next judgement.
FarOff stretch(const std::vector<Judgement>& judgements, std::size_t first, std::size_t last) {
  FarOff result{judgements[first].t_ns, judgements[last].t_ns};
  for (std::size_t i = first; i <= last; ++i) {
    const Judgement& judgement = judgements[i];
    if (i < last && judgement.tracking) result.tracking += seconds_between(judgement.t_ns, judgements[i + 1].t_ns);
    result.most_sigmas = std::max(result.most_sigmas, judgement.sigmas);
    if (judgement.error <= result.largest_error) continue;
    result.largest_error = judgement.error;
    result.travelled = judgement.travelled;
  }
  return result;
}

/// The last of the judgements that are far off together with `first`.
std::size_t end_of_stretch(const std::vector<Judgement>& judgements, std::size_t first) {
  std::size_t last = first;
  while (last + 1 < judgements.size() && judgements[last + 1].far_off &&
         judgements[last + 1].segment == judgements[first].segment)
    ++last;
  return last;
}

double scatter(const Trajectory& estimate, const Trajectory& truth, const Eigen::Matrix3d& R_TE) {
  double sum = 0.0;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Eigen::Matrix3d R = R_TE.transpose() * yaw_from_attitudes({estimate[i]}, {truth[i]});
    sum += std::pow(std::atan2(R(1, 0), R(0, 0)), 2);
  }
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

}  // namespace

StartAlignment align_start(const Estimate& estimate, const Truth& truth, const Association& association) {
  Trajectory estimated;
  Trajectory truths;
  std::size_t at_start = 0;
  for (const Match& match : association.matches) {
    estimated.push_back(estimate.poses[match.index]);
    truths.push_back(match.truth);
    if (match.truth.t_ns - truths.front().t_ns <= kStart) ++at_start;
  }
  StartAlignment result;
  Eigen::Matrix3d R_TE = yaw_from_positions(estimated, truths);
  estimated.resize(at_start);
  truths.resize(at_start);
  if (truth.has_attitude) {
    R_TE = yaw_from_attitudes(estimated, truths);
    result.sigma_yaw = scatter(estimated, truths, R_TE);
  }
  result.T_TE = around_centre(R_TE, estimated, truths);
  result.p_E = estimated.front().p_WB;
  return result;
}

FalseTracking false_tracking(const Estimate& estimate, const Truth& truth, const Association& association,
                             const std::vector<double>& distances) {
  const std::vector<Judgement> judgements = judge(estimate, truth, association, distances);
  FalseTracking result;
  const double known = known_time(truth.poses);
  if (known == 0.0) return result;
  for (std::size_t first = 0; first < judgements.size(); ++first) {
    if (!judgements[first].far_off) continue;
    const std::size_t last = end_of_stretch(judgements, first);
    if (judgements[last].t_ns - judgements[first].t_ns >= kShortest) {
      result.stretches.push_back(stretch(judgements, first, last));
      result.share += result.stretches.back().tracking / known;
      result.far_off += seconds_between(judgements[first].t_ns, judgements[last].t_ns) / known;
    }
    first = last;
  }
  return result;
}

}  // namespace ear::evaluation
