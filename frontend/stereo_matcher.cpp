#include "frontend/stereo_matcher.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace ear {
namespace {

constexpr int kSearchLevel = StereoMatcher::kLevels - 1;
constexpr int kRefineLevel = 1;
constexpr double kSearchStepPx = 4.0;          // on the base image: one pixel of the search level
constexpr double kMaxOffLinePx = 3.0;          // of sixteen steps along a row of the patch, from first to last
constexpr double kMaxDisparityShare = 0.2;     // of the image's width
constexpr float kMinSearchCorrelation = 0.5F;  // on the search level
constexpr float kRivalMargin = 0.1F;           // a second peak this close to the first is looked at as well
constexpr float kAmbiguous = 0.03F;            // two places that differ less are not distinguished
constexpr double kMaxEpipolarPx = 2.5;         // calibrations are off by more than patches are, unless they say how far
constexpr double kWidestEpipolarPx = 12.0;     // beyond that other things are found
constexpr double kLinesApartPx = 4.0;          // where features may lie far off their lines
constexpr double kMinDisparityPx = -0.7;       // noise of a point at infinity
constexpr double kMaxDepthJumpPx = 1.5;        // disparity against what was carried over, plus
constexpr double kMaxDepthJumpShare = 0.1;     // this share of the disparity

// The two highest peaks of a line of correlations, the higher one first.
template <class Hypothesis>
class Peaks {
 public:
  void add(const Hypothesis& next) {
    if (last_ && rising_ && last_->correlation > next.correlation) keep(*last_);
    rising_ = !last_ || next.correlation >= last_->correlation;
    last_ = next;
  }
  /// Of one line; another may follow.
  void end() {
    if (last_ && rising_) keep(*last_);
    last_.reset();
    rising_ = false;
  }
  /// Those that are missing have a correlation of -1.
  [[nodiscard]] const std::array<Hypothesis, 2>& best() const { return best_; }

 private:
  void keep(const Hypothesis& peak) {
    if (!(peak.correlation > kMinSearchCorrelation)) return;
    if (peak.correlation > best_[0].correlation) {
      best_[1] = best_[0];
      best_[0] = peak;
    } else if (peak.correlation > best_[1].correlation) {
      best_[1] = peak;
    }
  }

  std::optional<Hypothesis> last_;
  bool rising_ = false;  // the last one is not below the one before
  std::array<Hypothesis, 2> best_;
};

/// How far features may lie off their epipolar lines [px], by what is stated of the right camera's rotation and of both
/// principal points.
double epipolar_band(const CameraCalibration& left, const CameraCalibration& right) {
  constexpr double kSigmas = 3.0;
  const auto centre = [](const CameraCalibration& camera) {
    return camera.intrinsics_sigma ? camera.intrinsics_sigma->principal_point : 0.0;
  };
  const double rotation = right.pose_sigma ? right.pose_sigma->rotation : 0.0;
  const double sigma = std::hypot(rotation * right.fv, centre(left), centre(right));
  return std::clamp(kSigmas * sigma, kMaxEpipolarPx, kWidestEpipolarPx);
}

}  // namespace

StereoMatcher::StereoMatcher(const CameraCalibration& left, const CameraCalibration& right, double nearest_depth)
    : left_lens_(left), right_lens_(right), epipolar_band_px_(epipolar_band(left, right)) {
  const Eigen::Isometry3d T_C1C0 = right.T_BC.inverse() * left.T_BC;
  right_from_left_ = {T_C1C0.linear(), T_C1C0.translation()};
  const double baseline = T_C1C0.translation().norm();
  if (!(baseline > 1e-4))
    throw std::invalid_argument("cameras: the two cameras of the stereo pair are at the same place");
  inverse_depth_per_pixel_ = 1.0 / (baseline * right_lens_.focal_px());
  max_inverse_depth_ =
      std::min(1.0 / nearest_depth, kMaxDisparityShare * static_cast<double>(right.width) * inverse_depth_per_pixel_);
}

std::optional<Eigen::Vector2d> StereoMatcher::project(const Eigen::Vector2d& left, double inverse_depth) const {
  const Eigen::Vector3d point = right_from_left_.scaled_point(left, inverse_depth);
  if (!(point.z() > 1e-3)) return std::nullopt;
  return right_lens_.to_pixel(point.hnormalized());
}

Eigen::Vector2d StereoMatcher::across_line(const Eigen::Vector2d& left) const {
  const auto far = project(left, 0.0);
  const auto near = project(left, 0.25 * max_inverse_depth_);
  if (!far || !near || *far == *near) return Eigen::Vector2d::UnitY();
  const Eigen::Vector2d along = (*near - *far).normalized();
  return {-along.y(), along.x()};
}

// `start` is what `surface` made expect. Where the patch came out more sheared than that along the epipolar line, the
// surface patch leans more.
std::optional<StereoMatch> StereoMatcher::accept(const ReferencePatch::Match& match, const Warp& start,
                                                 const Warp& left_warp, const Eigen::Vector2d& left,
                                                 const SurfacePatch& surface) const {
  const auto right = right_lens_.to_normalized(match.warp.centre.cast<double>());
  if (!right) return std::nullopt;
  const auto point = intersect(right_from_left_, left, *right);
  if (!point) return std::nullopt;
  if (point->epipolar_distance * right_lens_.focal_px() > epipolar_band_px_) return std::nullopt;
  if (point->inverse_depth < kMinDisparityPx * inverse_depth_per_pixel_) return std::nullopt;

  const Eigen::Matrix2d unexpected = ((match.warp.affine - start.affine) * left_warp.affine.inverse()).cast<double>();
  const Eigen::Vector2d slope = right_from_left_.p_10.head<2>() - *right * right_from_left_.p_10.z();
  const double focal_ratio = left_lens_.focal_px() / right_lens_.focal_px();
  const Eigen::Vector2d gradient =
      surface.gradient() + focal_ratio * unexpected.transpose() * slope / slope.squaredNorm();
  return StereoMatch{*right, SurfacePatch::through(left, std::max(point->inverse_depth, 0.0), gradient)};
}

std::optional<StereoMatch> StereoMatcher::follow(const ImagePyramid& right, const ReferencePatch& patch,
                                                 const Warp& left_warp, const Eigen::Vector2d& left,
                                                 const SurfacePatch& surface) const {
  const auto start = carry_over(left_warp, left, surface, right_from_left_, left_lens_, right_lens_);
  if (!start) return std::nullopt;
  const auto match = patch.align(right, *start, epipolar_band_px_ > kMaxEpipolarPx ? kRefineLevel : 0);
  if (!match) return std::nullopt;
  const auto accepted = accept(*match, *start, left_warp, left, surface);
  if (!accepted) return std::nullopt;
  const double inverse_depth = surface.inverse_depth(left);
  const double jump = std::abs(accepted->surface.inverse_depth(left) - inverse_depth);
  if (jump > kMaxDepthJumpPx * inverse_depth_per_pixel_ + kMaxDepthJumpShare * inverse_depth) return std::nullopt;
  return accepted;
}

std::optional<StereoMatcher::Columns> StereoMatcher::columns_from(const Eigen::Vector2d& left, double inverse_depth,
                                                                  const Warp& warp, const Eigen::Vector2d& aside,
                                                                  int level) const {
  Eigen::Vector2d column = static_cast<double>(1 << level) * warp.affine.col(0).cast<double>();
  const double length = kPatchSize * column.norm();
  const auto first = project(left, inverse_depth);
  const auto ahead = project(left, inverse_depth + length * inverse_depth_per_pixel_);
  if (!first || !ahead || *ahead == *first) return std::nullopt;
  const double step = length * inverse_depth_per_pixel_ * length / ((*ahead - *first).norm() * kPatchSize);
  const auto last = project(left, inverse_depth + kPatchSize * step);  // the lens compresses what is far off its axis
  if (!last) return std::nullopt;
  const bool backwards = column.dot(*last - *first) < 0.0;
  if (backwards) column = -column;
  const Eigen::Vector2d off = *last - (*first + kPatchSize * column);
  const double along = off.dot(column) / column.norm();
  const double across2 = off.squaredNorm() - along * along;
  if (std::abs(along) > kSearchStepPx || across2 > kMaxOffLinePx * kMaxOffLinePx) return std::nullopt;
  return Columns{*first + 0.5 * off + aside, column, step, backwards};
}

std::optional<StereoMatch> StereoMatcher::search(const ImagePyramid& right, const ReferencePatch& patch,
                                                 const Warp& left_warp, const Eigen::Vector2d& left) const {
  // How a surface patch that faces the camera looks hardly depends on its depth; take it halfway.
  const SurfacePatch facing = SurfacePatch::through(left, 0.25 * max_inverse_depth_);
  const auto carried = carry_over(left_warp, left, facing, right_from_left_, left_lens_, right_lens_);
  if (!carried) return std::nullopt;
  const auto at = [&](const Eigen::Vector2d& pixel) {
    Warp warp = *carried;
    warp.centre = pixel.cast<float>();
    return warp;
  };
  const int level = std::min(kSearchLevel, right.top_level());

  Peaks<Hypothesis> peaks;
  const double step = kSearchStepPx * inverse_depth_per_pixel_;
  const auto along_line = [&](const Eigen::Vector2d& aside) {
    double inverse_depth = 0.0;
    while (inverse_depth <= max_inverse_depth_) {
      if (const auto columns = columns_from(left, inverse_depth, *carried, aside, level)) {
        if (const auto correlations = patch.correlate_along(right, at(columns->lowest()), level)) {
          for (int i = 0; i < kPatchSize && inverse_depth <= max_inverse_depth_; ++i, inverse_depth += columns->step) {
            peaks.add({columns->place(i), (*correlations)[columns->number(i)]});
          }
          continue;
        }
      }
      for (int i = 0; i < kPatchSize && inverse_depth <= max_inverse_depth_; ++i, inverse_depth += step) {
        const auto pixel = project(left, inverse_depth);
        if (!pixel) continue;
        const Eigen::Vector2d beside = *pixel + aside;
        const auto correlation = patch.correlate(right, at(beside), level);
        if (correlation) peaks.add({beside, *correlation});
      }
    }
    peaks.end();
  };
  along_line(Eigen::Vector2d::Zero());
  const Eigen::Vector2d across = across_line(left);
  for (double aside = kLinesApartPx; aside < epipolar_band_px_; aside += kLinesApartPx) {
    along_line(aside * across);
    along_line(-aside * across);
  }

  std::optional<ReferencePatch::Match> best;
  for (const Hypothesis& peak : peaks.best()) {
    if (peak.correlation < peaks.best()[0].correlation - kRivalMargin) continue;  // also where there is none
    const auto match = patch.align(right, at(peak.pixel), kRefineLevel);
    if (!match) continue;
    if (!best) {
      best = match;
      continue;
    }
    if ((match->warp.centre - best->warp.centre).norm() < 2.0F) continue;  // both led to the same place
    if (std::abs(match->correlation - best->correlation) < kAmbiguous) return std::nullopt;
    if (match->correlation > best->correlation) best = match;
  }
  if (!best) return std::nullopt;
  return accept(*best, *carried, left_warp, left, facing);
}

}  // namespace ear
