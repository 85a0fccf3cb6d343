// The pictures of a simulation: the scene, what is before the lenses, the faults of light and cameras, the sensor.
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "tools/simulator/camera_faults.h"
#include "tools/simulator/image_sensor.h"
#include "tools/simulator/materials.h"
#include "tools/simulator/rays.h"
#include "tools/simulator/renderer.h"
#include "tools/simulator/simulation.h"
#include "tools/simulator/texture.h"

namespace ear::simulator {

/// Whether what this camera sees in this exposure differs from what it would see without faults.
[[nodiscard]] bool changed_by_faults(const Simulation& simulation, const Shot& shot);

/// Const: threads may share one.
class PictureMaker {
 public:
  /// `simulation` must outlive it.
  explicit PictureMaker(const Simulation& simulation);

  /// The picture that a camera (0 left, 1 right) shows for an exposure (Frame::exposure). 8-bit grey.
  [[nodiscard]] cv::Mat make(const Shot& shot) const;

 private:
  const Simulation& simulation_;
  Appearance appearance_;
  Renderer renderer_;
  ImageSensor sensor_;
  std::vector<Texture> people_;  // one per passer-by
  std::optional<Texture> board_;
  std::vector<cv::Mat> brightness_;  // per camera
  std::vector<PixelRays> rays_;      // per camera, through the pixels' centres
};

}  // namespace ear::simulator
