#include "smoother/normal_equations.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace ear::smoother {
namespace {

constexpr double kNegligiblePivot = 1e-10;  // of a matrix with ones on its diagonal: rounding, not information
constexpr double kAtInfinity = 1e-13;       // of a point's information: a point at infinity has no depth to eliminate

}  // namespace

NormalEquations::NormalEquations(const std::vector<PriorBlock>& blocks) {
  int size = 0;
  for (const PriorBlock& block : blocks) {
    columns_[block.block] = {size, block.step_size()};
    size += block.step_size();
  }
  H_ = Eigen::MatrixXd::Zero(size, size);
  b_ = Eigen::VectorXd::Zero(size);
  W_.resize(size, 3);
}

int NormalEquations::column(const double* block) const {
  const auto found = columns_.find(block);
  return found == columns_.end() ? -1 : found->second.first;
}

/// Residual and derivatives by the steps of the unknowns, and by `point` if it is one of the blocks.
bool NormalEquations::linearize(const Factor& factor, const double* point) {
  const std::vector<int>& sizes = factor.cost->parameter_block_sizes();
  const int rows = factor.cost->num_residuals();
  residual_.resize(rows);
  if (terms_.size() < sizes.size()) terms_.resize(sizes.size());
  term_count_ = 0;
  std::vector<double*> jacobians(sizes.size(), nullptr);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (factor.blocks[i] == point) {
      J_point_.resize(rows, 3);
      jacobians[i] = J_point_.data();
      continue;
    }
    const auto found = columns_.find(factor.blocks[i]);
    if (found == columns_.end()) continue;
    Term& term = terms_[term_count_++];
    term.column = found->second.first;
    term.size = found->second.second;
    term.J.resize(rows, sizes[i]);
    jacobians[i] = term.J.data();
  }
  if (!factor.cost->Evaluate(factor.blocks.data(), residual_.data(), jacobians.data())) return false;
  if (factor.loss == nullptr) return true;
  std::array<double, 3> rho{};
  factor.loss->Evaluate(residual_.squaredNorm(), rho.data());
  const double weight = std::sqrt(rho[1]);
  residual_ *= weight;
  for (std::size_t i = 0; i < term_count_; ++i) terms_[i].J *= weight;
  if (point != nullptr) J_point_ *= weight;
  return true;
}

void NormalEquations::sum_up() {
  for (std::size_t i = 0; i < term_count_; ++i) {
    const Term& a = terms_[i];
    const auto J_a = a.J.leftCols(a.size);
    b_.segment(a.column, a.size).noalias() += J_a.transpose() * residual_;
    for (std::size_t k = 0; k < term_count_; ++k) {
      const Term& b = terms_[k];
      if (b.column > a.column) continue;
      H_.block(a.column, b.column, a.size, b.size).noalias() += J_a.transpose() * b.J.leftCols(b.size);
    }
  }
}

void NormalEquations::add(const Factor& factor) {
  if (linearize(factor, nullptr)) sum_up();
}

void NormalEquations::add_point(const std::vector<const Factor*>& factors, const double* point) {
  W_.setZero();
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  std::vector<std::pair<int, int>> touched;
  for (const Factor* factor : factors) {
    if (!linearize(*factor, point)) continue;
    sum_up();
    V.noalias() += J_point_.transpose() * J_point_;
    v.noalias() += J_point_.transpose() * residual_;
    for (std::size_t i = 0; i < term_count_; ++i) {
      const Term& term = terms_[i];
      W_.middleRows(term.column, term.size).noalias() += term.J.leftCols(term.size).transpose() * J_point_;
      const std::pair<int, int> at{term.column, term.size};
      if (std::find(touched.begin(), touched.end(), at) == touched.end()) touched.push_back(at);
    }
  }
  V.diagonal().array() += kAtInfinity * V.trace();
  const Eigen::LLT<Eigen::Matrix3d> llt(V);
  if (llt.info() != Eigen::Success) return;
  for (const auto& [a, a_size] : touched) {
    const Eigen::Matrix<double, Eigen::Dynamic, 3> VW = llt.solve(W_.middleRows(a, a_size).transpose()).transpose();
    b_.segment(a, a_size).noalias() -= VW * v;
    for (const auto& [b, b_size] : touched) {
      if (b > a) continue;
      H_.block(a, b, a_size, b_size).noalias() -= VW * W_.middleRows(b, b_size).transpose();
    }
  }
}

std::unique_ptr<PriorFactor> marginalize(const std::vector<const Factor*>& factors,
                                         const std::vector<PointFactors>& points,
                                         const std::vector<PriorBlock>& removed, const std::vector<PriorBlock>& kept) {
  std::vector<PriorBlock> all = removed;
  all.insert(all.end(), kept.begin(), kept.end());
  NormalEquations equations(all);
  for (const Factor* factor : factors) equations.add(*factor);
  for (const PointFactors& point : points) equations.add_point(point.factors, point.point);

  int m = 0;
  for (const PriorBlock& block : removed) m += block.step_size();
  const int n = equations.size() - m;
  const Eigen::MatrixXd H = equations.H();
  const auto scaled = [](const Eigen::VectorXd& diagonal) -> Eigen::VectorXd {
    return diagonal.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  };
  const Eigen::VectorXd s_m = scaled(H.diagonal().head(m));
  const Eigen::MatrixXd H_mm = s_m.asDiagonal() * H.topLeftCorner(m, m) * s_m.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt_m(H_mm);
  const Eigen::MatrixXd H_mk = s_m.asDiagonal() * H.topRightCorner(m, n);
  const Eigen::VectorXd b_m = s_m.asDiagonal() * equations.b().head(m);
  Eigen::MatrixXd A = H.bottomRightCorner(n, n) - H_mk.transpose() * ldlt_m.solve(H_mk);
  const Eigen::VectorXd b = equations.b().tail(n) - H_mk.transpose() * ldlt_m.solve(b_m);
  if (!A.allFinite() || !b.allFinite()) return nullptr;

  // A = J^T J, b = J^T r0: Cholesky with pivoting, of the scaled matrix.
  const Eigen::VectorXd s = scaled(A.diagonal());
  A = s.asDiagonal() * (0.5 * (A + A.transpose())).eval() * s.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(A);
  const Eigen::VectorXd D = ldlt.vectorD();
  const Eigen::MatrixXd P = ldlt.transpositionsP() * Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd U = Eigen::MatrixXd(ldlt.matrixU()) * P;
  Eigen::VectorXd Pb = P * s.cwiseProduct(b);
  ldlt.matrixL().solveInPlace(Pb);
  Eigen::MatrixXd J(n, n);
  Eigen::VectorXd r0(n);
  int rows = 0;
  for (int i = 0; i < n; ++i) {
    if (!(D(i) > kNegligiblePivot)) continue;
    const double root = std::sqrt(D(i));
    J.row(rows) = root * U.row(i).cwiseQuotient(s.transpose());
    r0(rows++) = Pb(i) / root;
  }
  J.conservativeResize(rows, n);
  r0.conservativeResize(rows);
  std::vector<int> columns;
  columns.reserve(kept.size());
  for (const PriorBlock& block : kept) columns.push_back(equations.column(block.block) - m);
  to_invariant(J, kept, columns);
  return std::make_unique<PriorFactor>(kept, J, r0);
}

}  // namespace ear::smoother
