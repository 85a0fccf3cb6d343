#include "tools/simulator/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "tools/simulator/camera_pose.h"
#include "tools/simulator/lanes.h"

namespace ear::simulator {
namespace {

// The sub-pictures: offsets within the pixel and within the exposure, in fifths. Each fifth of the pixel's width, of
// its height and of the exposure is met once. They lie symmetrically about the middle, so that a blurred point has its
// middle where a sharp one would be. Offsets and instants must correlate then: every second pixel takes its offsets
// negated, and the picture as a whole has no correlation.
// Levels of detail are mixed by the sub-pictures: each rounds up from another fraction on. Opposite offsets share
// theirs, or every second pixel would have its sharp sub-pictures on the other side.
struct SubPicture {
  int right, down, late;
  float rounding;
};
constexpr int kSubPictures = 5;
constexpr std::array<SubPicture, kSubPictures> kPattern{
    {{-1, -2, 1, 0.2F}, {2, -1, 2, 0.8F}, {0, 0, 0, 0.5F}, {-2, 1, -2, 0.8F}, {1, 2, -1, 0.2F}}};

constexpr double fraction(int fifths) { return static_cast<double>(fifths) / kSubPictures; }

// Of the rays of each tile, row by row.
std::vector<RayBox> bounds(const PixelRays& rays) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr std::size_t kPixels = std::size_t{kTile} * kTile;
  std::vector<RayBox> boxes(rays.x.size() / kPixels, {kInfinity, -kInfinity, kInfinity, -kInfinity});
  for (std::size_t i = 0; i < rays.x.size(); ++i) {
    RayBox& box = boxes[i / kPixels];
    box = {std::min(box.min_x, rays.x[i]), std::max(box.max_x, rays.x[i]), std::min(box.min_y, rays.y[i]),
           std::max(box.max_y, rays.y[i])};
  }
  return boxes;
}

Panel flat_ground(const Scene& scene) {
  return {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
          scene.size.x(),          scene.size.y(),           Material::floor};
}

// Distance from the eye to the farthest corner of any panel [m]: no ground beyond is seen.
float farthest_corner(const Scene& scene, const Eigen::Vector3d& eye_W) {
  constexpr double kFarthestHit = 100.0;
  double farthest = 0.0;
  for (const Panel& panel : scene.panels) {
    for (const double a : {0.0, panel.width}) {
      for (const double b : {0.0, panel.height}) {
        farthest = std::max(farthest, (panel.corner_W + a * panel.u_W + b * panel.v_W - eye_W).norm());
      }
    }
  }
  return static_cast<float>(scene.panels.empty() ? kFarthestHit : std::min(farthest, kFarthestHit));
}

}  // namespace

struct Renderer::View {
  std::vector<PanelView> panels;
  std::optional<GroundView> ground;  // unless it is flat, and a panel
  std::vector<PanelPart> parts;      // of one tile
};

Renderer::Renderer(const Scene& scene, const Appearance& appearance, const std::vector<CameraCalibration>& cameras)
    : scene_(scene), appearance_(appearance) {
  if (appearance.panels.size() != scene.panels.size()) {
    throw std::invalid_argument("the scene has " + std::to_string(scene.panels.size()) + " panels, its appearance " +
                                std::to_string(appearance.panels.size()));
  }
  for (const Texture& texture : appearance.panels) textures_.push_back(&texture);
  textures_.push_back(&appearance.ground);

  for (const CameraCalibration& camera : cameras) {
    if (camera.width % kTile != 0 || camera.height % kTile != 0) {
      throw std::invalid_argument("pictures are rendered in tiles: width and height must be multiples of " +
                                  std::to_string(kTile));
    }
    Eye eye{camera.T_BC, camera.width,         camera.height,     static_cast<float>(camera.fu),
            {},          make_lattice(camera), vignetting(camera)};
    for (const SubPicture& sub : kPattern) {
      PixelRays rays = make_rays(camera, {fraction(sub.right), fraction(sub.down)});
      std::vector<RayBox> boxes = bounds(rays);
      eye.patterns.push_back({std::move(rays), std::move(boxes)});
    }
    eyes_.push_back(std::move(eye));
  }
}

cv::Mat Renderer::render(std::size_t camera, const Trajectory& trajectory, double t, const Exposure& exposure) const {
  const Eye& eye = eyes_.at(camera);
  std::vector<View> views;
  for (std::size_t sub = 0; sub < kPattern.size(); ++sub) {
    const Kinematics motion = trajectory.at(t + fraction(kPattern[sub].late) * exposure.seconds);
    views.push_back(look(eye, camera_pose(motion, eye.T_BC), sub));
  }

  const auto gain = static_cast<float>(exposure.gain / kSubPictures);
  cv::Mat picture(eye.height, eye.width, CV_32FC1);
  TileSum sum;
  for (int top = eye.height - kTile; top >= 0; top -= kTile) {  // from below, as GroundView wants it
    for (int left = 0; left < eye.width; left += kTile) {
      // All sub-pictures of a tile, while their textures are in the processor's cache.
      sum.fill(0.0F);
      for (std::size_t sub = 0; sub < kPattern.size(); ++sub) add_tile(eye, views[sub], sub, left, top, sum);
      for (int row = 0; row < kTile; ++row) {
        const float* in = sum.data() + row * kTile;
        const float* bright = eye.vignetting.ptr<float>(top + row) + left;
        float* out = picture.ptr<float>(top + row) + left;
        for (int i = 0; i < kTile; ++i) out[i] = gain * bright[i] * in[i];
      }
    }
  }
  return picture;
}

Renderer::View Renderer::look(const Eye& eye, const Eigen::Isometry3d& T_WC, std::size_t sub) const {
  View view;
  for (std::size_t i = 0; i < scene_.panels.size(); ++i) {
    const Panel& panel = scene_.panels[i];
    const bool from_its_front = panel.normal_W.dot(T_WC.translation()) > panel.offset;
    if (from_its_front) view.panels.push_back(view_of(panel, static_cast<int>(i), appearance_.panels[i], T_WC));
  }
  const auto ground = static_cast<int>(scene_.panels.size());
  if (scene_.terrain.flat()) {
    view.panels.push_back(view_of(flat_ground(scene_), ground, appearance_.ground, T_WC));
  } else {
    view.ground.emplace(GroundView::Ground{scene_.terrain, scene_.size, appearance_.ground.pixels_per_metre(), ground,
                                           farthest_corner(scene_, T_WC.translation())},
                        GroundView::Optics{eye.lattice, eye.patterns[sub].rays, eye.width, eye.height,
                                           static_cast<float>(fraction(kPattern[sub].right)),
                                           static_cast<float>(fraction(kPattern[sub].down)), eye.focal},
                        T_WC);
  }
  return view;
}

void Renderer::add_tile(const Eye& eye, View& view, std::size_t sub, int left, int top, TileSum& sum) const {
  const Pattern& pattern = eye.patterns[sub];
  const RayBox& box = pattern.boxes[static_cast<std::size_t>(top / kTile * (eye.width / kTile) + left / kTile)];
  const float wall = view.ground ? view.ground->farthest_in(left, top) : 0.0F;
  find_panels(view.panels, box, eye.focal, wall, view.parts);
  const bool one_panel = view.parts.size() == 1 && view.parts.front().covers;
  Row row;
  for (int v = top + kTile - 1; v >= top; --v) {
    const std::size_t first = pattern.rays.index(left, v);
    row.x = pattern.rays.x.data() + first;
    row.y = pattern.rays.y.data() + first;
    if (one_panel) {
      see_only(view.parts.front(), box, row);
    } else {
      row.clear();
      for (const PanelPart& part : view.parts) see_nearest(part, box, row);
    }
    if (view.ground) view.ground->see(left, v, row);
    shade(row, kPattern[sub].rounding, sum.data() + (v - top) * kTile);
  }
}

void Renderer::shade(const Row& row, float rounding, float* sum) const {
  for (std::size_t first = 0; first < kTile; first += kLanes) {
    // Mostly all of one surface, and of one level.
    const int surface = row.surface[first];
    const Texture* texture = surface == kNothing ? nullptr : textures_[static_cast<std::size_t>(surface)];
    const int level = texture == nullptr ? 0 : texture->whole(row.level[first] + rounding);
    bool alike = texture != nullptr;
    for (std::size_t i = first; i < first + kLanes && alike; ++i) {
      alike = row.surface[i] == surface && texture->whole(row.level[i] + rounding) == level;
    }
    if (alike) {
      Eigen::Map<Lanes>(sum + first) += texture->at(Eigen::Map<const Lanes>(row.a.data() + first),
                                                    Eigen::Map<const Lanes>(row.b.data() + first), level);
      continue;
    }
    for (std::size_t i = first; i < first + kLanes; ++i) {
      if (row.surface[i] == kNothing) continue;
      const Texture& own = *textures_[static_cast<std::size_t>(row.surface[i])];
      sum[i] += own.at(row.a[i], row.b[i], row.level[i] + rounding);
    }
  }
}

}  // namespace ear::simulator
