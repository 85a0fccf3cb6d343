// Is the cameras' clock off? Images that were taken later than their stamps say show another turn than the gyroscope:
// by the angular acceleration times that time. docs/filter.md, "Gaps and jumps".
#pragma once

#include <Eigen/Core>
#include <optional>

#include "filter/sources/seen_turn.h"

namespace ear {

class ClockExcess {
 public:
  void add(const SeenTurn& turn);

  /// By how much later the images seem to be taken than is thought [s], and the variance of that.
  struct Offset {
    double value = 0.0, variance = 0.0;
  };
  /// Nothing as long as too little was seen.
  [[nodiscard]] std::optional<Offset> offset() const;

  /// By how much the clock is off [s]; 0 where noise or what the state does not know of it, of variance `known` [s^2],
  /// may explain it, or too little was seen. What was found is forgotten.
  double take(double known);

 private:
  using Vector4 = Eigen::Matrix<double, 4, 1>;
  using Matrix34 = Eigen::Matrix<double, 3, 4>;
  /// Over the last moments, products of: what explains a turn, which is a constant and the rate; the angular
  /// acceleration; the turn beyond the gyroscope's.
  struct Sums {
    double weight = 0.0;
    Eigen::Matrix4d usual = Eigen::Matrix4d::Zero();
    Matrix34 accel_usual = Matrix34::Zero(), beyond_usual = Matrix34::Zero();
    double accel_accel = 0.0, accel_beyond = 0.0, beyond_beyond = 0.0;
  };

  Sums sums_;
  double span_ = 0.0;  ///< [s] of the sums
  SeenTurn last_, before_;
  int in_a_row_ = 0;
};

}  // namespace ear
