// A lens, with derivatives: from normalized coordinates to pixels, by the models of ear::LensModel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "ear/calibration.h"

namespace ear::calibration {

/// From normalized coordinates to those bent by the lens; k1, k2 and `k`, the rest of CameraCalibration::distortion.
template <typename T, typename Rest>
[[nodiscard]] Eigen::Matrix<T, 2, 1> bent(LensModel lens, const T& k1, const T& k2, const std::array<Rest, 3>& k,
                                          const Eigen::Matrix<T, 2, 1>& xy) {
  const T r2 = xy.squaredNorm();
  if (lens == LensModel::radial_tangential) {
    const T radial = T(1.0) + r2 * (k1 + r2 * (k2 + r2 * k[2]));
    const T cross = xy.x() * xy.y();
    return {xy.x() * radial + 2.0 * k[0] * cross + k[1] * (r2 + T(2.0) * xy.x() * xy.x()),
            xy.y() * radial + k[0] * (r2 + T(2.0) * xy.y() * xy.y()) + 2.0 * k[1] * cross};
  }
  if (!(r2 > 1e-16)) return xy;
  using std::atan;
  using std::sqrt;
  const T r = sqrt(r2);
  const T angle = atan(r);
  const T a2 = angle * angle;
  return xy * (angle * (T(1.0) + a2 * (k1 + a2 * (k2 + a2 * (k[0] + a2 * k[1])))) / r);
}

/// `error`: focal length (relative), principal point [px], k1, k2; of the lens given.
template <typename T>
[[nodiscard]] Eigen::Matrix<T, 2, 1> to_pixel(const CameraCalibration& given, const std::array<T, 5>& error,
                                              const Eigen::Matrix<T, 2, 1>& xy) {
  const auto& k = given.distortion;
  const std::array<double, 3> rest{k[2], k[3], k[4]};
  const Eigen::Matrix<T, 2, 1> by_lens = bent<T>(given.lens, k[0] + error[3], k[1] + error[4], rest, xy);
  const T focal = T(1.0) + error[0];
  return {given.fu * focal * by_lens.x() + given.cu + error[1], given.fv * focal * by_lens.y() + given.cv + error[2]};
}

}  // namespace ear::calibration
