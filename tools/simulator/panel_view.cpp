#include "tools/simulator/panel_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ear::simulator {
namespace {

// Whether a panel may be seen through a box of rays: false when all its corners lie outside one side.
bool may_meet(const PanelView& view, const RayBox& box) {
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

Eigen::Vector3f corner_of(const RayBox& box, std::size_t i) {
  return {i % 2 == 0 ? box.min_x : box.max_x, i / 2 == 0 ? box.min_y : box.max_y, 1.0F};
}

PanelPart part_of(const PanelView& view, const RayBox& box) {
  PanelPart part{&view, -std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(), true, {}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3f d = corner_of(box, i);
    const float w = view.m.dot(d);
    const float a = view.a0 + view.u.dot(d) / w;
    const float b = view.b0 + view.v.dot(d) / w;
    const bool inside = w > kFlattest && a >= 0.0F && b >= 0.0F && a <= view.width && b <= view.height;
    part.covers = part.covers && inside;
    part.nearest = std::max(part.nearest, w);
    part.farthest = std::min(part.farthest, w);
  }
  return part;
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
  const float detail = std::max(kMinorShare * area / major, kMajorShare * major);
  return std::log2(std::max(kFlattest, detail / focal * view.pixels_per_metre));
}

// Level of detail at a pixel of the row, between those of the tile's corners.
struct LevelRamp {
  float at_left, per_x;
};

LevelRamp ramp(const PanelPart& part, const RayBox& box, float y) {
  const float f = (y - box.min_y) / (box.max_y - box.min_y);
  const std::array<float, 4>& l = part.level;
  const float left = l[0] + f * (l[2] - l[0]);
  const float right = l[1] + f * (l[3] - l[1]);
  const float per_x = (right - left) / (box.max_x - box.min_x);
  return {left - per_x * box.min_x, per_x};
}

}  // namespace

PanelView view_of(const Panel& panel, int surface, const Texture& texture, const Eigen::Isometry3d& T_WC) {
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
  view.surface = surface;
  view.pixels_per_metre = texture.pixels_per_metre();
  return view;
}

void find_panels(const std::vector<PanelView>& views, const RayBox& box, float focal, float wall,
                 std::vector<PanelPart>& found) {
  found.clear();
  for (const PanelView& view : views) {
    if (may_meet(view, box)) found.push_back(part_of(view, box));
  }
  for (const PanelPart& part : found) {
    if (part.covers) wall = std::max(wall, part.farthest);
  }
  const auto hidden = [wall](const PanelPart& part) { return part.nearest < wall; };
  found.erase(std::remove_if(found.begin(), found.end(), hidden), found.end());
  for (PanelPart& part : found) {
    for (std::size_t i = 0; i < 4; ++i) part.level[i] = detail_level(*part.view, corner_of(box, i), focal);
  }
}

// Both are loops without branches, which the compiler turns into vector code.
void see_only(const PanelPart& panel, const RayBox& box, Row& row) {
  const PanelView view = *panel.view;
  const LevelRamp level = ramp(panel, box, row.y[0]);
  for (std::size_t i = 0; i < kTile; ++i) {
    const float x = row.x[i];
    const float y = row.y[i];
    const float w = view.m.x() * x + view.m.y() * y + view.m.z();
    const float depth = 1.0F / w;
    row.inverse_depth[i] = w;
    row.a[i] = view.a0 + depth * (view.u.x() * x + view.u.y() * y + view.u.z());
    row.b[i] = view.b0 + depth * (view.v.x() * x + view.v.y() * y + view.v.z());
    row.level[i] = level.at_left + level.per_x * x;
    row.surface[i] = view.surface;
  }
}

void see_nearest(const PanelPart& panel, const RayBox& box, Row& row) {
  const PanelView view = *panel.view;
  const LevelRamp level = ramp(panel, box, row.y[0]);
  for (std::size_t i = 0; i < kTile; ++i) {
    const float x = row.x[i];
    const float y = row.y[i];
    const float w = view.m.x() * x + view.m.y() * y + view.m.z();
    const float depth = 1.0F / w;
    const float a = view.a0 + depth * (view.u.x() * x + view.u.y() * y + view.u.z());
    const float b = view.b0 + depth * (view.v.x() * x + view.v.y() * y + view.v.z());
    // How far within the panel the point is, and how much nearer than what has been seen: all must be positive.
    const float inside = std::min(std::min(a, view.width - a), std::min(b, view.height - b));
    const bool seen = std::min(inside, w - row.inverse_depth[i]) > 0.0F;
    row.inverse_depth[i] = seen ? w : row.inverse_depth[i];
    row.a[i] = seen ? a : row.a[i];
    row.b[i] = seen ? b : row.b[i];
    row.level[i] = seen ? level.at_left + level.per_x * x : row.level[i];
    row.surface[i] = seen ? view.surface : row.surface[i];
  }
}

}  // namespace ear::simulator
