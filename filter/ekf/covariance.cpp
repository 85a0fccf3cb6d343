#include "filter/ekf/covariance.h"

#include <algorithm>
#include <cassert>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/kernel_matrix.h"
#include "filter/ekf/so3.h"

namespace ear {
namespace {

constexpr int kGroup = 4;  // rows that are summed up at a time

}  // namespace

Covariance::Covariance(int capacity, Kernels kernels)
    : kernels_(filter_kernels(kernels)),
      P_(Eigen::MatrixXd::Zero(stride_for(capacity), rounded_up(capacity))),
      Ht_(Eigen::MatrixXd::Zero(stride_for(capacity), capacity)),
      PHt_(Eigen::MatrixXd::Zero(stride_for(capacity + kGroup), capacity)),
      S_(Eigen::MatrixXd::Zero(stride_for(capacity), capacity)),
      considered_(err::calibration_size, err::calibration_size),
      whitened_(capacity),
      correction_(capacity) {
  seen_.reserve(static_cast<std::size_t>(capacity));
}

void Covariance::reset(const Eigen::VectorXd& sigma) {
  assert(sigma.size() <= P_.cols());
  size_ = static_cast<int>(sigma.size());
  P_.topLeftCorner(size_, size_).setZero();
  P_.topLeftCorner(size_, size_).diagonal() = sigma.cwiseAbs2();
}

void Covariance::propagate(const ErrorTransition& transition, const MatrixEffect& by_matrix,
                           const Eigen::Matrix<double, 3, 2>& B, double normal_variance) {
  // delta + B^T theta is the normal's error in the world, which motion does not touch. So delta changes by -B^T times
  // what theta does: a part of the gyroscope's bias and matrix, and noise.
  constexpr int n = err::normal + 2;  // what changes
  const Eigen::Matrix<double, 3, 2> gyro_to_normal = -transition.Phi.block<3, 3>(err::theta, err::b_g).transpose() * B;
  const auto carry = [&](auto& M) {
    kernels_.carry(transition.Phi.data(), static_cast<int>(M.rows()), {M.data(), M.outerStride()});
    M.template middleCols<2>(err::normal).noalias() += M.template middleCols<3>(err::b_g).lazyProduct(gyro_to_normal);
  };
  auto P = P_.topLeftCorner(size_, size_);
  carry(P);
  Eigen::Matrix<double, 9, n> effect = Eigen::Matrix<double, 9, n>::Zero();
  effect.leftCols<9>() = by_matrix.gyro.transpose();
  effect.rightCols<2>() = -by_matrix.gyro.topRows<3>().transpose() * B;
  const Eigen::Matrix<double, 9, 6> accel_effect = by_matrix.accel.transpose();
  for (int column = 0; column < n; ++column) {
    if (column >= err::b_g && column < err::normal) continue;  // they do nothing to the biases
    P.col(column).noalias() += P.middleCols<9>(err::gyro_matrix).lazyProduct(effect.col(column));
  }
  for (int column = 0; column < 6; ++column) {
    P.col(err::nu + column).noalias() += P.middleCols<9>(err::accel_matrix).lazyProduct(accel_effect.col(column));
  }
  Eigen::Matrix<double, n, n> corner = P.topLeftCorner<n, n>().transpose();
  carry(corner);
  corner.noalias() += P.block<9, n>(err::gyro_matrix, 0).transpose().lazyProduct(effect);
  corner.middleCols<6>(err::nu).noalias() += P.block<9, n>(err::accel_matrix, 0).transpose().lazyProduct(accel_effect);
  corner.topLeftCorner<err::imu_size, err::imu_size>() += transition.Q;
  const Eigen::Matrix<double, 2, 3> to_normal = -B.transpose();
  const Eigen::Matrix<double, 2, err::imu_size> normal_Q = to_normal * transition.Q.topRows<3>();
  corner.bottomLeftCorner<2, err::imu_size>() += normal_Q;
  corner.topRightCorner<err::imu_size, 2>() += normal_Q.transpose();
  corner.bottomRightCorner<2, 2>() += normal_Q.leftCols<3>() * to_normal.transpose();
  corner.diagonal().tail<2>().array() += normal_variance;
  P.topLeftCorner<n, n>() = 0.5 * (corner + corner.transpose());
  const int rest = size_ - n;
  P.topRightCorner(n, rest) = P.bottomLeftCorner(rest, n).transpose();
}

void Covariance::restart(int first, const Eigen::Ref<const Eigen::VectorXd>& sigma) {
  const auto count = sigma.size();
  P_.block(first, 0, count, size_).setZero();
  P_.block(0, first, size_, count).setZero();
  P_.diagonal().segment(first, count) = sigma.cwiseAbs2();
}

void Covariance::inflate(int first, const Eigen::Ref<const Eigen::MatrixXd>& Q) {
  assert(first >= 0 && Q.rows() == Q.cols() && first + Q.rows() <= size_);
  P_.block(first, first, Q.rows(), Q.cols()) += Q;
}

void Covariance::inflate_along(const Eigen::Ref<const Eigen::VectorXd>& J) {
  assert(J.size() == size_);
  for (int column = 0; column < size_; ++column) P_.col(column).head(size_) += J(column) * J;
}

double Covariance::variance(const Eigen::Ref<const Eigen::RowVectorXd>& h, int first_column) const {
  const auto n = h.size();
  double sum = 0.0;
  for (Eigen::Index j = 0; j < n; ++j) {
    if (h(j) != 0.0) sum += h(j) * h.dot(P_.col(first_column + j).segment(first_column, n));
  }
  return sum;
}

void Covariance::append_clone(const Eigen::Matrix<double, 6, 1>& J_offset) {
  assert(size_ + err::clone_size <= P_.cols());
  const int n = size_;
  auto rows = P_.block(n, 0, 6, n);
  rows.topRows<3>() = P_.block(err::theta, 0, 3, n);
  rows.bottomRows<3>() = P_.block(err::rho, 0, 3, n);
  rows.noalias() += J_offset * P_.row(err::time_offset).leftCols(n);
  P_.block(0, n, n, 6) = rows.transpose();
  Eigen::Matrix<double, 6, 6> corner;
  corner << rows.middleCols<3>(err::theta), rows.middleCols<3>(err::rho);
  corner.noalias() += rows.col(err::time_offset) * J_offset.transpose();
  P_.block<6, 6>(n, n) = 0.5 * (corner + corner.transpose());
  size_ += err::clone_size;
}

/// With dp = rho - [p]x theta for each pose k and for the body, whose own is taken off: rho_k' = rho_k - rho +
/// [p]x (theta - theta_k).
void Covariance::move_origin(const Eigen::Vector3d& p_W) {
  const Eigen::Matrix3d p_x = skew(p_W);
  auto P = P_.topLeftCorner(size_, size_);
  for (int k = err::clones; k < size_; k += err::clone_size) {
    P.middleRows<3>(k + 3) += p_x * (P.middleRows<3>(err::theta) - P.middleRows<3>(k)) - P.middleRows<3>(err::rho);
  }
  P.middleRows<3>(err::rho).setZero();
  for (int k = err::clones; k < size_; k += err::clone_size) {
    P.middleCols<3>(k + 3) +=
        (P.middleCols<3>(err::theta) - P.middleCols<3>(k)) * p_x.transpose() - P.middleCols<3>(err::rho);
  }
  P.middleCols<3>(err::rho).setZero();
  P.diagonal().segment<3>(err::rho).setConstant(kKnownSigma * kKnownSigma);
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
  const auto result = correction(H, first_column, residual, considered_first, considered_count);
  if (rows_ == 0) return result;
  const auto c = considered_count;
  auto P_considered = P_.block(considered_first, considered_first, c, c);
  considered_.topLeftCorner(c, c) = P_considered;
  kernels_.subtract_square(readable(PHt_), rows_, size_, writable(P_));
  P_considered = considered_.topLeftCorner(c, c);
  return result;
}

ClonePair Covariance::corrected(int row, int column) const {
  constexpr int size = err::clone_size;
  return P_.block<size, size>(row, column) -
         PHt_.block(row, 0, size, rows_).lazyProduct(PHt_.block(column, 0, size, rows_).transpose());
}

Eigen::Matrix3d Covariance::of_way(const ClonePoint& from, const ClonePoint& to, bool after) const {
  constexpr int size = err::clone_size;
  const auto P = [&](int a, int b) -> ClonePair { return after ? corrected(a, b) : P_.block<size, size>(a, b); };
  const int i = from.entry, j = to.entry;
  Eigen::Matrix<double, 2 * size, 2 * size> P_both;
  P_both << P(i, i), P(i, j), P(j, i), P(j, j);
  Eigen::Matrix<double, 3, 2 * size> J;  // by the errors of both clones
  J << skew(from.p_W), -Eigen::Matrix3d::Identity(), -skew(to.p_W), Eigen::Matrix3d::Identity();
  return J * P_both * J.transpose();
}

Eigen::Ref<const Eigen::VectorXd> Covariance::correction(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                                                         const Eigen::Ref<const Eigen::VectorXd>& residual,
                                                         int considered_first, int considered_count) {
  const int n = size_;
  rows_ = 0;
  const auto m = static_cast<int>(H.rows());
  const auto columns = static_cast<int>(H.cols());
  assert(m <= PHt_.cols() && first_column + columns <= n);
  auto correction = correction_.head(n);
  correction.setZero();
  if (!residual.allFinite() || !H.allFinite()) return correction;
  const int padded = (columns + kGroup - 1) / kGroup * kGroup;
  Ht_.topLeftCorner(columns, m) = H.transpose();
  Ht_.block(columns, 0, padded - columns, m).setZero();
  seen_.clear();
  for (int k = 0; k < columns; ++k) {
    if (!(Ht_.row(k).head(m).array() == 0.0).all()) seen_.push_back(k);
  }

  const ConstMatrix P_seen{P_.col(first_column).data(), P_.outerStride()};
  kernels_.multiply(P_seen, readable(Ht_), seen_.data(), static_cast<int>(seen_.size()), n, m, writable(PHt_));
  PHt_.block(n, 0, std::max(rounded_up(n) - n, kGroup), m).setZero();
  auto S = S_.topLeftCorner(m, m);
  const ConstMatrix PHt_seen{PHt_.data() + first_column, PHt_.outerStride()};
  kernels_.multiply_transposed(readable(Ht_), PHt_seen, padded, m, writable(S_));  // the other triangle is not read
  S.diagonal().array() += 1.0;
  auto z = whitened_.head(m);
  z = residual;
  if (!kernels_.factorize(writable(S_), m, z.data())) return correction;
  // Y = P H^T L^-T, in the place of P H^T, so that P H^T S^-1 H P = Y Y^T
  kernels_.solve(readable(S_), n, m, writable(PHt_));
  rows_ = m;
  correction.noalias() = PHt_.topLeftCorner(n, m) * z;
  correction.segment(considered_first, considered_count).setZero();
  return correction;
}

}  // namespace ear
