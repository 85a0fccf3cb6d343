#include "smoother/prior_factor.h"

#include <algorithm>
#include <utility>

namespace ear::smoother {
namespace {

std::vector<int> columns_of(const std::vector<PriorBlock>& blocks) {
  std::vector<int> columns;
  int next = 0;
  for (const PriorBlock& block : blocks) {
    columns.push_back(next);
    next += block.step_size();
  }
  return columns;
}

/// Number of the pose that belongs to a motion; -1 for others.
int pose_of(const PriorBlock& motion, const std::vector<PriorBlock>& blocks) {
  if (motion.kind != BlockKind::motion) return -1;
  const auto same = [&](const PriorBlock& other) { return other.block == motion.body_pose; };
  return static_cast<int>(std::find_if(blocks.begin(), blocks.end(), same) - blocks.begin());
}

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

PriorFactor::PriorFactor(std::vector<PriorBlock> blocks, const Eigen::MatrixXd& J, const Eigen::VectorXd& r0)
    : blocks_(std::move(blocks)), columns_(columns_of(blocks_)), J_(J), r0_(r0) {
  for (const PriorBlock& block : blocks_) {
    pose_of_motion_.push_back(pose_of(block, blocks_));
    mutable_parameter_block_sizes()->push_back(block.size);
  }
  set_num_residuals(static_cast<int>(r0_.size()));
}

bool PriorFactor::Evaluate(double const* const* values, double* residual, double** jacobians) const {
  Eigen::VectorXd e(J_.cols());
  std::vector<Eigen::Vector3d> theta(blocks_.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const PriorBlock& block = blocks_[i];
    if (block.kind != BlockKind::body_pose) continue;
    const Pose now = to_pose(values[i]);
    const Pose then = to_pose(block.value.data());
    theta[i] = log_so3(now.R * then.R.transpose());
    e.segment<3>(columns_[i]) = theta[i];
    e.segment<3>(columns_[i] + 3) = now.p - exp_so3(theta[i]) * then.p;
  }
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const PriorBlock& block = blocks_[i];
    const int at = columns_[i];
    if (block.kind == BlockKind::body_pose) continue;
    const Eigen::Map<const Eigen::VectorXd> now(values[i], block.size);
    if (block.kind == BlockKind::sensor_pose) {
      e.segment<3>(at) = log_so3(to_pose(values[i]).R * to_pose(block.value.data()).R.transpose());
      e.segment<3>(at + 3) = now.tail<3>() - block.value.tail<3>();
      continue;
    }
    e.segment(at, block.size) = now - block.value;
    if (block.kind == BlockKind::motion) {
      const auto pose = static_cast<std::size_t>(pose_of_motion_[i]);
      e.segment<3>(at) = now.head<3>() - exp_so3(theta[pose]) * block.value.head<3>();
    }
  }
  Eigen::Map<Eigen::VectorXd>(residual, r0_.size()) = r0_ + J_ * e;
  if (jacobians == nullptr) return true;

  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (jacobians[i] == nullptr) continue;
    const PriorBlock& block = blocks_[i];
    Eigen::Map<RowMajorMatrix> J(jacobians[i], J_.rows(), block.size);
    J.setZero();
    J.leftCols(block.step_size()) = J_.middleCols(columns_[i], block.step_size());
    if (block.kind == BlockKind::sensor_pose) {
      const Eigen::Vector3d phi = e.segment<3>(columns_[i]);
      J.leftCols<3>() = (J.leftCols<3>() * left_jacobian_inverse(phi)).eval();
    }
    if (block.kind != BlockKind::body_pose) continue;
    // A step turns Exp(theta) p0 and Exp(theta) v0 along.
    const Eigen::Matrix3d E = exp_so3(theta[i]);
    J.leftCols<3>() = (J.leftCols<3>() * left_jacobian_inverse(theta[i])).eval();
    J.leftCols<3>() += J_.middleCols<3>(columns_[i] + 3) * skew(E * block.value.tail<3>());
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      if (pose_of_motion_[k] != static_cast<int>(i)) continue;
      J.leftCols<3>() += J_.middleCols<3>(columns_[k]) * skew(E * blocks_[k].value.head<3>());
    }
  }
  return true;
}

/// p + dp = Exp(theta) p + rho: dp = rho - [p]x theta; v likewise.
void to_invariant(Eigen::MatrixXd& J, const std::vector<PriorBlock>& blocks, const std::vector<int>& columns) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (blocks[i].kind == BlockKind::body_pose) {
      const Eigen::Vector3d p = blocks[i].value.tail<3>();
      J.middleCols<3>(columns[i]) -= J.middleCols<3>(columns[i] + 3) * skew(p);
    } else if (blocks[i].kind == BlockKind::motion) {
      const Eigen::Vector3d v = blocks[i].value.head<3>();
      const auto pose = static_cast<std::size_t>(pose_of(blocks[i], blocks));
      J.middleCols<3>(columns[pose]) -= J.middleCols<3>(columns[i]) * skew(v);
    }
  }
}

}  // namespace ear::smoother
