#include "calibration/information.h"

#include <ceres/crs_matrix.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cmath>

namespace ear::calibration {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Of all terms, in their order; unknowns in the order of elimination. Losses are applied.
struct Linearized {
  Eigen::SparseMatrix<double, Eigen::RowMajor> J;
  std::vector<double> residuals;
};

Linearized linearized(Batch& batch, int threads) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = batch.elimination_order();
  for (const TermBlock& term : batch.terms()) options.residual_blocks.push_back(term.id);
  options.num_threads = threads;
  ceres::CRSMatrix crs;
  Linearized result;
  batch.problem().Evaluate(options, nullptr, &result.residuals, nullptr, &crs);
  result.J = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
      crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(), crs.cols.data(),
      crs.values.data());
  return result;
}

/// Scaled to ones on its diagonal.
Eigen::VectorXd scale_to_ones(Sparse& H) {
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = scale.asDiagonal() * H * scale.asDiagonal();
  return scale;
}

/// The last `n` columns of (J^T J)^-1.
std::optional<Eigen::MatrixXd> last_columns(const Sparse& J, Eigen::Index n) {
  Sparse H(J.cols(), J.cols());
  H.selfadjointView<Eigen::Lower>().rankUpdate(J.transpose());
  const Eigen::VectorXd scale = scale_to_ones(H);
  // Points, frames in the order of time, parameters: little fill.
  const Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(H);
  if (factor.info() != Eigen::Success || !(factor.vectorD().tail(n).minCoeff() > 0.0)) return std::nullopt;
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(H.cols(), n);
  columns.bottomRows(n).diagonal() = scale.tail(n);
  return scale.asDiagonal() * factor.solve(columns);
}

/// Features take from their rows what places the points, which is no loss here, and the keyframes: what the residuals
/// are smaller than the errors by.
double rows_over_free(const Batch& batch, double feature_rows) {
  double points = 0.0, keyframes = 0.0;
  for (const Segment& segment : batch.segments()) {
    keyframes += static_cast<double>(segment.keyframes.size());
    for (const Point& point : segment.points) points += point.used ? 3.0 : 0.0;
  }
  constexpr double kPose = 6.0;
  const double rows = feature_rows - points;
  return rows > 2.0 * kPose * keyframes ? rows / (rows - kPose * keyframes) : 2.0;
}

}  // namespace

std::optional<Information> information_of(Batch& batch, int threads) {
  Eigen::Index n = 0;
  for (const CalibrationBlock& block : batch.parameter_blocks()) n += static_cast<Eigen::Index>(block.entries.size());
  const Linearized all = linearized(batch, threads);
  const auto columns = last_columns(all.J, n);
  if (!columns) return std::nullopt;
  const Eigen::MatrixXd Y = all.J * *columns;  // what a row's error moves the parameters by

  Eigen::MatrixXd others = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd features = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd white = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(n);  // by one feature
  double feature_rows = 0.0;
  Eigen::Index row = 0;
  const TermBlock* before = nullptr;
  const auto end_feature = [&] {
    features.selfadjointView<Eigen::Lower>().rankUpdate(moved);
    moved.setZero();
  };
  for (const TermBlock& term : batch.terms()) {
    const Eigen::Index rows = batch.problem().GetCostFunctionForResidualBlock(term.id)->num_residuals();
    const auto y = Y.middleRows(row, rows);
    if (term.kind != Term::pixel) {
      others.selfadjointView<Eigen::Lower>().rankUpdate(y.transpose());
    } else {
      const bool same = before != nullptr && before->keyframe == term.keyframe && before->segment == term.segment;
      if (!same) end_feature();
      before = &term;
      moved += y.transpose() * Eigen::Map<const Eigen::VectorXd>(all.residuals.data() + row, rows);
      white += y.colwise().squaredNorm().transpose();
      feature_rows += static_cast<double>(rows);
    }
    row += rows;
  }
  end_feature();
  features *= rows_over_free(batch, feature_rows);
  Information result;
  result.covariances.found = (others + features).selfadjointView<Eigen::Lower>();
  result.covariances.white = columns->bottomRows(n);
  double ratio = 0.0, weight = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double share = white(i) / (white(i) + others(i, i));
    if (!(share > 0.0)) continue;
    ratio += share * features(i, i) / white(i);
    weight += share;
  }
  if (weight > 0.0) result.lasting = std::sqrt(ratio / weight);
  return result;
}

}  // namespace ear::calibration
