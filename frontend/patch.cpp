#include "frontend/patch.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>

namespace ear {
namespace {

// How firmly the affine map is held near its prior: (grey noise / deviation expected)^2 = (3 / 0.05)^2.
constexpr float kAffinePrior = 3600.0F;

constexpr float kMinGain = 0.1F;  // contrast of the image over that of the patch; below, it is not the same thing

// Whether all offsets up to `half` from the centre can be interpolated.
bool inside(const GreyLevel& level, const Warp& warp, float half) {
  const Eigen::Vector2f reach = warp.reach(half);
  const float low = -static_cast<float>(level.border);
  const float high_x = static_cast<float>(level.width + level.border) - 2.0F;
  const float high_y = static_cast<float>(level.height + level.border) - 2.0F;
  // Written so that NaN is outside.
  return warp.centre.x() - reach.x() >= low && warp.centre.y() - reach.y() >= low &&
         warp.centre.x() + reach.x() <= high_x && warp.centre.y() + reach.y() <= high_y;
}

PatchPlace place_of(const Warp& warp) {
  return {{warp.centre.x(), warp.centre.y()},
          {warp.affine(0, 0), warp.affine(1, 0)},
          {warp.affine(0, 1), warp.affine(1, 1)},
          {warp.perspective.x(), warp.perspective.y()}};
}

// Brightness of the image under the patch, relative to the patch.
struct Photometry {
  float mean = 0.0F;         // of the image, less the mean of the patch
  float gain = 0.0F;         // contrast of the image over that of the patch
  float correlation = 0.0F;  // zero-mean normalized
};

Photometry photometry_of(const AlignmentSums& sums, float energy) {
  constexpr float kInverseCount = 1.0F / static_cast<float>(kPatchPixels);
  Photometry p;
  p.mean = sums.image * kInverseCount;
  const float variance = sums.image2 - sums.image * p.mean;
  p.gain = sums.product / energy;
  p.correlation = variance > 0.0F ? sums.product / std::sqrt(variance * energy) : 0.0F;
  return p;
}

// Of a step that takes `decrease` off the sum of squared differences (patch less image, in units of the patch).
float chi2_of(float decrease, const Photometry& before, float energy, int parameters) {
  const float difference = energy * (1.0F / (before.correlation * before.correlation) - 1.0F);
  const float noise = (difference - decrease) / static_cast<float>(kPatchPixels - parameters - 2);  // gain and offset
  return noise > 0.0F ? decrease / noise : std::numeric_limits<float>::infinity();
}

Eigen::Vector3f vector_of(const Moments& m) { return {m.one, m.x, m.y}; }

Eigen::Matrix3f matrix_of(const Moments& m) {
  Eigen::Matrix3f matrix;
  matrix << m.one, m.x, m.y, m.x, m.xx, m.xy, m.y, m.xy, m.yy;
  return matrix;
}

float smaller_eigenvalue(const Eigen::Matrix2f& m) {
  const float half_difference = 0.5F * (m(0, 0) - m(1, 1));
  return 0.5F * m.trace() - std::sqrt(half_difference * half_difference + m(0, 1) * m(0, 1));
}

}  // namespace

bool PatchLevel::capture(const ImageKernels& kernels, const GreyLevel& level, const Eigen::Vector2f& centre,
                         bool affine) {
  if (!inside(level, Warp{centre}, kCaptured)) return false;
  kernels.capture(level, {centre.x(), centre.y()}, pixels_);
  return solve_normal_equations(kernels, affine);
}

bool PatchLevel::solve_normal_equations(const ImageKernels& kernels, bool affine) {
  PatchMoments moments{};
  (affine ? kernels.moments : kernels.position_moments)(pixels_, moments);
  energy_ = moments.energy;
  if (!(energy_ > 0.0F)) return false;
  constexpr float kInverseMiddle = 2.0F / static_cast<float>(kPatchPixels);
  middle_ = moments.middle;
  middle_variance_ = moments.middle2 - middle_ * middle_ * kInverseMiddle;

  // A gradient times (1, x, y) gives three parameters, so every sum below is a 3x3 or 3x1 of moments over the patch.
  const Eigen::Matrix3f xx = matrix_of(moments.gx_gx);
  const Eigen::Matrix3f xy = matrix_of(moments.gx_gy);
  const Eigen::Matrix3f yy = matrix_of(moments.gy_gy);
  const Eigen::Vector3f x_sum = vector_of(moments.gx);
  const Eigen::Vector3f y_sum = vector_of(moments.gy);
  const Eigen::Vector3f x_value = vector_of(moments.gx_value);
  const Eigen::Vector3f y_value = vector_of(moments.gy_value);

  // From gradients (x, y) times (1, x, y) to the order of the parameters: x, y, xx, xy, yx, yy.
  constexpr std::array<int, 3> kX{0, 2, 3};
  constexpr std::array<int, 3> kY{1, 4, 5};
  Matrix6f information;
  for (int i = 0; i < 3; ++i) {
    const int xi = kX[static_cast<std::size_t>(i)];
    const int yi = kY[static_cast<std::size_t>(i)];
    J_sum_[xi] = x_sum[i];
    J_sum_[yi] = y_sum[i];
    J_value_[xi] = x_value[i];
    J_value_[yi] = y_value[i];
    for (int j = 0; j < 3; ++j) {
      const int xj = kX[static_cast<std::size_t>(j)];
      const int yj = kY[static_cast<std::size_t>(j)];
      information(xi, xj) = xx(i, j);
      information(xi, yj) = xy(i, j);
      information(yi, xj) = xy(j, i);
      information(yi, yj) = yy(i, j);
    }
  }
  // Gain and offset are solved along with the warp: take out what they explain.
  information -= J_sum_ * J_sum_.transpose() / static_cast<float>(kPatchPixels);
  information -= J_value_ * J_value_.transpose() / energy_;

  const Eigen::Matrix2f structure = information.topLeftCorner<2, 2>();
  corner_strength_ = smaller_eigenvalue(structure);
  if (!(corner_strength_ > 1.0F)) return false;
  covariance_position_ = structure.inverse();
  if (!affine) return true;
  information.diagonal().tail<4>().array() += kAffinePrior;
  covariance_affine_ = information.llt().solve(Matrix6f::Identity());
  return true;
}

std::optional<PatchLevel::Step> PatchLevel::step_position(const ImageKernels& kernels, const GreyLevel& level,
                                                          float scale, Warp& warp) const {
  if (!inside(level, warp, kPatchHalf)) return std::nullopt;
  AlignmentSums sums;
  kernels.align_position(level, place_of(warp), pixels_, sums);
  const Photometry p = photometry_of(sums, energy_);
  if (!(p.gain > kMinGain)) return std::nullopt;
  const Eigen::Vector2f residual =
      (Eigen::Vector2f(sums.x, sums.y) - p.mean * J_sum_.head<2>() - p.gain * J_value_.head<2>()) / p.gain;
  const Eigen::Vector2f step = covariance_position_ * residual;
  const Eigen::Vector2f moved = warp.affine * step * -scale;
  warp.centre += moved;
  return Step{p.correlation, moved, chi2_of(step.dot(residual), p, energy_, 2)};
}

std::optional<PatchLevel::Step> PatchLevel::step_affine(const ImageKernels& kernels, const GreyLevel& level,
                                                        const Eigen::Matrix2f& prior, float scale, Warp& warp) const {
  if (!inside(level, warp, kPatchHalf)) return std::nullopt;
  AlignmentSums sums;
  kernels.align_affine(level, place_of(warp), pixels_, sums);
  const Photometry p = photometry_of(sums, energy_);
  if (!(p.gain > kMinGain)) return std::nullopt;
  Vector6f residual;
  residual << sums.x, sums.y, sums.x_x, sums.x_y, sums.y_x, sums.y_y;
  residual -= p.mean * J_sum_ + p.gain * J_value_;
  residual /= p.gain;

  // The warp has already gone this far from its prior, in the parameters of the step.
  const Eigen::Matrix2f deviation = Eigen::Matrix2f::Identity() - prior.inverse() * warp.affine;
  residual.tail<4>() -=
      kAffinePrior * Eigen::Vector4f(deviation(0, 0), deviation(0, 1), deviation(1, 0), deviation(1, 1));

  Vector6f step = covariance_affine_ * residual;
  const float chi2 = chi2_of(step.dot(residual), p, energy_, 6);
  step *= scale;
  Eigen::Matrix2f change;
  change << 1.0F + step[2], step[3], step[4], 1.0F + step[5];
  const Eigen::Matrix2f next = warp.affine * change.inverse();
  if (!(next.allFinite() && next.determinant() > 0.0F)) return std::nullopt;
  const Eigen::Vector2f moved = -(next * step.head<2>());
  warp.centre += moved;
  warp.affine = next;
  return Step{p.correlation, moved, chi2};
}

float PatchLevel::correlation(const AlignmentSums& sums) const {
  constexpr float kInverseCount = 2.0F / static_cast<float>(kPatchPixels);  // half of the rows
  const float covariance = sums.product - sums.image * middle_ * kInverseCount;
  const float variances = (sums.image2 - sums.image * sums.image * kInverseCount) * middle_variance_;
  return variances > 0.0F ? covariance / std::sqrt(variances) : 0.0F;
}

std::optional<float> PatchLevel::correlate(const ImageKernels& kernels, const GreyLevel& level,
                                           const Warp& warp) const {
  if (!inside(level, warp, kPatchHalf)) return std::nullopt;
  AlignmentSums sums;
  kernels.compare(level, place_of(warp), pixels_, sums);
  return correlation(sums);
}

std::optional<std::array<float, kPatchSize>> PatchLevel::correlate_along(const ImageKernels& kernels,
                                                                         const GreyLevel& level,
                                                                         const Warp& warp) const {
  constexpr float kMaxBent = 0.25F;  // [px] of the patch's corners by the perspective
  if (2.0F * kPatchHalf * kPatchHalf * warp.perspective.cwiseAbs().sum() > kMaxBent) return std::nullopt;
  const Warp flat{warp.centre, warp.affine};
  Warp last = flat;
  last.centre += static_cast<float>(kPatchSize) * warp.affine.col(0);
  if (!inside(level, flat, kPatchHalf) || !inside(level, last, kPatchHalf)) return std::nullopt;
  std::array<AlignmentSums, kPatchSize> sums;
  kernels.compare_along(level, place_of(flat), pixels_, sums);
  std::array<float, kPatchSize> correlations;
  for (std::size_t i = 0; i < sums.size(); ++i) correlations[i] = correlation(sums[i]);
  return correlations;
}

}  // namespace ear
