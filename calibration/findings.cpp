#include "calibration/findings.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace ear::calibration {
namespace {

Eigen::MatrixXd prior_covariance(const std::vector<Entry>& entries, const std::vector<int>& which) {
  Eigen::VectorXd variance(static_cast<Eigen::Index>(which.size()));
  for (std::size_t i = 0; i < which.size(); ++i) {
    const double prior = entries[static_cast<std::size_t>(which[i])].prior;
    variance(static_cast<Eigen::Index>(i)) = prior * prior;
  }
  return variance.asDiagonal();
}

/// The entries that are kept at the given value, and how the others hang on them.
struct Split {
  std::vector<int> kept, moved;
  Eigen::MatrixXd gain;  ///< what a step of the kept ones moves the others by, in the least-squares problem
};

Split split(const std::vector<bool>& shown, const Eigen::MatrixXd& white) {
  Split split;
  for (std::size_t i = 0; i < shown.size(); ++i) (shown[i] ? split.moved : split.kept).push_back(static_cast<int>(i));
  const Eigen::MatrixXd P_kept = white(split.kept, split.kept);
  const Eigen::MatrixXd P_cross = white(split.moved, split.kept);
  if (!split.kept.empty()) split.gain = P_kept.ldlt().solve(P_cross.transpose()).transpose();
  return split;
}

/// Variances to no less than these, correlations as they are: few tracks tell the size of their errors badly.
Eigen::MatrixXd raised(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& least) {
  const Eigen::VectorXd by = least.cwiseQuotient(covariance.diagonal()).cwiseMax(1.0).cwiseSqrt();
  return by.asDiagonal() * covariance * by.asDiagonal();
}

/// Of all, with the kept ones as uncertain as they were given. The errors of the others are e_moved - G e_kept, and G
/// times what those may be wrong by.
Eigen::MatrixXd covariance_after(const std::vector<Entry>& entries, const Split& split, const Covariances& before) {
  const auto& [kept, moved, G] = split;
  if (kept.empty()) return raised(before.found, before.white.diagonal());
  const auto n = static_cast<Eigen::Index>(entries.size());
  const Eigen::MatrixXd P0 = prior_covariance(entries, kept);
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(n, n);
  P(kept, kept) = P0;
  if (moved.empty()) return P;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(moved.size()), n);
  for (std::size_t i = 0; i < moved.size(); ++i) A(static_cast<Eigen::Index>(i), moved[i]) = 1.0;
  for (std::size_t i = 0; i < kept.size(); ++i) A.col(kept[i]) = -G.col(static_cast<Eigen::Index>(i));
  const Eigen::MatrixXd white = A * before.white * A.transpose();
  P(moved, moved) = raised(A * before.found * A.transpose(), white.diagonal()) + G * P0 * G.transpose();
  P(moved, kept) = G * P0;
  P(kept, moved) = (G * P0).transpose();
  return P;
}

/// What was not shown goes back to the given value, and what hangs on it with it: the mean of the others given these.
void move_back(const std::vector<Entry>& entries, const Split& split) {
  const auto value = [&](int i) -> double& { return *entries[static_cast<std::size_t>(i)].value; };
  Eigen::VectorXd change(static_cast<Eigen::Index>(split.kept.size()));
  for (std::size_t i = 0; i < split.kept.size(); ++i) change(static_cast<Eigen::Index>(i)) = -value(split.kept[i]);
  if (split.kept.empty()) return;
  const Eigen::VectorXd others = split.gain * change;
  for (std::size_t i = 0; i < split.moved.size(); ++i) value(split.moved[i]) += others(static_cast<Eigen::Index>(i));
  for (const int i : split.kept) value(i) = 0.0;
}

void find_entangled(const std::vector<Entry>& entries, const Eigen::MatrixXd& P, std::vector<Finding>& findings) {
  for (Eigen::Index i = 0; i < P.rows(); ++i) {
    Finding& finding = findings[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < P.cols(); ++j) {
      const double correlation = P(i, j) / std::sqrt(P(i, i) * P(j, j));
      if (i == j || std::abs(correlation) <= std::abs(finding.correlation)) continue;
      finding.correlation = correlation;
      finding.entangled_with = entries[static_cast<std::size_t>(j)].name;
    }
  }
}

}  // namespace

Decided decide(const std::vector<Entry>& entries, const Covariances& covariances, double shown_below,
               const std::function<std::string(const std::string&)>& motion_wanted) {
  const Eigen::MatrixXd P = raised(covariances.found, covariances.white.diagonal());
  std::vector<bool> shown;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    shown.push_back(std::sqrt(P(k, k)) < shown_below * entries[i].prior);
  }
  // Not again for what hangs on the kept ones: of numbers whose sum alone is known, one has to give way.
  const Split halves = split(shown, covariances.white);
  Decided decided;
  decided.covariance = covariance_after(entries, halves, covariances);
  move_back(entries, halves);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Entry& entry = entries[i];
    const double scale = std::abs(entry.scale);
    Finding finding{entry.name,
                    entry.unit,
                    entry.given,
                    entry.scale * *entry.value,
                    scale * entry.prior,
                    scale * std::sqrt(decided.covariance(k, k)),
                    shown[i],
                    "",
                    0.0,
                    shown[i] ? "" : motion_wanted(entry.name)};
    decided.findings.push_back(finding);
  }
  find_entangled(entries, P, decided.findings);
  return decided;
}

}  // namespace ear::calibration
