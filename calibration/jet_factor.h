// A term of the sum whose derivatives come by automatic differentiation. A pose block (7) is given to the model as
// rotation and position, and differentiated by the step of the smoother's poses: R = Exp(theta) R^, p = p^ + dp. All
// other blocks are plain numbers.
#pragma once

#include <ceres/jet.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>
#include <utility>

#include "smoother/blocks.h"

namespace ear::calibration {

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

/// The values of one block.
template <typename T>
struct BlockValues {
  std::array<T, 12> v{};  ///< of a pose: rotation row by row, position

  [[nodiscard]] Matrix3<T> R() const { return Eigen::Map<const Eigen::Matrix<T, 3, 3, Eigen::RowMajor>>(v.data()); }
  [[nodiscard]] Vector3<T> p() const { return Eigen::Map<const Vector3<T>>(v.data() + 9); }
  [[nodiscard]] Vector3<T> vector3(std::size_t first) const { return {v[first], v[first + 1], v[first + 2]}; }
};

/// `Model` has template <T> void operator()(const std::array<BlockValues<T>, n>&, T* residual) const.
template <typename Model, int kResiduals, int... kBlocks>
class JetFactor final : public ceres::SizedCostFunction<kResiduals, kBlocks...> {
 public:
  explicit JetFactor(Model model) : model_(std::move(model)) {}

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  static constexpr std::size_t kCount = sizeof...(kBlocks);
  static constexpr std::array<int, kCount> kSizes{kBlocks...};
  static constexpr int steps(int size) { return size == 7 ? 6 : size; }
  using Jet = ceres::Jet<double, (steps(kBlocks) + ...)>;

  static void store(const std::array<Jet, kResiduals>& r, int first, int size, double* jacobian) {
    for (int row = 0; row < kResiduals; ++row) {
      for (int k = 0; k < size; ++k) {
        jacobian[row * size + k] = k < steps(size) ? r[static_cast<std::size_t>(row)].v[first + k] : 0.0;
      }
    }
  }

  template <typename T>
  static std::array<BlockValues<T>, kCount> values(double const* const* blocks) {
    std::array<BlockValues<T>, kCount> result;
    int first = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      if (kSizes[i] == 7) {
        set_pose(blocks[i], first, result[i]);
      } else {
        for (int k = 0; k < kSizes[i]; ++k) {
          T& value = result[i].v[static_cast<std::size_t>(k)];
          value = T(blocks[i][k]);
          if constexpr (std::is_same_v<T, Jet>) value.v[first + k] = 1.0;
        }
      }
      first += steps(kSizes[i]);
    }
    return result;
  }

  template <typename T>
  static void set_pose(const double* block, int first, BlockValues<T>& result) {
    const Pose pose = smoother::to_pose(block);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        T& value = result.v[static_cast<std::size_t>(3 * row + column)];
        value = T(pose.R(row, column));
        if constexpr (std::is_same_v<T, Jet>) {
          for (int k = 0; k < 3; ++k) value.v[first + k] = Eigen::Vector3d::Unit(k).cross(pose.R.col(column))(row);
        }
      }
      T& p = result.v[static_cast<std::size_t>(9 + row)];
      p = T(pose.p(row));
      if constexpr (std::is_same_v<T, Jet>) p.v[first + 3 + row] = 1.0;
    }
  }

  Model model_;
};

// Flattened: left to itself the compiler calls a function for each operation on a jet. Outside of the class, so that
// only one file needs to compile it where it is costly (models.h).
template <typename Model, int kResiduals, int... kBlocks>
[[gnu::flatten]] bool JetFactor<Model, kResiduals, kBlocks...>::Evaluate(double const* const* blocks, double* residual,
                                                                         double** jacobians) const {
  if (jacobians == nullptr) {
    model_(values<double>(blocks), residual);
    return true;
  }
  std::array<Jet, kResiduals> r;
  model_(values<Jet>(blocks), r.data());
  for (int row = 0; row < kResiduals; ++row) residual[row] = r[static_cast<std::size_t>(row)].a;
  int first = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (jacobians[i] != nullptr) store(r, first, kSizes[i], jacobians[i]);
    first += steps(kSizes[i]);
  }
  return true;
}

}  // namespace ear::calibration
