// Pictures of the scene as the vehicle's cameras take them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "ear/calibration.h"
#include "tools/simulator/ground_view.h"
#include "tools/simulator/image_sensor.h"
#include "tools/simulator/materials.h"
#include "tools/simulator/panel_view.h"
#include "tools/simulator/rays.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/tile.h"
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
  // What is known of a sub-picture before any motion.
  struct Pattern {
    PixelRays rays;
    std::vector<RayBox> boxes;  // per tile, row by row
  };
  struct Eye {
    Eigen::Isometry3d T_BC;
    int width = 0, height = 0;
    float focal = 0.0F;  // [px]
    std::vector<Pattern> patterns;
    Lattice lattice;
    cv::Mat vignetting;
  };
  // What is before the camera at the instant of a sub-picture.
  struct View;
  using TileSum = std::array<float, static_cast<std::size_t>(kTile* kTile)>;

  [[nodiscard]] View look(const Eye& eye, const Eigen::Isometry3d& T_WC, std::size_t sub) const;
  void add_tile(const Eye& eye, View& view, std::size_t sub, int left, int top, TileSum& sum) const;
  void shade(const Row& row, float threshold, float* sum) const;

  const Scene& scene_;
  const Appearance& appearance_;
  std::vector<const Texture*> textures_;  // by Row::surface: the panels', the ground's
  std::vector<Eye> eyes_;
};

}  // namespace ear::simulator
