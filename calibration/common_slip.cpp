#include "calibration/common_slip.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ear::calibration {
namespace {

constexpr int kKnots = 20;          // places along the way, so that white noise is averaged and lasting slip is not
constexpr double kWindow = 0.5;     // of the distance between two knots, that a knot is the mean of
constexpr int kFewestKnots = 10;    // that have something in their window
constexpr int kShares = 50;         // of the variance that the walk brings between two knots, that are tried
constexpr double kShortest = 0.01;  // [m] of an interval: below, the direction is not known

/// Means over a window about each knot.
struct Knots {
  std::vector<double> way, ahead;
  std::vector<double> length;  ///< [m] of the window: half as much at both ends of the way
  std::vector<double> count;   ///< in the window
  double apart = 0.0;          ///< [m]
};

Knots means_at_knots(const std::vector<Ahead>& along) {
  Knots knots;
  knots.apart = (along.back().way - along.front().way) / kKnots;
  for (int k = 0; k <= kKnots; ++k) {
    const double centre = along.front().way + k * knots.apart;
    double way = 0.0, ahead = 0.0, count = 0.0;
    for (const Ahead& at : along) {
      if (std::abs(at.way - centre) > 0.5 * kWindow * knots.apart) continue;
      way += at.way;
      ahead += at.ahead;
      count += 1.0;
    }
    if (count == 0.0) continue;
    knots.way.push_back(way / count);
    knots.ahead.push_back(ahead / count);
    knots.length.push_back((k == 0 || k == kKnots ? 0.5 : 1.0) * kWindow * knots.apart);
    knots.count.push_back(count);
  }
  return knots;
}

/// Covariance of the knots by a walk of variance 1 over the distance of two knots. The mean of a walk over a window of
/// length L about s has the variance s - L / 6; windows do not overlap.
Eigen::MatrixXd walk_covariance(const Knots& knots, double start) {
  const auto n = static_cast<Eigen::Index>(knots.way.size());
  const Eigen::VectorXd s = (Eigen::Map<const Eigen::VectorXd>(knots.way.data(), n).array() - start) / knots.apart;
  Eigen::MatrixXd V(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) V(i, j) = std::min(s(i), s(j));
  }
  V.diagonal() -= Eigen::Map<const Eigen::VectorXd>(knots.length.data(), n) / (6.0 * knots.apart);
  return V;
}

/// Covariance of the knots by white noise that has the variance 1 in the mean of a whole window.
Eigen::MatrixXd noise_covariance(const Knots& knots) {
  const auto n = static_cast<Eigen::Index>(knots.count.size());
  const Eigen::Map<const Eigen::VectorXd> count(knots.count.data(), n);
  return (count.maxCoeff() * count.cwiseInverse()).asDiagonal();
}

/// Of a line with errors whose covariance is `V` but for its size.
struct Fit {
  double log_likelihood = 0.0;  ///< restricted: of what the line leaves
  double variance = 0.0;        ///< the size
};

Fit fit_line(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::MatrixXd& V) {
  const Eigen::LLT<Eigen::MatrixXd> factor(V);
  const Eigen::MatrixXd Xw = factor.matrixL().solve(X);
  const Eigen::VectorXd yw = factor.matrixL().solve(y);
  const Eigen::LLT<Eigen::MatrixXd> normal(Xw.transpose() * Xw);
  const Eigen::VectorXd left = yw - Xw * normal.solve(Xw.transpose() * yw);
  const auto free = static_cast<double>(X.rows() - X.cols());
  const auto half_log_determinant = [](const Eigen::LLT<Eigen::MatrixXd>& llt) {
    return llt.matrixLLT().diagonal().array().log().sum();
  };
  Fit fit;
  fit.variance = left.squaredNorm() / free;
  fit.log_likelihood =
      -0.5 * free * std::log(fit.variance) - half_log_determinant(factor) - half_log_determinant(normal);
  return fit;
}

/// The way of the axle's middle between two keyframes by the estimate, without its sign [m].
double estimated_way(const Keyframe& keyframe, const Eigen::Vector3d& lever) {
  double way = 0.0;
  for (std::size_t i = 0; i + 1 < keyframe.path.size(); ++i) {
    const PathNode& a = keyframe.path[i];
    const PathNode& b = keyframe.path[i + 1];
    way += (b.p_kt + b.R_kt * lever - a.p_kt - a.R_kt * lever).norm();
  }
  return way;
}

/// Up to each keyframe: how far the wheels rolled, and how much further than the estimate says.
struct Rolled {
  std::vector<Ahead> until;
  std::vector<bool> moves;  ///< from this keyframe on
};

Rolled roll_all(const Segment& segment, const RollSetting& setting) {
  const WheelAngles angles(setting.encoder, segment.drive->encoders);
  const OdometerState& now = setting.now;
  Rolled rolled;
  Ahead at;
  for (const Keyframe& keyframe : segment.keyframes) {
    rolled.until.push_back(at);
    rolled.moves.push_back(false);
    if (!keyframe.on_ground || keyframe.path.size() < 2) continue;
    const auto from = angles.angle(keyframe.t_ns);
    const auto to = angles.angle(keyframe.path.back().t_ns);
    if (!from || !to) continue;
    double pitched = 0.0;
    for (std::size_t i = 0; i + 1 < keyframe.path.size(); ++i) {
      const PathNode& node = keyframe.path[i];
      pitched += seconds_between(node.t_ns, keyframe.path[i + 1].t_ns) * now.T_BO.R.col(1).dot(node.rate_B);
    }
    const double way = std::abs(now.wheel_radius.dot(*to - *from + Eigen::Vector2d::Constant(pitched)) / 2.0);
    if (way < kShortest) continue;
    at.way += way;
    at.ahead += way - estimated_way(keyframe, now.T_BO.p);
    rolled.moves.back() = true;
  }
  return rolled;
}

}  // namespace

std::optional<double> walk_along(const std::vector<Ahead>& along) {
  if (along.empty() || !(along.back().way > along.front().way)) return std::nullopt;
  const Knots knots = means_at_knots(along);
  const auto n = static_cast<Eigen::Index>(knots.way.size());
  if (n < kFewestKnots) return std::nullopt;
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(knots.ahead.data(), n);
  Eigen::MatrixXd X(n, 2);
  X << Eigen::VectorXd::Ones(n), Eigen::Map<const Eigen::VectorXd>(knots.way.data(), n) / knots.apart;
  const Eigen::MatrixXd walked = walk_covariance(knots, along.front().way), noise = noise_covariance(knots);
  double best = -std::numeric_limits<double>::infinity(), walk = 0.0;
  for (int k = 0; k <= kShares; ++k) {
    const double share = k / static_cast<double>(kShares);
    const Fit fit = fit_line(X, y, share * walked + (1.0 - share) * noise);
    if (!(fit.log_likelihood > best)) continue;
    best = fit.log_likelihood;
    walk = share * fit.variance / knots.apart;
  }
  return std::sqrt(walk);
}

std::optional<double> common_slip(const Batch& batch, std::size_t segment, const RollSetting& setting) {
  const Segment& drive = batch.segments()[segment];
  if (drive.drive->reference.empty()) return std::nullopt;
  const Rolled rolled = roll_all(drive, setting);
  std::vector<Ahead> along;
  std::array<double, 3> residual{};
  for (const TermBlock& term : batch.terms()) {
    if (term.kind != Term::reference || term.segment != segment || !rolled.moves[term.keyframe]) continue;
    batch.problem().EvaluateResidualBlock(term.id, false, nullptr, residual.data(), nullptr);
    const Eigen::Vector3d error = drive.drive->reference_sigma * Eigen::Map<const Eigen::Vector3d>(residual.data());
    Ahead at = rolled.until[term.keyframe];
    if (term.keyframe + 1 < rolled.until.size()) {
      const Keyframe& keyframe = drive.keyframes[term.keyframe];
      const double part = seconds_between(keyframe.t_ns, term.t_ns) /
                          seconds_between(keyframe.t_ns, drive.keyframes[term.keyframe + 1].t_ns);
      const Ahead& next = rolled.until[term.keyframe + 1];
      at.way += part * (next.way - at.way);
      at.ahead += part * (next.ahead - at.ahead);
    }
    at.ahead -= error.dot(state_of(drive.keyframes[term.keyframe]).v_W.normalized());
    along.push_back(at);
  }
  return walk_along(along);
}

}  // namespace ear::calibration
