// One term of the sum that is minimised, and what all of them have in common.
#pragma once

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace ear::smoother {

struct Factor {
  std::unique_ptr<ceres::CostFunction> cost;
  std::vector<double*> blocks;
  ceres::LossFunction* loss = nullptr;  ///< of the squared length of the residual; none: the half of it itself
};

/// Writes a derivative as Ceres lays it out, row by row.
template <typename Matrix>
void store(const Matrix& J, double* target) {
  constexpr int layout = Matrix::ColsAtCompileTime == 1 ? Eigen::ColMajor : Eigen::RowMajor;
  Eigen::Map<Eigen::Matrix<double, Matrix::RowsAtCompileTime, Matrix::ColsAtCompileTime, layout>> map(target);
  map = J;
}

}  // namespace ear::smoother
