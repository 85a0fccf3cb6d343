#include "tools/simulator/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tools/simulator/lens.h"

namespace ear::simulator {
namespace {

// The sub-pictures: offsets within the pixel and within the exposure, in fifths. Each fifth of the pixel's width, of
// its height and of the exposure is met once. They lie symmetrically about the middle, so that a blurred point has its
// middle where a sharp one would be. Offsets and instants must correlate then: every second pixel takes its offsets
// negated, and the picture as a whole has no correlation.
struct SubPicture {
  int right, down, late;
};
constexpr int kSubPictures = 5;
constexpr std::array<SubPicture, kSubPictures> kPattern{{{-1, -2, 1}, {2, -1, 2}, {0, 0, 0}, {-2, 1, -2}, {1, 2, -1}}};

constexpr double fraction(int fifths) { return static_cast<double>(fifths) / kSubPictures; }

constexpr int kTile = 16;           // [px]
constexpr float kFlattest = 1e-3F;  // inverse depth [1/m] below which a plane counts as infinitely far

// A pixel's footprint on a surface has two axes. Texture detail follows neither the longer one, or grazing surfaces
// would blur, nor the shorter: the sub-pictures average along both.
float wanted_detail(float minor, float major) { return std::max(0.6F * minor, major / 3.5F); }

// A panel in the camera's frame. For the ray d = (x, y, 1): inverse depth w = m . d, place on the panel a = a0 + u . d
// / w.
struct PanelView {
  Eigen::Vector3f m, u, v;
  float a0 = 0.0F, b0 = 0.0F, width = 0.0F, height = 0.0F;
  std::array<Eigen::Vector3f, 4> corners;
  const Texture* texture = nullptr;
};

PanelView view_of(const Panel& panel, const Texture& texture, const Eigen::Isometry3d& T_WC) {
  const Eigen::Matrix3d R_CW = T_WC.linear().transpose();
  const Eigen::Vector3d& eye_W = T_WC.translation();
  PanelView view;
  view.m = (R_CW * panel.normal_W / (panel.offset - panel.normal_W.dot(eye_W))).cast<float>();
  view.u = (R_CW * panel.u_W).cast<float>();
  view.v = (R_CW * panel.v_W).cast<float>();
  view.a0 = static_cast<float>(panel.u_W.dot(eye_W - panel.corner_W));
  view.b0 = static_cast<float>(panel.v_W.dot(eye_W - panel.corner_W));
  view.width = static_cast<float>(panel.width);
  view.height = static_cast<float>(panel.height);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d corner_W =
        panel.corner_W + (i % 2 == 1 ? panel.width : 0.0) * panel.u_W + (i / 2 == 1 ? panel.height : 0.0) * panel.v_W;
    view.corners[i] = (R_CW * (corner_W - eye_W)).cast<float>();
  }
  view.texture = &texture;
  return view;
}

// Bounds of all rays of one tile.
struct Box {
  float min_x, max_x, min_y, max_y;
};

Box bounds(const std::vector<float>& x, const std::vector<float>& y, int width, int left, int top) {
  Box box{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
          std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (int v = top; v < top + kTile; ++v) {
    for (int u = left; u < left + kTile; ++u) {
      const auto i = static_cast<std::size_t>(v * width + u);
      box = {std::min(box.min_x, x[i]), std::max(box.max_x, x[i]), std::min(box.min_y, y[i]),
             std::max(box.max_y, y[i])};
    }
  }
  return box;
}

// Whether a panel may be seen through a box of rays: false when all its corners lie outside one side.
bool may_meet(const PanelView& view, const Box& box) {
  bool left = true, right = true, above = true, below = true, behind = true;
  for (const Eigen::Vector3f& c : view.corners) {
    left = left && c.x() < box.min_x * c.z();
    right = right && c.x() > box.max_x * c.z();
    above = above && c.y() < box.min_y * c.z();
    below = below && c.y() > box.max_y * c.z();
    behind = behind && c.z() <= 0.0F;
  }
  return !(left || right || above || below || behind);
}

// Level of detail with which a pixel of this focal length [px] sees the panel along the ray d.
float detail_level(const PanelView& view, const Eigen::Vector3f& d, float focal) {
  const float t = 1.0F / std::max(view.m.dot(d), kFlattest);
  const float ud = view.u.dot(d) * t;
  const float vd = view.v.dot(d) * t;
  // Derivatives of the place with respect to x and y of the ray, and their singular values.
  const float ax = (view.u.x() - view.m.x() * ud) * t;
  const float ay = (view.u.y() - view.m.y() * ud) * t;
  const float bx = (view.v.x() - view.m.x() * vd) * t;
  const float by = (view.v.y() - view.m.y() * vd) * t;
  const float squares = ax * ax + ay * ay + bx * bx + by * by;
  const float area = std::abs(ax * by - ay * bx);
  const float major = std::sqrt(0.5F * (squares + std::sqrt(std::max(0.0F, squares * squares - 4.0F * area * area))));
  return view.texture->level_of(wanted_detail(area / major, major) / focal);
}

// What one tile sees of one panel.
struct Candidate {
  const PanelView* view = nullptr;
  float nearest = -std::numeric_limits<float>::infinity();  // largest inverse depth of its plane over the tile [1/m]
  float farthest = std::numeric_limits<float>::infinity();  // smallest
  bool covers = true;                                       // all of the tile
  std::array<float, 4> level{};                             // of detail, at the tile's corners
};

Candidate candidate_of(const PanelView& view, const Box& box, float focal) {
  Candidate candidate;
  candidate.view = &view;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3f d(i % 2 == 0 ? box.min_x : box.max_x, i / 2 == 0 ? box.min_y : box.max_y, 1.0F);
    const float w = view.m.dot(d);
    const float a = view.a0 + view.u.dot(d) / w;
    const float b = view.b0 + view.v.dot(d) / w;
    const bool inside = w > kFlattest && a >= 0.0F && b >= 0.0F && a <= view.width && b <= view.height;
    candidate.covers = candidate.covers && inside;
    candidate.nearest = std::max(candidate.nearest, w);
    candidate.farthest = std::min(candidate.farthest, w);
    candidate.level[i] = detail_level(view, d, focal);
  }
  return candidate;
}

// The panels that one tile may see, without those behind a panel that fills the tile.
void find_candidates(const std::vector<PanelView>& views, const Box& box, float focal, std::vector<Candidate>& found) {
  found.clear();
  for (const PanelView& view : views) {
    if (may_meet(view, box)) found.push_back(candidate_of(view, box, focal));
  }
  float wall = 0.0F;
  for (const Candidate& candidate : found) {
    if (candidate.covers) wall = std::max(wall, candidate.farthest);
  }
  const auto hidden = [wall](const Candidate& candidate) { return candidate.nearest < wall; };
  found.erase(std::remove_if(found.begin(), found.end(), hidden), found.end());
}

// A row of pixels of one tile: their rays, and the nearest point found so far.
struct Row {
  std::array<float, kTile> x, y;
  std::array<float, kTile> inverse_depth, a, b, level;  // place on the surface [m] and level of detail
  std::array<const Texture*, kTile> texture;
};

// Level of detail at a pixel of the row, between those of the tile's corners.
struct LevelRamp {
  float at_left, per_x;
};

LevelRamp ramp(const Candidate& candidate, const Box& box, float y) {
  const float f = (y - box.min_y) / (box.max_y - box.min_y);
  const std::array<float, 4>& l = candidate.level;
  const float left = l[0] + f * (l[2] - l[0]);
  const float right = l[1] + f * (l[3] - l[1]);
  return {left, (right - left) / (box.max_x - box.min_x)};
}

// Nothing but this panel in the whole tile: no comparisons.
void see_only(const Candidate& candidate, const Box& box, Row& row) {
  const PanelView& view = *candidate.view;
  const LevelRamp level = ramp(candidate, box, row.y[0]);
  for (std::size_t i = 0; i < kTile; ++i) {
    const float x = row.x[i];
    const float y = row.y[i];
    const float depth = 1.0F / (view.m.x() * x + view.m.y() * y + view.m.z());
    row.a[i] = view.a0 + depth * (view.u.x() * x + view.u.y() * y + view.u.z());
    row.b[i] = view.b0 + depth * (view.v.x() * x + view.v.y() * y + view.v.z());
    row.level[i] = level.at_left + level.per_x * (x - box.min_x);
    row.inverse_depth[i] = 1.0F / depth;
    row.texture[i] = view.texture;
  }
}

void see_nearest(const Candidate& candidate, const Box& box, Row& row) {
  const PanelView& view = *candidate.view;
  const LevelRamp level = ramp(candidate, box, row.y[0]);
  for (std::size_t i = 0; i < kTile; ++i) {
    const float x = row.x[i];
    const float y = row.y[i];
    const float w = view.m.x() * x + view.m.y() * y + view.m.z();
    if (w <= row.inverse_depth[i]) continue;
    const float depth = 1.0F / w;
    const float a = view.a0 + depth * (view.u.x() * x + view.u.y() * y + view.u.z());
    const float b = view.b0 + depth * (view.v.x() * x + view.v.y() * y + view.v.z());
    if (a < 0.0F || b < 0.0F || a > view.width || b > view.height) continue;
    row.inverse_depth[i] = w;
    row.a[i] = a;
    row.b[i] = b;
    row.level[i] = level.at_left + level.per_x * (x - box.min_x);
    row.texture[i] = view.texture;
  }
}

// Outdoors the ground's picture goes on beyond its border, as in a mirror: seamless, and itself again after two sizes.
double mirrored(double place, double size) {
  const double in_pair = place - 2.0 * size * std::floor(place / (2.0 * size));
  return in_pair <= size ? in_pair : 2.0 * size - in_pair;
}

// A wavy ground, where it is nearer than what the row sees.
void see_ground(const Scene& scene, const Texture& texture, const Eigen::Isometry3d& T_WC, float focal, Row& row) {
  const Terrain& terrain = scene.terrain;
  const Eigen::Vector2d& size = scene.size;
  for (std::size_t i = 0; i < kTile; ++i) {
    const Eigen::Vector3d toward_C(row.x[i], row.y[i], 1.0);
    const double length = toward_C.norm();
    const Eigen::Vector3d direction_W = T_WC.linear() * toward_C / length;
    const auto range = terrain.cast(T_WC.translation(), direction_W, length / row.inverse_depth[i]);
    if (!range) continue;
    const Eigen::Vector3d p_W = T_WC.translation() + *range * direction_W;
    const double facing = std::max(0.02, -terrain.normal(p_W.x(), p_W.y()).dot(direction_W));
    const auto minor = static_cast<float>(*range / length);
    row.a[i] = static_cast<float>(mirrored(p_W.x(), size.x()));
    row.b[i] = static_cast<float>(mirrored(p_W.y(), size.y()));
    row.level[i] = texture.level_of(wanted_detail(minor, minor / static_cast<float>(facing)) / focal);
    row.texture[i] = &texture;
  }
}

Panel flat_ground(const Scene& scene) {
  return {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
          scene.size.x(),          scene.size.y(),           Material::floor};
}

// All that may be seen from here, from its front.
std::vector<PanelView> views_from(const Scene& scene, const Appearance& appearance, const Eigen::Isometry3d& T_WC) {
  std::vector<PanelView> views;
  for (std::size_t i = 0; i < scene.panels.size(); ++i) {
    const Panel& panel = scene.panels[i];
    if (panel.normal_W.dot(T_WC.translation()) > panel.offset) {
      views.push_back(view_of(panel, appearance.panels[i], T_WC));
    }
  }
  if (scene.terrain.flat()) views.push_back(view_of(flat_ground(scene), appearance.ground, T_WC));
  return views;
}

}  // namespace

Renderer::Renderer(const Scene& scene, const Appearance& appearance, const std::vector<CameraCalibration>& cameras)
    : scene_(scene), appearance_(appearance) {
  if (appearance.panels.size() != scene.panels.size()) {
    throw std::invalid_argument("the scene has " + std::to_string(scene.panels.size()) + " panels, its appearance " +
                                std::to_string(appearance.panels.size()));
  }
  for (const CameraCalibration& camera : cameras) {
    if (camera.width % kTile != 0 || camera.height % kTile != 0) {
      throw std::invalid_argument("pictures are rendered in tiles: width and height must be multiples of " +
                                  std::to_string(kTile));
    }
    Eye eye{camera.T_BC, camera.width, camera.height, static_cast<float>(camera.fu), {}, simulator::vignetting(camera)};
    for (const SubPicture& sub : kPattern) {
      Rays rays;
      for (int v = 0; v < camera.height; ++v) {
        for (int u = 0; u < camera.width; ++u) {
          const double side = (u + v) % 2 == 0 ? 1.0 : -1.0;
          const Eigen::Vector2d ray = to_ray(camera, {u + side * fraction(sub.right), v + side * fraction(sub.down)});
          rays.x.push_back(static_cast<float>(ray.x()));
          rays.y.push_back(static_cast<float>(ray.y()));
        }
      }
      eye.rays.push_back(std::move(rays));
    }
    eyes_.push_back(std::move(eye));
  }
}

cv::Mat Renderer::render(std::size_t camera, const Trajectory& trajectory, double t, const Exposure& exposure) const {
  const Eye& eye = eyes_.at(camera);
  cv::Mat sum = cv::Mat::zeros(eye.height, eye.width, CV_32FC1);
  for (std::size_t sub = 0; sub < kPattern.size(); ++sub) {
    const Kinematics motion = trajectory.at(t + fraction(kPattern[sub].late) * exposure.seconds);
    Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
    T_WB.linear() = motion.R_WB;
    T_WB.translation() = motion.p_WB;
    add_sub_picture(eye, T_WB * eye.T_BC, sub, sum);
  }
  return sum.mul(eye.vignetting, exposure.gain / kSubPictures);
}

void Renderer::add_sub_picture(const Eye& eye, const Eigen::Isometry3d& T_WC, std::size_t sub, cv::Mat& sum) const {
  const std::vector<PanelView> views = views_from(scene_, appearance_, T_WC);
  // Levels of detail are mixed by the sub-pictures: each rounds at another threshold.
  const auto threshold = static_cast<float>((static_cast<double>(sub) + 0.5) / kSubPictures);
  const Rays& rays = eye.rays[sub];
  std::vector<Candidate> candidates;
  for (int top = 0; top < eye.height; top += kTile) {
    for (int left = 0; left < eye.width; left += kTile) {
      const Box box = bounds(rays.x, rays.y, eye.width, left, top);
      find_candidates(views, box, eye.focal, candidates);
      for (int v = top; v < top + kTile; ++v) {
        Row row;
        const auto first = static_cast<std::ptrdiff_t>(v * eye.width + left);
        std::copy_n(rays.x.begin() + first, kTile, row.x.begin());
        std::copy_n(rays.y.begin() + first, kTile, row.y.begin());
        if (candidates.size() == 1 && candidates.front().covers) {
          see_only(candidates.front(), box, row);
        } else {
          row.inverse_depth.fill(kFlattest);
          row.texture.fill(nullptr);
          for (const Candidate& candidate : candidates) see_nearest(candidate, box, row);
        }
        if (!scene_.terrain.flat()) see_ground(scene_, appearance_.ground, T_WC, eye.focal, row);
        float* out = sum.ptr<float>(v) + left;
        for (std::size_t i = 0; i < kTile; ++i) {
          if (row.texture[i] != nullptr) out[i] += row.texture[i]->at(row.a[i], row.b[i], row.level[i] + threshold);
        }
      }
    }
  }
}

}  // namespace ear::simulator
