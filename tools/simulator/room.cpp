// The indoor room: what stands where. All in the world frame W, the floor's corner at the origin.
#include <array>

#include <Eigen/Geometry>

#include "tools/simulator/scene.h"

namespace ear::simulator {
namespace {

constexpr double kLength = 12.0;    // [m] along x
constexpr double kRoomWidth = 9.0;  // along y
constexpr double kRoomHeight = 3.5;
constexpr double kBelow = 0.3;  // walls and furniture reach below a wavy ground

struct Block {
  double min_x, min_y, max_x, max_y, height;  // [m]
  Material material;
};

constexpr std::array<Block, 16> kBlocks{{
    // Islands that the paths go round.
    {1.90, 4.70, 2.60, 5.40, 3.50, Material::concrete},  // a pillar up to the ceiling
    {7.40, 4.50, 8.10, 5.20, 1.10, Material::cardboard},
    {7.55, 4.60, 8.00, 5.00, 1.55, Material::wood},
    // Along the south wall (y = 0).
    {2.60, 0.00, 3.70, 0.35, 0.75, Material::wood},
    {5.20, 0.00, 6.60, 0.35, 1.95, Material::shelf},
    {8.30, 0.00, 8.90, 0.40, 0.45, Material::cardboard},
    {9.00, 0.00, 9.40, 0.35, 0.90, Material::metal},
    // Along the north wall.
    {1.30, 8.60, 3.10, 9.00, 2.10, Material::shelf},
    {4.60, 8.62, 5.30, 9.00, 0.60, Material::cardboard},
    {7.90, 8.64, 9.50, 9.00, 0.85, Material::wood},
    // Along the west wall.
    {0.00, 2.20, 0.40, 3.60, 1.80, Material::shelf},
    {0.00, 6.10, 0.45, 6.80, 0.70, Material::cardboard},
    // Along the east wall.
    {11.45, 2.40, 12.00, 3.10, 0.80, Material::wood},
    {11.55, 5.60, 12.00, 7.00, 2.00, Material::metal},
    // Corners.
    {11.30, 0.00, 12.00, 0.70, 1.20, Material::cardboard},
    {11.40, 8.40, 12.00, 9.00, 3.50, Material::concrete},
}};

void add_block(std::vector<Panel>& panels, const Block& block) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const double x = block.max_x - block.min_x;
  const double y = block.max_y - block.min_y;
  const double z = block.height + kBelow;
  const auto side = [&](double px, double py, const Eigen::Vector3d& u_W, double width) {
    panels.push_back({{px, py, -kBelow}, u_W, up, width, z, block.material});
  };
  side(block.min_x, block.min_y, Eigen::Vector3d::UnitX(), x);   // faces -y
  side(block.max_x, block.min_y, Eigen::Vector3d::UnitY(), y);   // faces +x
  side(block.max_x, block.max_y, -Eigen::Vector3d::UnitX(), x);  // faces +y
  side(block.min_x, block.max_y, -Eigen::Vector3d::UnitY(), y);  // faces -x
  if (block.height < kRoomHeight) {
    panels.push_back({{block.min_x, block.min_y, block.height},
                      Eigen::Vector3d::UnitX(),
                      Eigen::Vector3d::UnitY(),
                      x,
                      y,
                      block.material});
  }
}

// A flat picture, 1 cm in front of a wall. `along` is where it begins, measured like the wall's own u.
void add_poster(std::vector<Panel>& panels, const Panel& wall, double along, double above, double width,
                double height) {
  const Eigen::Vector3d corner_W =
      wall.corner_W + along * wall.u_W + (above + kBelow) * wall.v_W + 0.01 * wall.normal_W;
  panels.push_back({corner_W, wall.u_W, wall.v_W, width, height, Material::poster});
}

}  // namespace

Scene make_room(const Terrain& terrain) {
  Scene room;
  room.terrain = terrain;
  room.size = {kLength, kRoomWidth};
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const double tall = kRoomHeight + kBelow;
  // Walls look inwards: u x v is the normal.
  const Panel south{{kLength, 0.0, -kBelow}, -x, z, kLength, tall, Material::wall};
  const Panel north{{0.0, kRoomWidth, -kBelow}, x, z, kLength, tall, Material::wall};
  const Panel west{{0.0, 0.0, -kBelow}, y, z, kRoomWidth, tall, Material::brick};
  const Panel east{{kLength, kRoomWidth, -kBelow}, -y, z, kRoomWidth, tall, Material::wall};
  const Panel ceiling{{0.0, kRoomWidth, kRoomHeight}, x, -y, kLength, kRoomWidth, Material::ceiling};
  room.panels = {south, north, west, east, ceiling};

  for (const Block& block : kBlocks) add_block(room.panels, block);

  add_poster(room.panels, south, 1.2, 1.1, 0.9, 1.2);
  add_poster(room.panels, south, 4.4, 1.3, 0.6, 0.85);
  add_poster(room.panels, south, 8.7, 0.9, 1.4, 1.0);
  add_poster(room.panels, north, 3.7, 1.2, 0.7, 1.0);
  add_poster(room.panels, north, 5.9, 0.9, 1.5, 1.1);
  add_poster(room.panels, north, 10.0, 1.4, 0.8, 0.6);
  add_poster(room.panels, west, 0.7, 1.2, 0.8, 1.1);
  add_poster(room.panels, west, 4.2, 0.8, 1.3, 0.9);
  add_poster(room.panels, west, 7.3, 1.5, 0.9, 0.7);
  add_poster(room.panels, east, 0.9, 1.1, 1.0, 1.4);
  add_poster(room.panels, east, 4.3, 0.7, 0.9, 1.2);
  add_poster(room.panels, east, 6.9, 1.3, 1.1, 0.8);
  return room;
}

std::vector<Eigen::Vector4d> room_footprints() {
  std::vector<Eigen::Vector4d> footprints;
  footprints.reserve(kBlocks.size());
  for (const Block& block : kBlocks) footprints.emplace_back(block.min_x, block.min_y, block.max_x, block.max_y);
  return footprints;
}

}  // namespace ear::simulator
