#include "tools/simulator/ground_view.h"

#include <algorithm>
#include <cmath>

namespace ear::simulator {
namespace {

// A cell is simple if the error of its interpolation, by the bounds of the ground's derivatives, is below this [px].
constexpr float kPixelTolerance = 0.06F;
// Error of the interpolation in one direction, over the third derivative and the cube of the length: the maximum of
// s (1 - s) (1/2 - s) / 6.
constexpr float kThirdOrder = 0.0081F;

constexpr float kFlattestFacing = 0.02F;
constexpr float kOctavesPerNeper = 1.442695F;  // 1 / ln 2
constexpr std::size_t kCellsInLanes = kLanes / kCell;

constexpr float kHiddenMargin = 1.1F;  // of inverse depth: ground between the nodes may be nearer or farther than they

std::size_t index(int i) { return static_cast<std::size_t>(i); }

// The ground's picture goes on beyond its border, as in a mirror: seamless, and itself again after two sizes.
Lanes mirrored(const Lanes& place, float size) { return (place - 2.0F * size * rounded(place / (2.0F * size))).abs(); }

}  // namespace

GroundView::GroundView(const Ground& ground, const Optics& optics, const Eigen::Isometry3d& T_WC)
    : optics_(optics),
      size_(ground.size.cast<float>()),
      pixels_per_metre_(ground.pixels_per_metre),
      surface_(ground.surface),
      R_WC_(T_WC.linear().cast<float>()),
      caster_(ground.terrain, T_WC.translation(), optics.focal, ground.farthest),
      nodes_(index(optics.lattice.columns * optics.lattice.rows)),
      cells_(index(optics.width / kCell * (optics.height / kCell))),
      depth_(index(kRowsKept * optics.width), 0.0F) {
  for (std::size_t row = 0; row < kCell; ++row) {
    for (std::size_t column = 0; column < kCell; ++column) {
      const float side = (row + column) % 2 == 0 ? 1.0F : -1.0F;
      const float s = (static_cast<float>(column) + 0.5F + side * optics.right) / kCell;
      const float t = (static_cast<float>(row) + 0.5F + side * optics.down) / kCell;
      const auto k = static_cast<Eigen::Index>(column);
      weights_[row][0][k] = (1.0F - s) * (1.0F - t);
      weights_[row][1][k] = s * (1.0F - t);
      weights_[row][2][k] = (1.0F - s) * t;
      weights_[row][3][k] = s * t;
    }
  }

  const std::size_t columns = index(optics.lattice.columns);
  const std::size_t cells = index(optics.width / kCell);
  NodeHits lower(columns);
  NodeHits upper(columns);
  cast_nodes(optics.lattice.rows - 1, nullptr, lower);
  for (int j = optics.lattice.rows - 2; j >= 0; --j) {
    cast_nodes(j, &lower, upper);
    for (std::size_t i = 0; i < cells; ++i) cells_[index(j) * cells + i] = kind_of(upper, lower, i);
    std::swap(lower, upper);
  }
}

RayLanes GroundView::to_world(const float* x, const float* y) const {
  const Eigen::Map<const Lanes> x_C(x);
  const Eigen::Map<const Lanes> y_C(y);
  return {R_WC_(0, 0) * x_C + R_WC_(0, 1) * y_C + R_WC_(0, 2), R_WC_(1, 0) * x_C + R_WC_(1, 1) * y_C + R_WC_(1, 2),
          R_WC_(2, 0) * x_C + R_WC_(2, 1) * y_C + R_WC_(2, 2)};
}

// `facing`: how fast the rays come down on the ground, per metre along them.
Lanes GroundView::level_of(const Lanes& depth, const Lanes& facing) const {
  const Lanes longer = kMajorShare / facing.max(kFlattestFacing);
  const Lanes size = depth / optics_.focal * longer.max(kMinorShare);
  return (size * pixels_per_metre_).log() * kOctavesPerNeper;
}

void GroundView::cast_nodes(int j, const NodeHits* lower, NodeHits& hits) {
  const Lattice& lattice = optics_.lattice;
  for (int i = 0; i < lattice.columns; i += kLanes) {
    const std::size_t first = index(j * lattice.columns + i);
    const float* x = lattice.x.data() + first;
    const float* y = lattice.y.data() + first;
    const RayLanes rays = to_world(x, y);
    Lanes from = caster_.free_depth(rays);
    if (lower != nullptr) {
      const auto below = first + index(lattice.columns);
      from = caster_.free_depth(rays, to_world(lattice.x.data() + below, lattice.y.data() + below),
                                Eigen::Map<const Lanes>(lower->depth.data() + i));
    }
    const GroundCaster::Hits met = caster_.cast(rays, from);

    // The tangent plane n . (p - p_hit) = 0 with n = (-slope_x, -slope_y, 1).
    const Lanes n_x = R_WC_(2, 0) - met.slope_x * R_WC_(0, 0) - met.slope_y * R_WC_(1, 0);
    const Lanes n_y = R_WC_(2, 1) - met.slope_x * R_WC_(0, 1) - met.slope_y * R_WC_(1, 1);
    const Lanes along = (rays.z - met.slope_x * rays.x - met.slope_y * rays.y).min(-1e-6F);
    const Lanes inverse_depth = 1.0F / met.depth;
    const Lanes per_x = 0.5F * inverse_depth * n_x / along;
    const Lanes per_y = 0.5F * inverse_depth * n_y / along;
    const Lanes across = (rays.x * rays.x + rays.y * rays.y).sqrt();
    const Lanes facing = -along / (across.square() + rays.z.square()).sqrt();
    const Lanes level = level_of(met.depth.min(1e3F), facing);
    for (int k = 0; k < kLanes; ++k) {
      nodes_[first + index(k)] = {inverse_depth[k], inverse_depth[k] - per_x[k] * x[k] - per_y[k] * y[k], per_x[k],
                                  per_y[k], level[k]};
      const std::size_t node = index(i + k);
      hits.depth[node] = met.depth[k];
      hits.x[node] = met.depth[k] * rays.x[k];
      hits.y[node] = met.depth[k] * rays.y[k];
      hits.descent[node] = -along[k] / across[k];
    }
  }
}

GroundView::Kind GroundView::kind_of(const NodeHits& upper, const NodeHits& lower, std::size_t i) const {
  const auto [nearest, farthest] =
      std::minmax({upper.depth[i], upper.depth[i + 1], lower.depth[i], lower.depth[i + 1]});
  if (nearest == kMissed) return Kind::empty;
  if (farthest == kMissed) return Kind::complex;
  const auto square = [](float x, float y) { return x * x + y * y; };
  const float length = std::sqrt(std::max(square(upper.x[i] - lower.x[i + 1], upper.y[i] - lower.y[i + 1]),
                                          square(upper.x[i + 1] - lower.x[i], upper.y[i + 1] - lower.y[i])));
  // Seen from the front at the nodes, and too small for a crest between them.
  const float descent = std::min({upper.descent[i], upper.descent[i + 1], lower.descent[i], lower.descent[i + 1]});
  if (descent < 0.5F * caster_.sharpest() * length) return Kind::complex;
  // The picture of a curved surface has third derivatives of its own: from perspective, and from looking along it.
  const float curvature = caster_.sharpest();
  const float third = caster_.third_derivative() + 3.0F * curvature * (1.0F / nearest + curvature / descent);
  const float error = kThirdOrder * third * length * length * length;  // of height [m]
  return error * optics_.focal < kPixelTolerance * nearest ? Kind::simple : Kind::complex;
}

float GroundView::farthest_in(int left, int top) const {
  const int cells = optics_.width / kCell;
  float farthest = kMissed;
  for (int j = top / kCell; j < (top + kTile) / kCell; ++j) {
    for (int i = left / kCell; i < (left + kTile) / kCell; ++i) {
      if (cells_[index(j * cells + i)] != Kind::simple) return 0.0F;
      const Node* upper = nodes_.data() + index(j * optics_.lattice.columns + i);
      const Node* lower = upper + optics_.lattice.columns;
      farthest = std::min(
          {farthest, upper[0].inverse_depth, upper[1].inverse_depth, lower[0].inverse_depth, lower[1].inverse_depth});
    }
  }
  return farthest / kHiddenMargin;
}

// The mean of two interpolations between the cell's nodes: of their inverse depths, and of their tangent planes. Their
// errors of second order cancel.
GroundView::Seen GroundView::interpolate(int left, int v, const float* x, const float* y) const {
  const std::array<Pixels, 4>& weights = weights_[index(v % kCell)];
  Seen seen;
  for (std::size_t c = 0; c < kCellsInLanes; ++c) {
    const Node* upper = nodes_.data() + index(v / kCell * optics_.lattice.columns + left / kCell) + c;
    const Node* lower = upper + optics_.lattice.columns;
    const auto mean = [&](float Node::*value) -> Pixels {
      return weights[0] * upper[0].*value + weights[1] * upper[1].*value + weights[2] * lower[0].*value +
             weights[3] * lower[1].*value;
    };
    const auto at = static_cast<Eigen::Index>(c * kCell);
    const Eigen::Map<const Pixels> x_C(x + at);
    const Eigen::Map<const Pixels> y_C(y + at);
    seen.inverse_depth.segment<kCell>(at) = mean(&Node::base) + mean(&Node::per_x) * x_C + mean(&Node::per_y) * y_C;
    seen.level.segment<kCell>(at) = mean(&Node::level);
  }
  return seen;
}

GroundView::Seen GroundView::cast(int left, int v, const RayLanes& rays) {
  Lanes from = caster_.free_depth(rays);
  if (v + 2 < optics_.height) {
    const std::size_t below = optics_.rays.index(left, v + 2);
    from = caster_.free_depth(rays, to_world(optics_.rays.x.data() + below, optics_.rays.y.data() + below),
                              Eigen::Map<const Lanes>(kept_depth(left, v + 2)));
  }
  const GroundCaster::Hits met = caster_.cast(rays, from);
  const Lanes along = rays.z - met.slope_x * rays.x - met.slope_y * rays.y;
  const Lanes length = (rays.x.square() + rays.y.square() + rays.z.square()).sqrt();
  return {1.0F / met.depth, level_of(met.depth.min(1e3F), -along / length)};
}

void GroundView::see(int left, int v, Row& row) {
  for (int part = 0; part < kTile; part += kLanes) see_lanes(left + part, v, index(part), row);
}

void GroundView::see_lanes(int left, int v, std::size_t at, Row& row) {
  Eigen::Map<Lanes> depth(kept_depth(left, v));
  const Kind* cell = cells_.data() + index(v / kCell * (optics_.width / kCell) + left / kCell);
  const Node* upper = nodes_.data() + index(v / kCell * optics_.lattice.columns + left / kCell);
  const Node* lower = upper + optics_.lattice.columns;
  bool empty = true;
  bool simple = true;
  for (std::size_t c = 0; c < kCellsInLanes; ++c) {
    empty = empty && cell[c] == Kind::empty;
    simple = simple && cell[c] != Kind::complex;
  }
  if (empty) {
    depth = kMissed;
    return;
  }
  Eigen::Map<Lanes> known(row.inverse_depth.data() + at);
  float nearest = 0.0F;
  for (std::size_t c = 0; c <= kCellsInLanes; ++c) {
    nearest = std::max({nearest, upper[c].inverse_depth, lower[c].inverse_depth});
  }
  if (kHiddenMargin * nearest < known.minCoeff()) {
    depth = 0.0F;  // unknown
    return;
  }

  const float* x = row.x + at;
  const float* y = row.y + at;
  const RayLanes rays = to_world(x, y);
  const Seen seen = simple ? interpolate(left, v, x, y) : cast(left, v, rays);
  depth = 1.0F / seen.inverse_depth;
  const Lanes a = mirrored(caster_.eye_W().x() + depth * rays.x, size_.x());
  const Lanes b = mirrored(caster_.eye_W().y() + depth * rays.y, size_.y());
  for (int k = 0; k < kLanes; ++k) {
    if (seen.inverse_depth[k] <= known[k]) continue;
    const std::size_t pixel = at + index(k);
    row.inverse_depth[pixel] = seen.inverse_depth[k];
    row.a[pixel] = a[k];
    row.b[pixel] = b[k];
    row.level[pixel] = seen.level[k];
    row.surface[pixel] = surface_;
  }
}

}  // namespace ear::simulator
