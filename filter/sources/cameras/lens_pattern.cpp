#include "filter/sources/cameras/lens_pattern.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kCell = 0.25;  // chosen: of the focal length; over a cell an error of a lens is alike

/// Which of so many cells, the image's middle being between the middle ones; the outer ones have no end.
std::size_t cell_at(double normalized, std::size_t cells) {
  const double last = static_cast<double>(cells) - 1.0;
  return static_cast<std::size_t>(std::clamp(normalized / kCell + 0.5 * (last + 1.0), 0.0, last));
}

}  // namespace

void LensPattern::add(const Eigen::Vector2d& left, const Eigen::Vector2d& right, const CameraState& cameras) {
  const Eigen::Vector3d ray_C0 = cameras.lens_error[0].corrected(left).homogeneous();
  const Eigen::Vector2d seen = cameras.lens_error[1].corrected(right);
  const Eigen::Matrix3d R_C1C0 = cameras.T_C0C1.R.transpose();
  const Eigen::Vector3d line = R_C1C0 * cameras.T_C0C1.p.cross(ray_C0);
  const Eigen::Vector2d normal = line.head<2>().normalized();
  const Eigen::Vector2d far_away = (R_C1C0 * ray_C0).hnormalized();
  const double across = normal.dot(seen - far_away);
  const double disparity = normal.x() * (far_away - seen).y() - normal.y() * (far_away - seen).x();
  if (!std::isfinite(across) || !std::isfinite(disparity)) return;

  auto& row = cells_[cell_at(left.y(), cells_.size())];
  Cell& cell = row[cell_at(left.x(), row.size())];
  cell.count += 1.0;
  cell.across += across;
  cell.disparity += disparity;
  count_ += 1.0;
  across2_ += across * across;
  disparity2_ += disparity * disparity;
  added_ += 1.0;
}

void LensPattern::forget() {
  const auto cells = static_cast<double>(cells_.size() * cells_.front().size());
  const double kept = std::max(0.0, 1.0 - added_ / (kToKnow * cells));
  for (auto& row : cells_) {
    for (Cell& cell : row) {
      cell.count *= kept;
      cell.across *= kept;
      cell.disparity *= kept;
    }
  }
  count_ *= kept;
  across2_ *= kept;
  disparity2_ *= kept;
  added_ = 0.0;
}

/// One-way analysis of variance: between the cells there is what is within them, over their counts, and what stays.
double LensPattern::sigma() const {
  double between = 0.0;
  int cells = 0;
  for (const auto& row : cells_) {
    for (const Cell& cell : row) {
      if (cell.count < 1.0) continue;
      between += cell.across * cell.across / cell.count;
      ++cells;
    }
  }
  if (count_ - cells < kToKnow) return 0.0;
  const double within = std::max(0.0, across2_ - between) / (count_ - cells);
  return std::sqrt(std::max(0.0, between - cells * within) / count_);
}

/// Least squares over all disparities d, wrong by e: scale = sum(d e) / sum(d^2), with one e in each cell.
double LensPattern::scale_sigma() const {
  if (!(disparity2_ > 0.0)) return 0.0;
  double squares = 0.0;
  for (const auto& row : cells_) {
    for (const Cell& cell : row) squares += cell.disparity * cell.disparity;
  }
  return sigma() * std::sqrt(squares) / disparity2_;
}

}  // namespace ear
