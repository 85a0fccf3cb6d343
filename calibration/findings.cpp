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

/// What was not shown goes back to the given value, and what hangs on it with it: the mean of the others given these.
/// They are then as uncertain as they are with what the given values may be wrong by. Returns the covariance of all.
Eigen::MatrixXd refuse(const std::vector<Entry>& entries, const std::vector<bool>& shown, Eigen::MatrixXd P) {
  std::vector<int> kept, moved;
  for (std::size_t i = 0; i < entries.size(); ++i) (shown[i] ? moved : kept).push_back(static_cast<int>(i));
  if (kept.empty()) return P;
  const auto value = [&](int i) -> double& { return *entries[static_cast<std::size_t>(i)].value; };
  Eigen::VectorXd change(static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) change(static_cast<Eigen::Index>(i)) = -value(kept[i]);
  const Eigen::MatrixXd P_kept = P(kept, kept);
  const Eigen::MatrixXd P_cross = P(moved, kept);
  const Eigen::MatrixXd G = P_kept.ldlt().solve(P_cross.transpose()).transpose();
  const Eigen::VectorXd others = G * change;
  for (std::size_t i = 0; i < moved.size(); ++i) value(moved[i]) += others(static_cast<Eigen::Index>(i));
  for (const int i : kept) value(i) = 0.0;
  const Eigen::MatrixXd P0 = prior_covariance(entries, kept);
  P(moved, moved) += G * (P0 - P_kept) * G.transpose();
  P(kept, kept) = P0;
  P(moved, kept) = G * P0;
  P(kept, moved) = (G * P0).transpose();
  return P;
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

Decided decide(const std::vector<Entry>& entries, const Eigen::MatrixXd& P, double shown_below,
               const std::function<std::string(const std::string&)>& motion_wanted) {
  std::vector<bool> shown;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    shown.push_back(std::sqrt(P(k, k)) < shown_below * entries[i].prior);
  }
  Decided decided;
  decided.covariance = refuse(entries, shown, P);
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
