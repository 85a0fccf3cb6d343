// Outdoors: what stands around the paths of the hillside and of the garden. All in the world frame W.
#include <Eigen/Geometry>
#include <vector>

#include "tools/simulator/scene.h"

namespace ear::simulator {
namespace {

constexpr double kTextureSize = 9.0;   // [m] of the ground, before it repeats
constexpr double kSkyDistance = 70.0;  // [m] from the middle of the scene
constexpr double kSkyHeight = 50.0;
constexpr double kRoots = 0.5;  // [m] that things reach below the ground at their middle, or more on a slope

// An upright box: footprint, height of its lower and upper end above the ground at its middle [m].
struct Building {
  double x, y, size_x, size_y, bottom, top;
  Material material;
};

void add_block(Scene& scene, const Building& block) {
  const double ground = scene.terrain.height(block.x, block.y);
  const double low = ground + (block.bottom > 0.0 ? block.bottom : -kRoots - 0.3 * (block.size_x + block.size_y));
  const double height = ground + block.top - low;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d low_W(block.x - 0.5 * block.size_x, block.y - 0.5 * block.size_y, low);
  const Eigen::Vector3d far_W = low_W + block.size_x * x + block.size_y * y;
  scene.panels.push_back({low_W, x, z, block.size_x, height, block.material});                      // faces -y
  scene.panels.push_back({low_W + block.size_x * x, y, z, block.size_y, height, block.material});   // faces +x
  scene.panels.push_back({far_W, -x, z, block.size_x, height, block.material});                     // faces +y
  scene.panels.push_back({low_W + block.size_y * y, -y, z, block.size_y, height, block.material});  // faces -x
  scene.panels.push_back({low_W + height * z, x, y, block.size_x, block.size_y, block.material});   // the top
  if (block.bottom > 0.0) {
    scene.panels.push_back({low_W + block.size_y * y, x, -y, block.size_x, block.size_y, block.material});
  }
}

void add_tree(Scene& scene, double x, double y, double height) {
  add_block(scene, {x, y, 0.35, 0.35, 0.0, 0.45 * height, Material::wood});
  add_block(scene, {x, y, 0.5 * height, 0.5 * height, 0.35 * height, height, Material::foliage});
}

void add_sky(Scene& scene, const Eigen::Vector2d& middle) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const double d = kSkyDistance;
  const double low = -5.0;
  const auto corner = [&](double dx, double dy, double height) {
    return Eigen::Vector3d(middle.x() + dx, middle.y() + dy, height);
  };
  const double height = kSkyHeight - low;
  scene.panels.push_back({corner(d, -d, low), -x, z, 2.0 * d, height, Material::sky});
  scene.panels.push_back({corner(-d, d, low), x, z, 2.0 * d, height, Material::sky});
  scene.panels.push_back({corner(-d, -d, low), y, z, 2.0 * d, height, Material::sky});
  scene.panels.push_back({corner(d, d, low), -y, z, 2.0 * d, height, Material::sky});
  scene.panels.push_back({corner(-d, d, kSkyHeight), x, -y, 2.0 * d, 2.0 * d, Material::sky});
}

}  // namespace

Scene make_outdoors(Place place, const Terrain& terrain) {
  Scene scene;
  scene.terrain = terrain;
  scene.size = {kTextureSize, kTextureSize};
  if (place == Place::hillside) {
    scene.ground = Material::gravel;
    const std::vector<Building> blocks{
        {-8.0, 6.0, 4.0, 14.0, 0.0, 7.0, Material::facade},   {28.0, 8.0, 5.0, 18.0, 0.0, 8.0, Material::facade},
        {6.0, -14.0, 22.0, 4.0, 0.0, 6.5, Material::facade},  {4.0, 30.0, 20.0, 4.0, 0.0, 7.5, Material::brick},
        {3.0, -4.0, 1.6, 0.8, 0.0, 1.1, Material::foliage},   {9.0, -4.5, 2.4, 0.9, 0.0, 1.3, Material::foliage},
        {18.0, -2.0, 1.2, 1.2, 0.0, 0.9, Material::concrete}, {19.0, 6.0, 0.8, 3.0, 0.0, 1.0, Material::foliage},
        {-3.5, 5.0, 0.9, 2.2, 0.0, 1.2, Material::foliage},   {-3.0, 12.0, 1.2, 1.0, 0.0, 0.8, Material::concrete},
        {13.0, 20.0, 3.0, 1.0, 0.0, 1.4, Material::foliage}};
    for (const Building& block : blocks) add_block(scene, block);
    add_tree(scene, -3.0, -4.5, 4.5);
    add_tree(scene, 14.0, -6.5, 6.0);
    add_tree(scene, 21.0, 13.0, 5.0);
    add_tree(scene, 6.0, 22.0, 5.5);
    add_tree(scene, -4.0, 18.0, 4.0);
  } else {
    scene.ground = Material::grass;
    const std::vector<Building> blocks{
        {-9.0, 10.0, 4.0, 16.0, 0.0, 7.0, Material::facade}, {27.0, 9.0, 4.0, 20.0, 0.0, 8.0, Material::facade},
        {8.0, -10.0, 18.0, 4.0, 0.0, 6.0, Material::brick},  {6.0, 28.0, 24.0, 4.0, 0.0, 7.0, Material::facade},
        {6.0, -1.0, 4.0, 0.9, 0.0, 1.2, Material::foliage},  {13.0, -0.5, 2.0, 0.9, 0.0, 0.9, Material::foliage},
        {19.0, 8.0, 0.8, 4.0, 0.0, 1.1, Material::foliage},  {19.0, 15.0, 1.8, 0.6, 0.0, 0.8, Material::wood},
        {-4.0, 4.0, 0.9, 3.5, 0.0, 1.3, Material::foliage},  {-4.0, 13.0, 0.7, 1.6, 0.0, 0.8, Material::wood},
        {9.0, 21.0, 5.0, 0.9, 0.0, 1.2, Material::foliage},  {-1.0, 20.5, 1.2, 1.2, 0.0, 0.9, Material::concrete}};
    for (const Building& block : blocks) add_block(scene, block);
    add_tree(scene, 0.0, -4.0, 4.5);
    add_tree(scene, 20.0, 1.0, 6.0);
    add_tree(scene, 20.0, 20.0, 5.0);
    add_tree(scene, 4.0, 23.0, 5.5);
    add_tree(scene, -5.5, 18.0, 5.0);
  }
  add_sky(scene, {8.0, 9.0});
  return scene;
}

}  // namespace ear::simulator
