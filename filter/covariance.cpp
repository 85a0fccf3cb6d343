#include "filter/covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>

namespace ear {

Covariance::Covariance(int capacity)
    : P_(Eigen::MatrixXd::Zero(capacity, capacity)),
      PHt_(capacity, capacity),
      S_(capacity, capacity),
      considered_(err::calibration_size, err::calibration_size),
      scratch_(err::imu_size, capacity),
      whitened_(capacity),
      correction_(capacity) {}

void Covariance::reset(const Eigen::VectorXd& sigma) {
  assert(sigma.size() <= P_.rows());
  size_ = static_cast<int>(sigma.size());
  P_.topLeftCorner(size_, size_).setZero();
  P_.topLeftCorner(size_, size_).diagonal() = sigma.cwiseAbs2();
}

void Covariance::propagate(const ErrorTransition& transition, const Eigen::Matrix<double, 3, 2>& B,
                           double normal_variance) {
  constexpr int n = err::imu_size;
  const int rest = size_ - n;
  // delta + B^T theta is the normal's error in the world, which motion does not touch.
  const auto add_rotation = [&](double sign) {
    auto P = P_.topLeftCorner(size_, size_);
    P.middleRows<2>(err::normal).noalias() += sign * B.transpose() * P.middleRows<3>(err::theta);
    P.middleCols<2>(err::normal).noalias() += sign * P.middleCols<3>(err::theta) * B;
  };
  add_rotation(1.0);
  const ImuErrorMatrix PhiP = transition.Phi * P_.topLeftCorner<n, n>();
  const ImuErrorMatrix P_imu = PhiP * transition.Phi.transpose() + transition.Q;
  P_.topLeftCorner<n, n>() = 0.5 * (P_imu + P_imu.transpose());
  scratch_.leftCols(rest).noalias() = transition.Phi * P_.block(0, n, n, rest);
  P_.block(0, n, n, rest) = scratch_.leftCols(rest);
  P_.block(n, 0, rest, n) = scratch_.leftCols(rest).transpose();
  add_rotation(-1.0);
  P_.diagonal().segment<2>(err::normal).array() += normal_variance;
}

void Covariance::restart(int first, const Eigen::Ref<const Eigen::VectorXd>& sigma) {
  const auto count = sigma.size();
  P_.block(first, 0, count, size_).setZero();
  P_.block(0, first, size_, count).setZero();
  P_.diagonal().segment(first, count) = sigma.cwiseAbs2();
}

void Covariance::widen(int first, const Eigen::Ref<const Eigen::MatrixXd>& Q) {
  assert(first >= 0 && Q.rows() == Q.cols() && first + Q.rows() <= size_);
  P_.block(first, first, Q.rows(), Q.cols()) += Q;
}

double Covariance::variance_of_row(const Eigen::Ref<const Eigen::RowVectorXd>& h, int first_column) const {
  const auto n = h.size();
  double sum = 0.0;
  for (Eigen::Index j = 0; j < n; ++j) {
    if (h(j) != 0.0) sum += h(j) * h.dot(P_.col(first_column + j).segment(first_column, n));
  }
  return sum;
}

void Covariance::append_clone(const Eigen::Matrix<double, 6, err::imu_size>& J_clone_imu,
                              const Eigen::Matrix<double, 6, 1>& J_clone_offset) {
  assert(size_ + err::clone_size <= P_.rows());
  const int n = size_;
  auto rows = P_.block(n, 0, 6, n);
  rows.noalias() = J_clone_imu * P_.topRows(err::imu_size).leftCols(n);
  rows.noalias() += J_clone_offset * P_.row(err::time_offset).leftCols(n);
  P_.block(0, n, n, 6) = rows.transpose();
  Eigen::Matrix<double, 6, 6> corner = rows.leftCols<err::imu_size>() * J_clone_imu.transpose();
  corner.noalias() += rows.col(err::time_offset) * J_clone_offset.transpose();
  P_.block<6, 6>(n, n) = 0.5 * (corner + corner.transpose());
  size_ += err::clone_size;
}

void Covariance::remove(int first, int count) {
  assert(first >= 0 && count >= 0 && first + count <= size_);
  const int tail = size_ - first - count;
  // Column by column, front to back: source and target overlap, and each target lies before its source.
  for (int column = first; column < first + tail; ++column)
    P_.col(column).head(size_) = P_.col(column + count).head(size_);
  for (int column = 0; column < size_ - count; ++column) {
    double* const values = P_.col(column).data();
    std::copy(values + first + count, values + size_, values + first);
  }
  size_ -= count;
}

Eigen::Ref<const Eigen::VectorXd> Covariance::update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                                                     const Eigen::Ref<const Eigen::VectorXd>& residual,
                                                     int considered_first, int considered_count) {
  const int n = size_;
  const auto m = H.rows();
  assert(m <= PHt_.cols() && first_column + H.cols() <= n);
  auto P = P_.topLeftCorner(n, n);
  auto PHt = PHt_.topLeftCorner(n, m);
  auto S = S_.topLeftCorner(m, m);
  auto z = whitened_.head(m);

  PHt.noalias() = P.middleCols(first_column, H.cols()) * H.transpose();
  S.noalias() = H * PHt.middleRows(first_column, H.cols());
  S.diagonal().array() += 1.0;
  auto correction = correction_.head(n);
  correction.setZero();
  Eigen::Ref<Eigen::MatrixXd> factor = S;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(factor);  // in place
  if (llt.info() != Eigen::Success || !residual.allFinite() || !H.allFinite()) return correction;
  z = residual;
  llt.matrixL().solveInPlace(z);
  llt.matrixU().solveInPlace<Eigen::OnTheRight>(PHt);  // Y = P H^T L^-T, so that P H^T S^-1 H P = Y Y^T

  const auto c = considered_count;
  considered_.topLeftCorner(c, c) = P.block(considered_first, considered_first, c, c);
  P.selfadjointView<Eigen::Lower>().rankUpdate(PHt, -1.0);
  P.triangularView<Eigen::StrictlyUpper>() = P.transpose();
  P.block(considered_first, considered_first, c, c) = considered_.topLeftCorner(c, c);

  correction.noalias() = PHt * z;
  correction.segment(considered_first, c).setZero();
  return correction;
}

}  // namespace ear
