#include "smoother/minimum.h"

#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <vector>

#include "smoother/normal_equations.h"

namespace ear::smoother {
namespace {

constexpr int kIterations = 6;       // at most, per frame
constexpr double kConverged = 1e-5;  // relative change of the sum
constexpr double kRegion = 1e8;      // nearly Gauss-Newton: the prior determines every direction

/// The order of elimination: points, which touch no other points, then all else.
std::shared_ptr<ceres::ParameterBlockOrdering> points_first(const Terms& terms, const Unknowns& unknowns) {
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const PriorBlock& block : unknowns.blocks()) order->AddElementToGroup(block.block, 1);
  for (const PointTerm& term : terms.points()) order->AddElementToGroup(term.block->data(), 0);
  return order;
}

bool solve(const Factor& prior, const Terms& terms, Unknowns& unknowns) {
  PoseManifold pose_manifold;
  ceres::Problem::Options owned_here;
  owned_here.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  owned_here.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  owned_here.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  owned_here.disable_all_safety_checks = true;
  ceres::Problem problem(owned_here);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  if (!terms.points().empty()) {
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = points_first(terms, unknowns);
  }
  for (const PriorBlock& block : unknowns.blocks()) {
    const bool pose = block.kind == BlockKind::body_pose || block.kind == BlockKind::sensor_pose;
    problem.AddParameterBlock(block.block, block.size, pose ? &pose_manifold : nullptr);
  }
  const auto add = [&](const Factor& factor) {
    problem.AddResidualBlock(factor.cost.get(), factor.loss, factor.blocks);
  };
  add(prior);
  for (const Factor& factor : terms.between()) add(factor);
  for (const PointTerm& term : terms.points()) {
    for (const Factor& factor : term.factors) add(factor);
  }
  options.max_num_iterations = kIterations;
  options.function_tolerance = kConverged;
  options.initial_trust_region_radius = kRegion;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
}

std::vector<Eigen::VectorXd> values(const Terms& terms, const Unknowns& unknowns) {
  std::vector<Eigen::VectorXd> result;
  for (const PriorBlock& block : unknowns.blocks()) result.push_back(block.value);
  for (const PointTerm& term : terms.points()) {
    result.emplace_back(Eigen::Map<const Eigen::VectorXd>(term.block->data(), 3));
  }
  return result;
}

void set_values(const std::vector<Eigen::VectorXd>& values, const Terms& terms, Unknowns& unknowns) {
  std::size_t next = 0;
  for (const PriorBlock& block : unknowns.blocks()) {
    Eigen::Map<Eigen::VectorXd>(block.block, block.size) = values[next++];
  }
  for (const PointTerm& term : terms.points()) {
    Eigen::Map<Eigen::VectorXd>(term.block->data(), 3) = values[next++];
  }
}

}  // namespace

bool minimise(const Factor& prior, const Terms& terms, Unknowns& unknowns) {
  const std::vector<Eigen::VectorXd> before = values(terms, unknowns);
  bool solved = false;
  try {
    solved = solve(prior, terms, unknowns);
  } catch (const std::exception&) {  // the estimator reports it; nothing here may end the program
  }
  const std::vector<Eigen::VectorXd> after = values(terms, unknowns);
  solved = solved && std::all_of(after.begin(), after.end(), [](const Eigen::VectorXd& v) { return v.allFinite(); });
  if (!solved) set_values(before, terms, unknowns);
  return solved;
}

std::optional<Eigen::MatrixXd> newest_covariance(const Factor& prior, const Terms& terms, const Unknowns& unknowns) {
  NormalEquations equations(unknowns.blocks());
  equations.add(prior);
  for (const Factor& factor : terms.between()) equations.add(factor);
  for (const PointTerm& term : terms.points()) {
    std::vector<const Factor*> factors;
    for (const Factor& factor : term.factors) factors.push_back(&factor);
    equations.add_point(factors, term.block->data());
  }
  Eigen::MatrixXd H = equations.H();
  const Eigen::VectorXd s = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = s.asDiagonal() * H * s.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(H);
  if (ldlt.info() != Eigen::Success) return std::nullopt;
  const std::vector<int> entries = filter_entries();  // of the last blocks, in their order
  const auto n = static_cast<Eigen::Index>(entries.size());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(H.rows(), n);
  columns.bottomRows(n) = s.tail(n).asDiagonal();
  const Eigen::MatrixXd P_columns = s.asDiagonal() * ldlt.solve(columns);
  const Eigen::MatrixXd P_steps = P_columns.bottomRows(n);
  if (!P_steps.allFinite() || !(P_steps.diagonal().minCoeff() > 0.0)) return std::nullopt;

  // From the steps to the filter's errors: nu = dv + [v]x theta, rho = dp + [p]x theta.
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(err::clones, err::clones);
  P(entries, entries) = 0.5 * (P_steps + P_steps.transpose());
  const ImuState x = unknowns.newest();
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(err::clones, err::clones);
  T.block<3, 3>(err::nu, err::theta) = skew(x.v_W);
  T.block<3, 3>(err::rho, err::theta) = skew(x.p_WB);
  return T * P * T.transpose();
}

}  // namespace ear::smoother
