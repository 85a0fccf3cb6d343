// What is known of some blocks from factors that are gone: r_p in (1). Linearized once; its error is the filter's
// right-invariant one, in which the directions that nothing can see (yaw, position) do not depend on the state: other
// blocks may be linearized anew around it without it seeming to know them.
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <vector>

#include "smoother/blocks.h"

namespace ear::smoother {

enum class BlockKind { body_pose, motion, sensor_pose, additive };

/// A block of the prior, and its value where the prior was linearized.
struct PriorBlock {
  BlockKind kind = BlockKind::additive;
  double* block = nullptr;
  int size = 0;                 ///< of the block
  double* body_pose = nullptr;  ///< kind motion: the same frame's pose, which is a block of the prior too
  Eigen::VectorXd value = {};   ///< `size` doubles

  [[nodiscard]] int step_size() const {
    return kind == BlockKind::body_pose || kind == BlockKind::sensor_pose ? kPoseStep : size;
  }
};

/// r0 + J e, whitened. e stacks the errors of the blocks: body_pose (theta, rho): R = Exp(theta) R0,
/// p = Exp(theta) p0 + rho; motion (nu, b_g, b_a): v = Exp(theta) v0 + nu; sensor_pose (phi, p): R = Exp(phi) R0,
/// additive; all others additive.
class PriorFactor final : public ceres::CostFunction {
 public:
  /// `J`: rows x sum of step sizes.
  PriorFactor(std::vector<PriorBlock> blocks, const Eigen::MatrixXd& J, const Eigen::VectorXd& r0);
  bool Evaluate(double const* const* values, double* residual, double** jacobians) const override;

  [[nodiscard]] const std::vector<PriorBlock>& blocks() const { return blocks_; }

 private:
  std::vector<PriorBlock> blocks_;
  std::vector<int> columns_;         ///< first column of each block
  std::vector<int> pose_of_motion_;  ///< number of the pose block that belongs to it, or -1
  Eigen::MatrixXd J_;
  Eigen::VectorXd r0_;
};

/// Derivative of the invariant error by the steps of the blocks, where it is zero: columns of `J` by steps become
/// columns by invariant errors. `columns`: first column of each block in J.
void to_invariant(Eigen::MatrixXd& J, const std::vector<PriorBlock>& blocks, const std::vector<int>& columns);

}  // namespace ear::smoother
