#include "filter/sources/cameras/feature_update.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "filter/ekf/kernel_matrix.h"

namespace ear {
namespace {

/// First columns of a clone and of a lens, counted from err::camera; the cameras' poses come first. The time offset
/// acts through the clones.
constexpr int clone_column(int clone) { return err::clone(clone) - err::camera; }
constexpr int lens_column(int camera) { return err::lens(camera) - err::camera; }

/// The rows of which A = H^T H and b = H^T r are the sums: Cholesky with diagonal pivoting, row by row. A, of which
/// only the lower triangle is read, is singular (yaw and position are free, calibration is seen in part). The largest
/// pivot against `scale` comes first, so that rounding does not grow; one lost in rounding adds nothing, and ends it.
/// Without the pivoting rounding makes up rows, and once in some ten thousand frames one that moves the estimate by ten
/// sigmas. b is overwritten; `pivots` is scratch; all three vectors have room for whole groups of eight.
void rows_from_sums(const FilterKernels& kernels, const Eigen::MatrixXd& A, int size, Eigen::VectorXd& b,
                    Eigen::VectorXd& pivots, Eigen::VectorXd& scale, double negligible, WhitenedRows& rows) {
  pivots.head(size) = A.diagonal().head(size);
  const int beyond = rounded_up(size) - size;  // never the largest
  pivots.segment(size, beyond).setZero();
  scale.segment(size, beyond).setOnes();
  rows.count = kernels.pivoted_rows(readable(A), size, b.data(), pivots.data(), scale.data(), negligible,
                                    writable(rows.H_transposed), rows.r.data());
}

}  // namespace

void camera_poses(const State& x, std::vector<CameraPose>& poses) {
  const Pose& T_BC0 = x.camera.T_BC0;
  const Pose T_BC1 = T_BC0 * x.camera.T_C0C1;
  poses.resize(2 * x.clones.size());
  for (std::size_t i = 0; i < x.clones.size(); ++i) {
    const Pose T_WC0 = x.clones[i].T_WB * T_BC0;
    const Pose T_WC1 = x.clones[i].T_WB * T_BC1;
    poses[2 * i] = {T_WC0.R.transpose(), T_WC0.p};
    poses[2 * i + 1] = {T_WC1.R.transpose(), T_WC1.p};
  }
}

LinearizedObservation linearize_observation(const State& x, int clone, int camera, const InverseDepthPoint& point,
                                            const Eigen::Vector2d& uv) {
  const Clone& seen_from = x.clones[static_cast<std::size_t>(clone)];
  LinearizedObservation z = linearize_observation(seen_from.T_WB, x.camera, camera, point, uv);
  z.clone = clone;
  z.noise = seen_from.feature_noise;
  z.weight = seen_from.weight;
  return z;
}

LinearizedObservation linearize_observation(const Pose& T_WB, const CameraState& cameras, int camera,
                                            const InverseDepthPoint& point, const Eigen::Vector2d& uv) {
  const Pose& T_BC0 = cameras.T_BC0;
  const Pose& T_C0C1 = cameras.T_C0C1;
  const double s = point.inverse_depth;  // all points below are times s: finite at infinity
  const Eigen::Vector3d f_W = point.scaled_W();
  const Eigen::Vector3d f_B = T_WB.R.transpose() * (f_W - s * T_WB.p);
  const Eigen::Matrix3d R_C0B = T_BC0.R.transpose();
  const Eigen::Vector3d from_C0_B = f_B - s * T_BC0.p;
  const Eigen::Vector3d f_C0 = R_C0B * from_C0_B;
  const Eigen::Vector3d from_C1_C0 = f_C0 - s * T_C0C1.p;
  const Eigen::Vector3d h = camera == 0 ? f_C0 : Eigen::Vector3d(T_C0C1.R.transpose() * from_C1_C0);

  const Eigen::Vector2d projected = h.hnormalized();
  const LensError& lens = cameras.lens_error[static_cast<std::size_t>(camera)];
  const double w = (1.0 + lens.focal_length) / h.z();
  LinearizedObservation z;
  z.camera = camera;
  z.residual = uv - lens.measured(projected);
  Eigen::Matrix<double, 2, 3> J_C;  // d uv / d h
  J_C << w, 0.0, -w * projected.x(), 0.0, w, -w * projected.y();
  const Eigen::Matrix<double, 2, 3> J_C0 = camera == 0 ? J_C : Eigen::Matrix<double, 2, 3>(J_C * T_C0C1.R.transpose());
  const Eigen::Matrix<double, 2, 3> J_B = J_C0 * R_C0B;
  const Eigen::Matrix<double, 2, 3> J_W = J_B * T_WB.R.transpose();

  // R^T (f - p) with R = Exp(theta) R^, p = Exp(theta) p^ + rho: the point's own error is all that f_W carries.
  z.H_clone.leftCols<3>() = J_W * skew(f_W);
  z.H_clone.rightCols<3>() = -s * J_W;
  z.H_f = J_W;
  z.H_poses.leftCols<3>() = J_B * skew(from_C0_B);
  z.H_poses.middleCols<3>(3) = -s * J_B;
  if (camera == 0) {
    z.H_poses.rightCols<6>().setZero();
  } else {
    z.H_poses.middleCols<3>(6) = J_C0 * skew(from_C1_C0);
    z.H_poses.rightCols<3>() = -s * J_C0;
  }
  z.H_lens << projected, Eigen::Matrix2d::Identity();
  return z;
}

FeatureInformation::FeatureInformation(int max_clones, int max_features, Kernels kernels)
    : kernels_(filter_kernels(kernels)) {
  const int size = err::clone(max_clones) - err::camera;
  for (Eigen::MatrixXd* const matrix :
       {&A_, &gate_A_, &gate_PHt_, &H_, &rows_.H_transposed, &gate_rows_.H_transposed}) {
    matrix->setZero(stride_for(size), rounded_up(size));
  }
  for (Eigen::VectorXd* const vector : {&b_, &gate_b_, &scale_, &pivots_, &rows_.r, &gate_rows_.r}) {
    vector->setZero(rounded_up(size));
  }
  W_.setZero(stride_for(size), 3 * max_features);
  weights_.reserve(2 * static_cast<std::size_t>(max_clones));
}

void FeatureInformation::start(int error_size) {
  size_ = error_size - err::camera;
  assert(size_ <= A_.cols());
  features_ = 0;
  rows_.count = 0;
  A_.topLeftCorner(rounded_up(size_), rounded_up(size_)).setZero();
  b_.head(size_).setZero();
}

/// A feature in doubt, of a camera that weighs little, has to fit by the noise of its image all the same: what moves in
/// view moves alike in many features, and does not average out.
bool FeatureInformation::add(const std::vector<LinearizedObservation>& observations, double sigma, double huber,
                             const Eigen::Ref<const Eigen::MatrixXd>& P, const Gate& gate) {
  const int dof = 2 * static_cast<int>(observations.size()) - 3;
  if (dof <= 0 || 3 * (features_ + 1) > W_.cols()) return false;
  std::optional<Projected> own = project(observations, sigma, huber, false);
  if (!own) return false;
  // With P = 0 the statistic is largest: who passes then passes anyway, and the full test is not needed.
  if (!gate.fits(own->residual_cost, 1.0, dof) && !gate.fits(chi_squared(observations, *own, P), 1.0, dof)) {
    return false;
  }
  const auto in_doubt = [](const LinearizedObservation& z) { return z.weight < 1.0; };
  if (std::any_of(observations.begin(), observations.end(), in_doubt)) {
    own = project(observations, sigma, huber, true);
    if (!own) return false;
  }
  sum_up(observations, own->Lv, A_, b_);
  ++features_;
  return true;
}

/// The feature's own block, which alone decides, most of the time, about the gate; the next of W_ becomes its share of
/// the columns.
std::optional<FeatureInformation::Projected> FeatureInformation::project(
    const std::vector<LinearizedObservation>& observations, double sigma, double huber, bool by_score) {
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  double cost = 0.0;
  weights_.clear();
  for (const LinearizedObservation& z : observations) {
    const double sigma_z = sigma * z.noise;
    const double distance = z.residual.norm() / sigma_z;
    const double score = by_score ? z.weight : 1.0;
    const double w = (distance > huber ? huber / distance : 1.0) * score * score / (sigma_z * sigma_z);
    weights_.push_back(w);
    V.noalias() += w * z.H_f.transpose() * z.H_f;
    v.noalias() += w * z.H_f.transpose() * z.residual;
    cost += w * z.residual.squaredNorm();
  }
  V.diagonal().array() += 1e-13 * V.trace();  // a point at infinity has no depth to project out
  const Eigen::LLT<Eigen::Matrix3d> V_llt(V);
  if (V_llt.info() != Eigen::Success || !std::isfinite(cost)) return std::nullopt;
  const Eigen::Vector3d Lv = V_llt.matrixL().solve(v);

  auto W = W_.block(0, 3 * features_, size_, 3);
  W.setZero();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const LinearizedObservation& z = observations[i];
    const Eigen::Matrix<double, 2, 3> weighted_H_f = weights_[i] * z.H_f;
    W.topRows<err::poses_size>().noalias() += z.H_poses.transpose().lazyProduct(weighted_H_f);
    W.middleRows<err::lens_size>(lens_column(z.camera)).noalias() += z.H_lens.transpose().lazyProduct(weighted_H_f);
    W.middleRows<err::clone_size>(clone_column(z.clone)).noalias() += z.H_clone.transpose().lazyProduct(weighted_H_f);
  }
  kernels_.solve({V_llt.matrixLLT().data(), 3}, size_, 3, {W.data(), W.outerStride()});

  return Projected{Lv, cost - Lv.squaredNorm()};
}

/// Adds the feature at hand, the last in W_, to A and b: its own block is not yet projected out of A, but out of b.
void FeatureInformation::sum_up(const std::vector<LinearizedObservation>& observations, const Eigen::Vector3d& Lv,
                                Eigen::MatrixXd& A, Eigen::VectorXd& b) const {
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const LinearizedObservation& z = observations[i];
    const double w = weights_[i];
    const int at = clone_column(z.clone);
    const int lens = lens_column(z.camera);
    const Eigen::Matrix<double, err::poses_size, 2> Hw_poses = w * z.H_poses.transpose();
    const Eigen::Matrix<double, err::lens_size, 2> Hw_lens = w * z.H_lens.transpose();
    const Eigen::Matrix<double, err::clone_size, 2> Hw_clone = w * z.H_clone.transpose();
    A.topLeftCorner<err::poses_size, err::poses_size>().noalias() += Hw_poses.lazyProduct(z.H_poses);
    A.block<err::lens_size, err::poses_size>(lens, 0).noalias() += Hw_lens.lazyProduct(z.H_poses);
    A.block<err::lens_size, err::lens_size>(lens, lens).noalias() += Hw_lens.lazyProduct(z.H_lens);
    A.block<err::clone_size, err::poses_size>(at, 0).noalias() += Hw_clone.lazyProduct(z.H_poses);
    A.block<err::clone_size, err::lens_size>(at, lens).noalias() += Hw_clone.lazyProduct(z.H_lens);
    A.block<err::clone_size, err::clone_size>(at, at).noalias() += Hw_clone.lazyProduct(z.H_clone);
    b.head<err::poses_size>().noalias() += Hw_poses.lazyProduct(z.residual);
    b.segment<err::lens_size>(lens).noalias() += Hw_lens.lazyProduct(z.residual);
    b.segment<err::clone_size>(at).noalias() += Hw_clone.lazyProduct(z.residual);
  }
  b.head(size_).noalias() -= W_.block(0, 3 * features_, size_, 3) * Lv;
}

/// r^T (H P H^T + I)^-1 r over all rows of the feature at hand, the last in W_. What the projected rows do not show of
/// r is noise alone.
double FeatureInformation::chi_squared(const std::vector<LinearizedObservation>& observations, const Projected& own,
                                       const Eigen::Ref<const Eigen::MatrixXd>& P) {
  gate_A_.topLeftCorner(rounded_up(size_), rounded_up(size_)).setZero();
  gate_b_.head(size_).setZero();
  sum_up(observations, own.Lv, gate_A_, gate_b_);
  scale_.head(size_) = gate_A_.diagonal().head(size_);
  kernels_.subtract_square({W_.col(3 * features_).data(), W_.outerStride()}, 3, size_, writable(gate_A_));
  rows_from_sums(kernels_, gate_A_, size_, gate_b_, pivots_, scale_, kRounding, gate_rows_);

  const int rows = gate_rows_.count;
  const auto& Ht = gate_rows_.H_transposed;
  auto r = gate_rows_.r.head(rows);
  const auto P_camera = P.block(err::camera, err::camera, size_, size_);
  for (int k = 0; k < rows; ++k) gate_PHt_.col(k).head(size_).noalias() = P_camera * Ht.col(k).head(size_);
  kernels_.multiply_transposed(readable(Ht), readable(gate_PHt_), rounded_up(size_), rows, writable(gate_A_));
  gate_A_.diagonal().head(rows).array() += 1.0;  // of H P H^T: the sum is read no more
  const double noise_cost = own.residual_cost - r.squaredNorm();
  if (!kernels_.factorize(writable(gate_A_), rows, r.data())) return std::numeric_limits<double>::infinity();
  return noise_cost + r.squaredNorm();
}

void FeatureInformation::compress(double negligible) {
  rows_.count = 0;
  if (features_ == 0) return;
  scale_.head(size_) = A_.diagonal().head(size_);
  kernels_.subtract_square(readable(W_), 3 * features_, size_, writable(A_));
  rows_from_sums(kernels_, A_, size_, b_, pivots_, scale_, negligible, rows_);
  H_.topLeftCorner(rows_.count, size_) = rows_.H_transposed.topLeftCorner(size_, rows_.count).transpose();
}

void FeatureInformation::take_back(const Eigen::Ref<const Eigen::VectorXd>& error) {
  rows_.r.head(rows_.count).noalias() += H() * error;
}

}  // namespace ear
