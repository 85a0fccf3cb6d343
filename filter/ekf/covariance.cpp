#include "filter/ekf/covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>

namespace ear {
namespace {

// Measurements of few rows (wheels, lasers, standstill) are the most frequent. Eigen's blocked products then mostly
// arrange their blocks: plain sums over whole columns cost a third.
constexpr int kFewRows = 12;

/// result = P H^T, the columns of H that are zero left out.
template <typename Block, typename Result>
void multiply_few(const Block& P, const Eigen::Ref<const Eigen::MatrixXd>& H, Result& result) {
  result.setZero();
  for (Eigen::Index j = 0; j < H.cols(); ++j) {
    for (Eigen::Index k = 0; k < H.rows(); ++k) {
      if (H(k, j) != 0.0) result.col(k) += H(k, j) * P.col(j);
    }
  }
}

/// Y = Y L^-T for a lower triangular L.
template <typename Matrix>
void solve_few(const Eigen::Ref<const Eigen::MatrixXd>& L, Matrix& Y) {
  for (Eigen::Index k = 0; k < Y.cols(); ++k) {
    for (Eigen::Index l = 0; l < k; ++l) Y.col(k) -= L(k, l) * Y.col(l);
    Y.col(k) /= L(k, k);
  }
}

/// P - Y Y^T in the place of P's lower triangle, for the columns of Y from `first` on.
template <int columns, typename Matrix, typename Symmetric>
void subtract_square(const Matrix& Y, Eigen::Index first, Symmetric& P) {
  const Eigen::Index n = P.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto term = [&](Eigen::Index k) { return Y(j, first + k) * Y.col(first + k).tail(n - j); };
    auto below = P.col(j).tail(n - j);
    if constexpr (columns == 4) below -= (term(0) + term(1)) + (term(2) + term(3));
    if constexpr (columns == 3) below -= term(0) + term(1) + term(2);
    if constexpr (columns == 2) below -= term(0) + term(1);
    if constexpr (columns == 1) below -= term(0);
  }
}

template <typename Matrix, typename Symmetric>
void subtract_square_of_few(const Matrix& Y, Symmetric& P) {
  Eigen::Index k = 0;
  for (; k + 4 <= Y.cols(); k += 4) subtract_square<4>(Y, k, P);
  switch (Y.cols() - k) {
    case 3:
      return subtract_square<3>(Y, k, P);
    case 2:
      return subtract_square<2>(Y, k, P);
    case 1:
      return subtract_square<1>(Y, k, P);
    default:
      return;
  }
}

/// Writes the lower triangle above the diagonal, in blocks: their rows are far apart in memory. A block by way of a
/// matrix of its own goes through registers.
template <typename Symmetric>
void mirror_lower(Symmetric& P) {
  constexpr int b = 4;
  const Eigen::Index n = P.rows();
  const Eigen::Index whole = n - n % b;
  for (Eigen::Index j = 0; j < whole; j += b) {
    for (Eigen::Index i = j + b; i < whole; i += b) {
      const Eigen::Matrix<double, b, b> below = P.template block<b, b>(i, j);
      P.template block<b, b>(j, i) = below.transpose();
    }
    P.template block<b, b>(j, j).template triangularView<Eigen::StrictlyUpper>() =
        P.template block<b, b>(j, j).transpose();
  }
  for (Eigen::Index i = whole; i < n; ++i) P.col(i).head(i) = P.row(i).head(i).transpose();
}

}  // namespace

Covariance::Covariance(int capacity)
    : P_(Eigen::MatrixXd::Zero(capacity, capacity)),
      PHt_(capacity, capacity),
      S_(capacity, capacity),
      considered_(err::calibration_size, err::calibration_size),
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
  // delta + B^T theta is the normal's error in the world, which motion does not touch. So delta changes by -B^T times
  // what theta does: a part of the gyroscope's bias, and noise.
  constexpr int n = err::normal + 2;  // what changes
  const Eigen::Matrix<double, 3, 2> gyro_to_normal = -transition.Phi.block<3, 3>(err::theta, err::b_g).transpose() * B;
  const auto carry = [&](auto& M) {
    carry_columns(transition.Phi, M);
    M.template middleCols<2>(err::normal).noalias() += M.template middleCols<3>(err::b_g).lazyProduct(gyro_to_normal);
  };
  auto P = P_.topLeftCorner(size_, size_);
  carry(P);
  Eigen::Matrix<double, n, n> corner = P.topLeftCorner<n, n>().transpose();
  carry(corner);
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
  const bool few = m <= kFewRows;

  const auto P_seen = P.middleCols(first_column, H.cols());
  if (few) {
    multiply_few(P_seen, H, PHt);
  } else {
    PHt.noalias() = P_seen * H.transpose();
  }
  S.triangularView<Eigen::Lower>() = H * PHt.middleRows(first_column, H.cols());  // the other is not read
  S.diagonal().array() += 1.0;
  auto correction = correction_.head(n);
  correction.setZero();
  Eigen::Ref<Eigen::MatrixXd> factor = S;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(factor);  // in place
  if (llt.info() != Eigen::Success || !residual.allFinite() || !H.allFinite()) return correction;
  z = residual;
  llt.matrixL().solveInPlace(z);
  // Y = P H^T L^-T, in the place of P H^T, so that P H^T S^-1 H P = Y Y^T
  const auto c = considered_count;
  considered_.topLeftCorner(c, c) = P.block(considered_first, considered_first, c, c);
  if (few) {
    solve_few(factor, PHt);
    subtract_square_of_few(PHt, P);
  } else {
    llt.matrixU().solveInPlace<Eigen::OnTheRight>(PHt);
    P.selfadjointView<Eigen::Lower>().rankUpdate(PHt, -1.0);
  }
  mirror_lower(P);
  P.block(considered_first, considered_first, c, c) = considered_.topLeftCorner(c, c);

  correction.noalias() = PHt * z;
  correction.segment(considered_first, c).setZero();
  return correction;
}

}  // namespace ear
