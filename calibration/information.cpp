#include "calibration/information.h"

#include <ceres/crs_matrix.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace ear::calibration {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// J^T J of all unknowns, in the order of elimination.
Sparse information(Batch& batch, int threads) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = batch.elimination_order();
  options.num_threads = threads;
  ceres::CRSMatrix crs;
  batch.problem().Evaluate(options, nullptr, nullptr, nullptr, &crs);
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> J(
      crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(), crs.cols.data(),
      crs.values.data());
  const Sparse by_column = J;
  Sparse H(crs.num_cols, crs.num_cols);
  H.selfadjointView<Eigen::Lower>().rankUpdate(by_column.transpose());
  return H;
}

/// Scaled to ones on its diagonal.
Eigen::VectorXd scale_to_ones(Sparse& H) {
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = scale.asDiagonal() * H * scale.asDiagonal();
  return scale;
}

}  // namespace

std::optional<Eigen::MatrixXd> parameter_covariance(Batch& batch, int threads) {
  Eigen::Index n = 0;
  for (const ParameterBlock& block : batch.parameter_blocks()) n += static_cast<Eigen::Index>(block.entries.size());
  Sparse H = information(batch, threads);
  const Eigen::VectorXd scale = scale_to_ones(H);
  // Points, frames in the order of time, parameters: little fill, and the parameters' part comes last.
  const Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(H);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Eigen::Index first = H.cols() - n;
  const Sparse L_sparse = factor.matrixL();
  Eigen::MatrixXd L = Eigen::MatrixXd(L_sparse.bottomRightCorner(n, n));
  L.diagonal().setOnes();
  const Eigen::VectorXd D = factor.vectorD().tail(n);
  if (!(D.minCoeff() > 0.0)) return std::nullopt;
  const Eigen::MatrixXd L_inverse = L.triangularView<Eigen::UnitLower>().solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::VectorXd s = scale.segment(first, n);
  return s.asDiagonal() * (L_inverse.transpose() * D.cwiseInverse().asDiagonal() * L_inverse) * s.asDiagonal();
}

}  // namespace ear::calibration
