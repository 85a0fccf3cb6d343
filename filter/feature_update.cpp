#include "filter/feature_update.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace ear {
namespace {

constexpr int kCalibration = 12;            // columns of the cameras' poses; the time offset acts through the clones
constexpr double kNegligiblePivot = 1e-11;  // of the sum before projection: rounding, not information

/// First column of a clone, counted from err::camera.
constexpr int clone_column(int clone) { return err::clone(clone) - err::camera; }

}  // namespace

void camera_poses(const State& x, std::vector<CameraPose>& poses) {
  const Pose& T_BC0 = x.camera.T_BC0;
  const Eigen::Matrix3d R_BC1 = T_BC0.R * x.camera.T_C0C1.R;
  const Eigen::Vector3d p_BC1 = T_BC0.R * x.camera.T_C0C1.p + T_BC0.p;
  poses.resize(2 * x.clones.size());
  for (std::size_t i = 0; i < x.clones.size(); ++i) {
    const Pose& T_WB = x.clones[i].T_WB;
    poses[2 * i] = {(T_WB.R * T_BC0.R).transpose(), T_WB.p + T_WB.R * T_BC0.p};
    poses[2 * i + 1] = {(T_WB.R * R_BC1).transpose(), T_WB.p + T_WB.R * p_BC1};
  }
}

LinearizedObservation linearize_observation(const State& x, int clone, int camera, const InverseDepthPoint& point,
                                            const Eigen::Vector2d& uv) {
  const Pose& T_WB = x.clones[static_cast<std::size_t>(clone)].T_WB;
  const Pose& T_BC0 = x.camera.T_BC0;
  const Pose& T_C0C1 = x.camera.T_C0C1;
  const double s = point.inverse_depth;  // all points below are times s: finite at infinity
  const Eigen::Vector3d f_W = point.scaled_W();
  const Eigen::Vector3d f_B = T_WB.R.transpose() * (f_W - s * T_WB.p);
  const Eigen::Matrix3d R_C0B = T_BC0.R.transpose();
  const Eigen::Vector3d from_C0_B = f_B - s * T_BC0.p;
  const Eigen::Vector3d f_C0 = R_C0B * from_C0_B;
  const Eigen::Vector3d from_C1_C0 = f_C0 - s * T_C0C1.p;
  const Eigen::Vector3d h = camera == 0 ? f_C0 : Eigen::Vector3d(T_C0C1.R.transpose() * from_C1_C0);

  const double w = 1.0 / h.z();
  LinearizedObservation z;
  z.clone = clone;
  z.residual = uv - h.head<2>() * w;
  Eigen::Matrix<double, 2, 3> J_C;  // d uv / d h
  J_C << w, 0.0, -h.x() * w * w, 0.0, w, -h.y() * w * w;
  const Eigen::Matrix<double, 2, 3> J_C0 = camera == 0 ? J_C : Eigen::Matrix<double, 2, 3>(J_C * T_C0C1.R.transpose());
  const Eigen::Matrix<double, 2, 3> J_B = J_C0 * R_C0B;
  const Eigen::Matrix<double, 2, 3> J_W = J_B * T_WB.R.transpose();

  // R^T (f - p) with R = Exp(theta) R^, p = Exp(theta) p^ + rho: the point's own error is all that f_W carries.
  z.H_clone.leftCols<3>() = J_W * skew(f_W);
  z.H_clone.rightCols<3>() = -s * J_W;
  z.H_f = J_W;
  z.H_calibration.leftCols<3>() = J_B * skew(from_C0_B);
  z.H_calibration.middleCols<3>(3) = -s * J_B;
  if (camera == 0) {
    z.H_calibration.rightCols<6>().setZero();
  } else {
    z.H_calibration.middleCols<3>(6) = J_C0 * skew(from_C1_C0);
    z.H_calibration.rightCols<3>() = -s * J_C0;
  }
  return z;
}

FeatureInformation::FeatureInformation(int max_clones, int max_features) {
  const int size = err::clone(max_clones) - err::camera;
  A_.resize(size, size);
  H_.resize(size, size);
  W_.resize(size, 3 * max_features);
  b_.resize(size);
  r_.resize(size);
  feature_A_.resize(size, size);
  feature_b_.resize(size);
  gate_A_.resize(size, size);
  gate_M_.resize(size, size);
}

void FeatureInformation::start(int error_size) {
  size_ = error_size - err::camera;
  assert(size_ <= A_.rows());
  features_ = 0;
  rows_ = 0;
  A_.topLeftCorner(size_, size_).setZero();
  b_.head(size_).setZero();
}

bool FeatureInformation::add_gated(const std::vector<LinearizedObservation>& observations, double sigma, double huber,
                                   const Eigen::Ref<const Eigen::MatrixXd>& P, double threshold) {
  if (3 * (features_ + 1) > W_.cols()) return false;

  // Huber weights, and with them whitening.
  const auto weight = [&](const LinearizedObservation& z) {
    const double distance = z.residual.norm() / sigma;
    return (distance > huber ? huber / distance : 1.0) / (sigma * sigma);
  };

  // The feature's own block first: it alone decides, most of the time, about the gate.
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  double cost = 0.0;
  for (const LinearizedObservation& z : observations) {
    const double w = weight(z);
    V.noalias() += w * z.H_f.transpose() * z.H_f;
    v.noalias() += w * z.H_f.transpose() * z.residual;
    cost += w * z.residual.squaredNorm();
  }
  V.diagonal().array() += 1e-13 * V.trace();  // a point at infinity has no depth to project out
  const Eigen::LLT<Eigen::Matrix3d> V_llt(V);
  if (V_llt.info() != Eigen::Success || !std::isfinite(cost)) return false;
  const Eigen::Vector3d Lv = V_llt.matrixL().solve(v);

  feature_A_.topLeftCorner(size_, size_).setZero();
  feature_b_.head(size_).setZero();
  auto W = W_.block(0, 3 * features_, size_, 3);
  W.setZero();
  for (const LinearizedObservation& z : observations) {
    const double w = weight(z);
    const int at = clone_column(z.clone);
    const Eigen::Matrix<double, kCalibration, 2> Hw_cal = w * z.H_calibration.transpose();
    const Eigen::Matrix<double, err::clone_size, 2> Hw_clone = w * z.H_clone.transpose();
    feature_A_.topLeftCorner<kCalibration, kCalibration>().noalias() += Hw_cal * z.H_calibration;
    feature_A_.block<err::clone_size, kCalibration>(at, 0).noalias() += Hw_clone * z.H_calibration;
    feature_A_.block<err::clone_size, err::clone_size>(at, at).noalias() += Hw_clone * z.H_clone;
    feature_b_.head<kCalibration>().noalias() += Hw_cal * z.residual;
    feature_b_.segment<err::clone_size>(at).noalias() += Hw_clone * z.residual;
    W.topRows<kCalibration>().noalias() += Hw_cal * z.H_f;
    W.middleRows<err::clone_size>(at).noalias() += Hw_clone * z.H_f;
  }
  V_llt.matrixU().solveInPlace<Eigen::OnTheRight>(W);
  feature_b_.head(size_).noalias() -= W * Lv;

  // With P = 0 the statistic is largest: who passes then passes anyway, and the full test is not needed.
  const double residual_cost = cost - Lv.squaredNorm();
  if (residual_cost > threshold) {
    auto A = gate_A_.topLeftCorner(size_, size_);
    A = feature_A_.topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>();
    A.noalias() -= W * W.transpose();
    if (chi_squared(P, residual_cost) > threshold) return false;
  }
  A_.topLeftCorner(size_, size_).triangularView<Eigen::Lower>() += feature_A_.topLeftCorner(size_, size_);
  b_.head(size_) += feature_b_.head(size_);
  ++features_;
  return true;
}

/// r^T (H P H^T + I)^-1 r = r^T r - b^T P (I + A P)^-1 b over the camera's part, by the matrix inversion lemma.
double FeatureInformation::chi_squared(const Eigen::Ref<const Eigen::MatrixXd>& P, double residual_cost) {
  const auto P_cc = P.block(err::camera, err::camera, size_, size_);
  auto M = gate_M_.topLeftCorner(size_, size_);
  M.noalias() = gate_A_.topLeftCorner(size_, size_) * P_cc;
  M.diagonal().array() += 1.0;
  const Eigen::VectorXd b = feature_b_.head(size_);
  const Eigen::VectorXd x = M.partialPivLu().solve(b);
  return residual_cost - b.dot(P_cc * x);
}

void FeatureInformation::compress() {
  rows_ = 0;
  if (features_ == 0) return;
  auto A = A_.topLeftCorner(size_, size_);
  const Eigen::VectorXd before = A.diagonal();
  A.selfadjointView<Eigen::Lower>().rankUpdate(W_.topLeftCorner(size_, 3 * features_), -1.0);

  // A = U^T U by Cholesky; the rows of U and U^-T b are the measurement. A is singular (yaw and position are free,
  // calibration is seen in part): a pivot lost in rounding says nothing, and its row is left out.
  auto b = b_.head(size_);
  for (int j = 0; j < size_; ++j) {
    const double pivot = A(j, j);
    if (pivot <= kNegligiblePivot * before(j)) continue;
    const int rest = size_ - j - 1;
    const double root = std::sqrt(pivot);
    auto u = A.col(j).tail(rest);
    u /= root;
    H_.row(rows_).head(j).setZero();
    H_(rows_, j) = root;
    H_.row(rows_).segment(j + 1, rest) = u.transpose();
    r_(rows_) = b(j) / root;
    b.tail(rest) -= r_(rows_) * u;
    A.bottomRightCorner(rest, rest).selfadjointView<Eigen::Lower>().rankUpdate(u, -1.0);
    ++rows_;
  }
}

}  // namespace ear
