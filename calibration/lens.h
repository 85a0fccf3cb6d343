// A lens, with derivatives: from normalized coordinates to pixels, by the models of ear::LensModel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "ear/calibration.h"

namespace ear::calibration {

/// `error`: focal length (relative), principal point [px], k1, k2; of the lens given.
template <typename T>
[[nodiscard]] Eigen::Matrix<T, 2, 1> to_pixel(const CameraCalibration& given, const std::array<T, 5>& error,
                                              const Eigen::Matrix<T, 2, 1>& xy) {
  const auto& k = given.distortion;
  const T k1 = k[0] + error[3];
  const T k2 = k[1] + error[4];
  const T r2 = xy.squaredNorm();
  Eigen::Matrix<T, 2, 1> bent;
  if (given.lens == LensModel::radial_tangential) {
    const T radial = T(1.0) + r2 * (k1 + r2 * (k2 + r2 * k[4]));
    const T cross = xy.x() * xy.y();
    bent << xy.x() * radial + T(2.0 * k[2]) * cross + k[3] * (r2 + T(2.0) * xy.x() * xy.x()),
        xy.y() * radial + k[2] * (r2 + T(2.0) * xy.y() * xy.y()) + T(2.0 * k[3]) * cross;
  } else {
    using std::atan;
    using std::sqrt;
    T scale = T(1.0);
    if (r2 > 1e-16) {
      const T r = sqrt(r2);
      const T angle = atan(r);
      const T a2 = angle * angle;
      scale = angle * (T(1.0) + a2 * (k1 + a2 * (k2 + a2 * (k[2] + a2 * k[3])))) / r;
    }
    bent = xy * scale;
  }
  const T focal = T(1.0) + error[0];
  return {given.fu * focal * bent.x() + given.cu + error[1], given.fv * focal * bent.y() + given.cv + error[2]};
}

}  // namespace ear::calibration
