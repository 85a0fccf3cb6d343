// Pictures of the scene as the vehicle's cameras take them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "ear/calibration.h"
#include "tools/simulator/image_sensor.h"
#include "tools/simulator/materials.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/trajectory.h"

namespace ear::simulator {

/// Ray-casts the scene: each picture is the mean of a few sub-pictures, each at its own instant of the exposure (motion
/// blur) and with its own offset within the pixel (anti-aliasing). Rays go through the lens exactly as calibrated.
/// Const and without state: threads may share one.
class Renderer {
 public:
  /// `scene` and `appearance` must outlive the renderer. Throws std::invalid_argument if they do not belong together.
  Renderer(const Scene& scene, const Appearance& appearance, const std::vector<CameraCalibration>& cameras);

  /// Grey levels (float, before noise) seen by one camera, exposed around time t [s] of the motion.
  [[nodiscard]] cv::Mat render(std::size_t camera, const Trajectory& trajectory, double t,
                               const Exposure& exposure) const;

 private:
  // One ray (x, y, 1) per pixel, in the camera's frame, row by row.
  struct Rays {
    std::vector<float> x, y;
  };
  struct Eye {
    Eigen::Isometry3d T_BC;
    int width = 0, height = 0;
    float focal = 0.0F;      // [px]
    std::vector<Rays> rays;  // per sub-picture
    cv::Mat vignetting;
  };

  void add_sub_picture(const Eye& eye, const Eigen::Isometry3d& T_WC, std::size_t sub, cv::Mat& sum) const;

  const Scene& scene_;
  const Appearance& appearance_;
  std::vector<Eye> eyes_;
};

}  // namespace ear::simulator
