#include "tools/simulator/rays.h"

#include <algorithm>

#include "tools/simulator/lanes.h"
#include "tools/simulator/lens.h"

namespace ear::simulator {

PixelRays make_rays(const CameraCalibration& camera, const Eigen::Vector2d& offset) {
  const auto pixels = static_cast<std::size_t>(camera.width * camera.height);
  PixelRays rays{camera.width, std::vector<float>(pixels), std::vector<float>(pixels)};
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double side = (u + v) % 2 == 0 ? 1.0 : -1.0;
      const Eigen::Vector2f ray = to_ray(camera, Eigen::Vector2d(u, v) + side * offset).cast<float>();
      rays.x[rays.index(u, v)] = ray.x();
      rays.y[rays.index(u, v)] = ray.y();
    }
  }
  return rays;
}

Lattice make_lattice(const CameraCalibration& camera) {
  Lattice lattice;
  lattice.columns = (camera.width / kCell + 1 + kLanes - 1) / kLanes * kLanes;
  lattice.rows = camera.height / kCell + 1;
  for (int j = 0; j < lattice.rows; ++j) {
    for (int i = 0; i < lattice.columns; ++i) {
      const int column = std::min(i, camera.width / kCell);
      const Eigen::Vector2f ray = to_ray(camera, {kCell * column - 0.5, kCell * j - 0.5}).cast<float>();
      lattice.x.push_back(ray.x());
      lattice.y.push_back(ray.y());
    }
  }
  return lattice;
}

}  // namespace ear::simulator
