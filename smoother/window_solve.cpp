// Window: the minimum of (1), and how well it is known there.
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "smoother/window.h"

namespace ear::smoother {
namespace {

constexpr int kIterations = 6;          // at most, per frame
constexpr double kConverged = 1e-5;     // relative change of the sum
constexpr double kTrustedRegion = 1e8;  // nearly Gauss-Newton: the prior determines every direction

}  // namespace

bool Window::optimize() {
  features_rejected_ = 0;
  collect();
  const std::vector<Eigen::VectorXd> before = values();
  bool solved = false;
  try {
    solved = solve();
  } catch (const std::exception&) {  // the estimator reports it; nothing here may end the program
  }
  const std::vector<Eigen::VectorXd> after = values();
  solved = solved && std::all_of(after.begin(), after.end(), [](const Eigen::VectorXd& v) { return v.allFinite(); });
  if (!solved) {
    set_values(before);
    return false;
  }
  drop_outliers();
  return true;
}

bool Window::solve() {
  ceres::Problem::Options owned_here;
  owned_here.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  owned_here.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  owned_here.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  owned_here.disable_all_safety_checks = true;
  ceres::Problem problem(owned_here);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  if (!point_terms_.empty()) {
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = points_first();
  }
  for (const PriorBlock& block : blocks()) {
    const bool pose = block.kind == BlockKind::body_pose || block.kind == BlockKind::sensor_pose;
    problem.AddParameterBlock(block.block, block.size, pose ? &pose_manifold_ : nullptr);
  }
  const auto add = [&](const Factor& factor) {
    problem.AddResidualBlock(factor.cost.get(), factor.loss, factor.blocks);
  };
  add(prior_);
  for (const Factor& factor : between_) add(factor);
  for (const PointTerm& term : point_terms_) {
    for (const Factor& factor : term.factors) add(factor);
  }
  options.max_num_iterations = kIterations;
  options.function_tolerance = kConverged;
  options.initial_trust_region_radius = kTrustedRegion;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
}

/// The order of elimination: points, which touch no other points, then all else.
std::shared_ptr<ceres::ParameterBlockOrdering> Window::points_first() const {
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const PriorBlock& block : blocks()) order->AddElementToGroup(block.block, 1);
  for (const PointTerm& term : point_terms_) order->AddElementToGroup(term.block->data(), 0);
  return order;
}

std::vector<Eigen::VectorXd> Window::values() const {
  std::vector<Eigen::VectorXd> result;
  for (const PriorBlock& block : blocks()) result.push_back(block.value);
  for (const PointTerm& term : point_terms_) {
    result.emplace_back(Eigen::Map<const Eigen::VectorXd>(term.block->data(), 3));
  }
  return result;
}

void Window::set_values(const std::vector<Eigen::VectorXd>& values) {
  std::size_t next = 0;
  for (const PriorBlock& block : blocks()) Eigen::Map<Eigen::VectorXd>(block.block, block.size) = values[next++];
  for (const PointTerm& term : point_terms_) {
    Eigen::Map<Eigen::VectorXd>(term.block->data(), 3) = values[next++];
  }
}

std::optional<NewestCovariance> Window::covariance() const {
  const std::vector<PriorBlock> all = blocks();
  NormalEquations equations(all);
  equations.add(prior_);
  for (const Factor& factor : between_) equations.add(factor);
  for (const PointTerm& term : point_terms_) {
    std::vector<const Factor*> factors;
    for (const Factor& factor : term.factors) factors.push_back(&factor);
    equations.add_point(factors, term.block->data());
  }
  Eigen::MatrixXd H = equations.H();
  const Eigen::VectorXd s = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = s.asDiagonal() * H * s.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(H);
  if (ldlt.info() != Eigen::Success) return std::nullopt;
  // Of pose, motion and wheels; a pose's step is (theta, p), a motion (v, b_g, b_a).
  const int pose = equations.column(frames_.back()->pose.data());
  const int motion = equations.column(frames_.back()->motion.data());
  const int wheels = equations.column(wheels_.data());
  std::vector<int> entries;
  const auto take = [&](int begin, int count) {
    for (int i = 0; i < count; ++i) entries.push_back(begin + i);
  };
  take(pose, 3);
  take(motion, 3);
  take(pose + 3, 3);
  take(motion + 3, 6);
  take(wheels, 6);
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(H.rows(), static_cast<Eigen::Index>(entries.size()));
  for (std::size_t i = 0; i < entries.size(); ++i) columns(entries[i], static_cast<Eigen::Index>(i)) = s(entries[i]);
  const Eigen::MatrixXd P_columns = s.asDiagonal() * ldlt.solve(columns);
  Eigen::Matrix<double, 21, 21> P = P_columns(entries, Eigen::all);
  P = (0.5 * (P + P.transpose())).eval();
  if (!P.allFinite() || !(P.diagonal().minCoeff() > 0.0)) return std::nullopt;
  return NewestCovariance{P.topLeftCorner<15, 15>(), P.bottomRightCorner<6, 6>()};
}

}  // namespace ear::smoother
