// Factors against numerical differentiation, one block at a time. Comes first: Ceres brings a CHECK of its own along.
#pragma once

#include <ceres/ceres.h>
#include <glog/logging.h>
#undef CHECK

#include <doctest/doctest.h>

#undef CHECK
#define CHECK(...) DOCTEST_CHECK(__VA_ARGS__)

#include <random>
#include <vector>

#include "smoother/blocks.h"
#include "smoother/factor.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"

namespace ear::smoother::test {

/// `values`: of each block, 7 doubles are a pose.
inline Eigen::VectorXd residual(const ceres::CostFunction& cost, const std::vector<Eigen::VectorXd>& values) {
  std::vector<const double*> blocks;
  for (const Eigen::VectorXd& value : values) blocks.push_back(value.data());
  Eigen::VectorXd r(cost.num_residuals());
  REQUIRE(cost.Evaluate(blocks.data(), r.data(), nullptr));
  return r;
}

/// Of all blocks with seven numbers only a pose begins with a unit quaternion.
inline bool is_pose(const Eigen::VectorXd& value) {
  return value.size() == 7 && std::abs(value.head<4>().norm() - 1.0) < 1e-9;
}

inline Eigen::VectorXd stepped(const Eigen::VectorXd& value, const Eigen::VectorXd& step) {
  if (!is_pose(value)) return value + step;
  Eigen::VectorXd result(7);
  PoseManifold{}.Plus(value.data(), step.data(), result.data());
  return result;
}

/// Derivative by the steps of block `which`.
inline Eigen::MatrixXd jacobian(const ceres::CostFunction& cost, const std::vector<Eigen::VectorXd>& values,
                                std::size_t which) {
  std::vector<const double*> blocks;
  for (const Eigen::VectorXd& value : values) blocks.push_back(value.data());
  Eigen::VectorXd r(cost.num_residuals());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> J(r.size(), values[which].size());
  std::vector<double*> jacobians(values.size(), nullptr);
  jacobians[which] = J.data();
  REQUIRE(cost.Evaluate(blocks.data(), r.data(), jacobians.data()));
  return is_pose(values[which]) ? Eigen::MatrixXd(J.leftCols(6)) : Eigen::MatrixXd(J);
}

inline void check_factor(const ceres::CostFunction& cost, const std::vector<Eigen::VectorXd>& values,
                         double tolerance = 1e-5) {
  REQUIRE(values.size() == cost.parameter_block_sizes().size());
  for (std::size_t which = 0; which < values.size(); ++which) {
    CAPTURE(which);
    ear::test::check_jacobian(
        [&](const Eigen::VectorXd& step) {
          std::vector<Eigen::VectorXd> moved = values;
          moved[which] = stepped(values[which], step);
          return residual(cost, moved);
        },
        jacobian(cost, values, which), tolerance);
  }
}

inline Eigen::VectorXd block(const Pose& pose) {
  const PoseBlock values = to_block(pose);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), 7);
}

inline Eigen::VectorXd random_values(std::mt19937_64& rng, int size, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  Eigen::VectorXd values(size);
  for (double& value : values) value = normal(rng);
  return values;
}

}  // namespace ear::smoother::test
