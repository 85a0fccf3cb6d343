#include "frontend/flow_check.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "frontend/motion_of_flows.h"

namespace ear {
namespace {

constexpr std::size_t kMinFlows = 8;   // fewer show no common motion
constexpr std::size_t kMinDepths = 8;  // to measure the translation with its length
constexpr int kMaxTrials = 60;
constexpr double kConfidence = 0.999;
constexpr double kGoodGuess = 0.8;          // share of inliers at which a known motion needs no search
constexpr double kUnknownDepthSigma = 3.0;  // [1/m] a feature without depth may be anywhere beyond 0.2 m or so
constexpr int kSteps = 5;                   // from a guess
constexpr int kRefinements = 3;
constexpr double kSettled = 0.03;  // times the tolerance: a step that moves no flow further is the last
constexpr double kStill = 0.5;     // times the tolerance: a smaller flow is none
constexpr double kMoved = 3.0;     // times the tolerance: so far off the known motion is more than its error

using Flags = std::vector<std::uint8_t>;

std::size_t count(const Flags& flags) {
  return static_cast<std::size_t>(std::count(flags.begin(), flags.end(), std::uint8_t{1}));
}

// Squared distance between where a static feature would be and where it is; free along the line on which the
// uncertain depth moves it.
double squared_distance(const Flow& flow, const Transfer& motion, double depth_sigma_unknown) {
  const double sigma = flow.has_depth ? flow.inverse_depth_sigma : depth_sigma_unknown;
  const Eigen::Vector3d point = motion.scaled_point(flow.x0, flow.has_depth ? flow.inverse_depth0 : 0.0);
  if (!(point.z() > 1e-3)) return std::numeric_limits<double>::infinity();
  const Eigen::Vector2d at = point.head<2>() / point.z();
  const Eigen::Vector2d error = flow.x1 - at;
  const Eigen::Vector2d along = sigma * (motion.p_10.head<2>() - at * motion.p_10.z()) / point.z();
  const double projection = along.dot(error);
  // The error's variance is the unit of distance plus `along along^T`; the unit is small against it where it matters.
  constexpr double kUnit = 1e-6;  // (0.4 px)^2 at 400 px focal length
  return error.squaredNorm() - projection * projection / (kUnit + along.squaredNorm());
}

// Does it stay where it is in the image, although the known motion would have moved it, at whatever depth? Then it is a
// fixed pattern of the sensor, dirt on the lens, or a part of the vehicle.
bool moves_with_camera(const Flow& flow, const MotionGuess& guess, double tolerance) {
  if (!guess.translation_known || (flow.x1 - flow.x0).norm() > kStill * tolerance) return false;
  Flow anywhere = flow;
  anywhere.has_depth = false;
  return squared_distance(anywhere, guess.motion, kUnknownDepthSigma) > std::pow(kMoved * tolerance, 2);
}

void drop_fixed(const std::vector<Flow>& flows, const MotionGuess& guess, double tolerance, Flags& flags) {
  for (std::size_t i = 0; i < flows.size(); ++i) {
    if (moves_with_camera(flows[i], guess, tolerance)) flags[i] = 0;
  }
}

// Everything that is fixed during one check.
struct Problem {
  const std::vector<Flow>& flows;
  double tolerance;
  double depth_sigma_unknown = kUnknownDepthSigma;

  void classify(const Transfer& motion, Flags& flags) const {
    flags.resize(flows.size());
    std::transform(flows.begin(), flows.end(), flags.begin(), [&](const Flow& flow) {
      return std::uint8_t{squared_distance(flow, motion, depth_sigma_unknown) < tolerance * tolerance};
    });
  }
};

// Distinct random members of `from`.
template <std::size_t n>
std::array<std::size_t, n> draw(const std::vector<std::size_t>& from, std::mt19937& random) {
  std::array<std::size_t, n> drawn{};
  for (std::size_t k = 0; k < n; ++k) {
    do {
      // Not a standard distribution: those differ between standard libraries.
      drawn[k] = from[random() % from.size()];
    } while (std::find(drawn.begin(), drawn.begin() + static_cast<std::ptrdiff_t>(k), drawn[k]) !=
             drawn.begin() + static_cast<std::ptrdiff_t>(k));
  }
  return drawn;
}

int trials_needed(std::size_t inliers, std::size_t all, std::size_t sample_size) {
  const double share = static_cast<double>(inliers) / static_cast<double>(all);
  const double good = std::pow(share, static_cast<double>(sample_size));
  if (good > 1.0 - 1e-9) return 1;
  if (good < 1e-9) return kMaxTrials;
  return std::min(kMaxTrials, static_cast<int>(std::ceil(std::log(1.0 - kConfidence) / std::log(1.0 - good))));
}

struct Candidate {
  Transfer motion;
  Flags& flags;
  std::size_t inliers = 0;
};

// Draws samples, lets `solve` turn each into a motion, keeps the one with most inliers.
template <std::size_t n, class Solve>
void search(const Problem& problem, const std::vector<std::size_t>& from, std::mt19937& random, Solve&& solve,
            Candidate& best, Flags& trial_flags) {
  int trials = kMaxTrials;
  for (int trial = 0; trial < trials; ++trial) {
    const std::optional<Transfer> motion = solve(draw<n>(from, random));
    if (!motion) continue;
    problem.classify(*motion, trial_flags);
    const std::size_t inliers = count(trial_flags);
    if (inliers <= best.inliers) continue;
    best.motion = *motion;
    best.flags.swap(trial_flags);
    best.inliers = inliers;
    trials = std::min(trials, trials_needed(inliers, problem.flows.size(), n));
  }
}

// Takes this motion in place of the best one if as many flows agree with it.
void prefer(const Problem& problem, const std::optional<Transfer>& refined, Candidate& best, Flags& trial_flags) {
  if (!refined) return;
  problem.classify(*refined, trial_flags);
  const std::size_t inliers = count(trial_flags);
  if (inliers < best.inliers) return;
  best.motion = *refined;
  best.flags.swap(trial_flags);
  best.inliers = inliers;
}

}  // namespace

void FlowCheck::reserve(std::size_t flows) {
  result_.inliers.reserve(flows);
  trial_.reserve(flows);
  used_.reserve(flows);
  indices_.reserve(flows);
}

const Consensus& FlowCheck::find(const std::vector<Flow>& flows, const MotionGuess& guess) {
  result_.motion = guess.motion;
  result_.metric = false;
  find_into(flows, guess);
  return result_;
}

void FlowCheck::find_into(const std::vector<Flow>& flows, const MotionGuess& guess) {
  Flags& flags = result_.inliers;
  if (flows.size() < kMinFlows) {
    flags.assign(flows.size(), std::uint8_t{guess.rotation_known});
    return drop_fixed(flows, guess, tolerance_, flags);
  }
  std::vector<std::size_t>& with_depth = indices_;
  with_depth.clear();
  for (std::size_t i = 0; i < flows.size(); ++i) {
    if (flows[i].has_depth) with_depth.push_back(i);
  }
  const bool metric = with_depth.size() >= kMinDepths;

  Problem problem{flows, tolerance_};
  Candidate best{guess.motion, flags};
  problem.classify(best.motion, best.flags);
  best.inliers = count(best.flags);
  const auto enough = [&](std::size_t inliers) {
    return static_cast<double>(inliers) >= kGoodGuess * static_cast<double>(flows.size());
  };
  const bool search_needed = !enough(best.inliers);
  const auto flagged = [&](const auto& sample) -> const Flags& {
    used_.assign(flows.size(), 0);
    for (const std::size_t i : sample) used_[i] = 1;
    return used_;
  };

  // The known turn, with the translation that two flows show by `solve`.
  const auto with_turn = [&](auto* solve) {
    return [&, solve](const std::array<std::size_t, 2>& s) -> std::optional<Transfer> {
      const auto p = solve(flows, s[0], s[1], guess.motion.R_10);
      if (!p) return std::nullopt;
      return Transfer{guess.motion.R_10, *p};
    };
  };

  if (!metric) {
    if (!search_needed) return;
    problem.depth_sigma_unknown = 1e3;  // the translation has unit length: depths have no unit
    std::vector<std::size_t>& all = indices_;
    all.resize(flows.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    if (guess.rotation_known) {
      search<2>(problem, all, random_, with_turn(&solve_direction), best, trial_);
    } else {
      search<5>(
          problem, all, random_,
          [&](const std::array<std::size_t, 5>& s) { return refine_turn(flows, flagged(s), guess.motion, kSteps); },
          best, trial_);
    }
    prefer(problem, refine_turn(flows, best.flags, best.motion, kRefinements), best, trial_);  // gyroscopes err
    if (guess.rotation_known) drop_fixed(flows, guess, tolerance_, best.flags);
    return;
  }

  const double settled = kSettled * tolerance_;
  const auto by_majority = [&] { return 2 * best.inliers > flows.size(); };
  const auto refine = [&] {
    prefer(problem, refine_motion(flows, best.flags, best.motion, kRefinements, settled), best, trial_);
  };
  if (search_needed && guess.rotation_known)
    search<2>(problem, with_depth, random_, with_turn(&solve_translation), best, trial_);
  // Gyroscope and prediction are not perfect: let the inliers correct them, then decide.
  refine();
  if (search_needed && (!guess.rotation_known || !by_majority())) {
    search<3>(
        problem, with_depth, random_,
        [&](const std::array<std::size_t, 3>& s) {
          return refine_motion(flows, flagged(s), guess.motion, kSteps, settled);
        },
        best, trial_);
    refine();
  }
  if (best.inliers < kMinFlows) return flags.assign(flows.size(), 0);
  result_.motion = best.motion;
  result_.metric = best.inliers >= kMinDepths && by_majority();
}

}  // namespace ear
