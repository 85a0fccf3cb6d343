#include "frontend/patch.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace ear {
namespace {

constexpr int kSize = PatchLevel::kSize;
constexpr float kHalf = PatchLevel::kHalf;

// How firmly the affine map is held near its prior: (grey noise / deviation expected)^2 = (3 / 0.05)^2.
constexpr float kAffinePrior = 3600.0F;

constexpr float kMinGain = 0.1F;  // contrast of the image over that of the patch; below, it is not the same thing

constexpr int kFixedBits = 16;   // fraction of a fixed-point pixel coordinate
constexpr int kWeightBits = 11;  // 8 + 2 * 11 bits fit into an int
constexpr int kWeightOne = 1 << kWeightBits;

int to_fixed(float value) { return static_cast<int>(std::lround(value * static_cast<float>(1 << kFixedBits))); }

// Whether all offsets up to `half` from the centre can be interpolated.
bool inside(const GreyLevel& level, const Warp& warp, float half) {
  const Eigen::Vector2f reach = half * warp.affine.cwiseAbs().rowwise().sum();
  const float low = -static_cast<float>(level.border);
  const float high_x = static_cast<float>(level.width + level.border) - 2.0F;
  const float high_y = static_cast<float>(level.height + level.border) - 2.0F;
  // Written so that NaN is outside.
  return warp.centre.x() - reach.x() >= low && warp.centre.y() - reach.y() >= low &&
         warp.centre.x() + reach.x() <= high_x && warp.centre.y() + reach.y() <= high_y;
}

// Bilinear samples of an n x n patch under a warp; the caller has checked that it is inside.
template <int n>
void sample(const GreyLevel& level, const Warp& warp, float* out) {
  constexpr float kReach = 0.5F * (n - 1);
  constexpr float kScale = 1.0F / static_cast<float>(kWeightOne * kWeightOne);
  const Eigen::Vector2f start = warp.centre - kReach * warp.affine.rowwise().sum();
  const int step_xx = to_fixed(warp.affine(0, 0));
  const int step_yx = to_fixed(warp.affine(1, 0));
  for (int row = 0; row < n; ++row) {
    const Eigen::Vector2f first = start + static_cast<float>(row) * warp.affine.col(1);
    int x = to_fixed(first.x());
    int y = to_fixed(first.y());
    for (int column = 0; column < n; ++column) {
      const std::uint8_t* p = level.origin + (y >> kFixedBits) * level.stride + (x >> kFixedBits);
      const int wx = (x >> (kFixedBits - kWeightBits)) & (kWeightOne - 1);
      const int wy = (y >> (kFixedBits - kWeightBits)) & (kWeightOne - 1);
      const int top = (p[0] << kWeightBits) + wx * (p[1] - p[0]);
      const int bottom = (p[level.stride] << kWeightBits) + wx * (p[level.stride + 1] - p[level.stride]);
      *out++ = kScale * static_cast<float>((top << kWeightBits) + wy * (bottom - top));
      x += step_xx;
      y += step_yx;
    }
  }
}

// First derivative along a direction of memory. Five taps: with three, fine texture looks flatter than it is, and
// every step overshoots.
float derivative(const float* p, std::ptrdiff_t stride) {
  return (8.0F * (p[stride] - p[-stride]) - (p[2 * stride] - p[-2 * stride])) * (1.0F / 12.0F);
}

// One accumulator for each column: rows are added up side by side, which compilers turn into vector code.
using Lanes = std::array<float, kSize>;

float total(const Lanes& lanes) {
  float sum = 0.0F;
  for (const float lane : lanes) sum += lane;
  return sum;
}

// Sum over the lanes, weighted with the x offset from the patch's centre.
float total_times_x(const Lanes& lanes) {
  float sum = 0.0F;
  for (int column = 0; column < kSize; ++column) {
    sum += (static_cast<float>(column) - kHalf) * lanes[static_cast<std::size_t>(column)];
  }
  return sum;
}

// Brightness of the image under the patch, relative to the patch.
struct Photometry {
  float mean = 0.0F;         // of the image, less the mean of the patch
  float gain = 0.0F;         // contrast of the image over that of the patch
  float correlation = 0.0F;  // zero-mean normalized
};

struct Sums {
  Lanes image{}, image2{}, product{};

  // `image_row` has the patch's mean removed.
  void add_row(const float* image_row, const float* value_row) {
    for (std::size_t i = 0; i < kSize; ++i) {
      image[i] += image_row[i];
      image2[i] += image_row[i] * image_row[i];
      product[i] += image_row[i] * value_row[i];
    }
  }

  [[nodiscard]] Photometry photometry(float energy) const {
    constexpr float kInverseCount = 1.0F / static_cast<float>(kSize * kSize);
    Photometry p;
    const float sum = total(image);
    p.mean = sum * kInverseCount;
    const float variance = total(image2) - sum * p.mean;
    const float covariance = total(product);
    p.gain = covariance / energy;
    p.correlation = variance > 0.0F ? covariance / std::sqrt(variance * energy) : 0.0F;
    return p;
  }
};

}  // namespace

bool PatchLevel::capture(const GreyLevel& level, const Eigen::Vector2f& centre) {
  constexpr int kReach = 2;  // of the derivative filter
  constexpr int kWide = kSize + 2 * kReach;
  const Warp warp{centre, Eigen::Matrix2f::Identity()};
  if (!inside(level, warp, kHalf + kReach)) return false;
  std::array<float, kWide * kWide> wide;
  sample<kWide>(level, warp, wide.data());

  Lanes sum{};
  for (int row = 0; row < kSize; ++row) {
    const float* in = &wide[static_cast<std::size_t>((row + kReach) * kWide + kReach)];
    const std::size_t out = static_cast<std::size_t>(row * kSize);
    for (std::size_t i = 0; i < kSize; ++i) {
      value_[out + i] = in[i];
      gradient_x_[out + i] = derivative(in + i, 1);
      gradient_y_[out + i] = derivative(in + i, kWide);
      sum[i] += in[i];
    }
  }
  mean_ = total(sum) / static_cast<float>(kPixels);
  for (float& v : value_) v -= mean_;

  // Normal equations of the six parameters, and their products with a constant and with the patch.
  Matrix6f information = Matrix6f::Zero();
  J_sum_.setZero();
  J_value_.setZero();
  energy_ = 0.0F;
  Eigen::Matrix3f xx = Eigen::Matrix3f::Zero();  // sums of gx gx (1, x, y)^T (1, x, y), and so on
  Eigen::Matrix3f xy = Eigen::Matrix3f::Zero();
  Eigen::Matrix3f yy = Eigen::Matrix3f::Zero();
  Eigen::Vector3f x_sum = Eigen::Vector3f::Zero(), y_sum = x_sum, x_value = x_sum, y_value = x_sum;
  for (int row = 0; row < kSize; ++row) {
    Lanes gxx, gxy, gyy, gxv, gyv;
    const std::size_t at = static_cast<std::size_t>(row * kSize);
    for (std::size_t i = 0; i < kSize; ++i) {
      const float gx = gradient_x_[at + i];
      const float gy = gradient_y_[at + i];
      gxx[i] = gx * gx;
      gxy[i] = gx * gy;
      gyy[i] = gy * gy;
      gxv[i] = gx * value_[at + i];
      gyv[i] = gy * value_[at + i];
    }
    const float y = static_cast<float>(row) - kHalf;
    for (std::size_t i = 0; i < kSize; ++i) {
      const Eigen::Vector3f w(1.0F, static_cast<float>(i) - kHalf, y);
      xx += gxx[i] * w * w.transpose();
      xy += gxy[i] * w * w.transpose();
      yy += gyy[i] * w * w.transpose();
      x_sum += gradient_x_[at + i] * w;
      y_sum += gradient_y_[at + i] * w;
      x_value += gxv[i] * w;
      y_value += gyv[i] * w;
      energy_ += value_[at + i] * value_[at + i];
    }
  }
  if (!(energy_ > 0.0F)) return false;
  // From (gx, gy) x (1, x, y) to the order of the parameters: x, y, xx, xy, yx, yy.
  constexpr std::array<int, 3> kX{0, 2, 3};
  constexpr std::array<int, 3> kY{1, 4, 5};
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
  information -= J_sum_ * J_sum_.transpose() / static_cast<float>(kPixels);
  information -= J_value_ * J_value_.transpose() / energy_;

  const Eigen::Matrix2f structure = information.topLeftCorner<2, 2>();
  corner_strength_ = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f>().computeDirect(structure).eigenvalues()[0];
  if (!(corner_strength_ > 1.0F)) return false;
  covariance_position_ = structure.inverse();
  information.diagonal().tail<4>().array() += kAffinePrior;
  covariance_affine_ = information.inverse();
  return true;
}

std::optional<PatchLevel::Step> PatchLevel::step_position(const GreyLevel& level, float scale, Warp& warp) const {
  if (!inside(level, warp, kHalf)) return std::nullopt;
  Pixels image;
  sample<kSize>(level, warp, image.data());
  Sums sums;
  Lanes x{}, y{};
  for (std::size_t at = 0; at < kPixels; at += kSize) {
    for (std::size_t i = 0; i < kSize; ++i) image[at + i] -= mean_;
    sums.add_row(&image[at], &value_[at]);
    for (std::size_t i = 0; i < kSize; ++i) {
      x[i] += gradient_x_[at + i] * image[at + i];
      y[i] += gradient_y_[at + i] * image[at + i];
    }
  }
  const Photometry p = sums.photometry(energy_);
  if (!(p.gain > kMinGain)) return std::nullopt;
  const Eigen::Vector2f residual = Eigen::Vector2f(total(x), total(y)) - p.mean * J_sum_.head<2>() - p.gain * J_value_.head<2>();
  const Eigen::Vector2f moved = warp.affine * (covariance_position_ * residual) * (-scale / p.gain);
  warp.centre += moved;
  return Step{p.correlation, moved};
}

std::optional<PatchLevel::Step> PatchLevel::step_affine(const GreyLevel& level, const Eigen::Matrix2f& prior,
                                                        float scale, Warp& warp) const {
  if (!inside(level, warp, kHalf)) return std::nullopt;
  Pixels image;
  sample<kSize>(level, warp, image.data());
  Sums sums;
  Lanes x{}, y{}, x_y{}, y_y{};
  for (int row = 0; row < kSize; ++row) {
    const std::size_t at = static_cast<std::size_t>(row * kSize);
    const float offset_y = static_cast<float>(row) - kHalf;
    for (std::size_t i = 0; i < kSize; ++i) image[at + i] -= mean_;
    sums.add_row(&image[at], &value_[at]);
    for (std::size_t i = 0; i < kSize; ++i) {
      const float product_x = gradient_x_[at + i] * image[at + i];
      const float product_y = gradient_y_[at + i] * image[at + i];
      x[i] += product_x;
      y[i] += product_y;
      x_y[i] += product_x * offset_y;
      y_y[i] += product_y * offset_y;
    }
  }
  const Photometry p = sums.photometry(energy_);
  if (!(p.gain > kMinGain)) return std::nullopt;
  Vector6f residual;
  residual << total(x), total(y), total_times_x(x), total(x_y), total_times_x(y), total(y_y);
  residual -= p.mean * J_sum_ + p.gain * J_value_;
  residual /= p.gain;

  // The warp has already gone this far from its prior, in the parameters of the step.
  const Eigen::Matrix2f deviation = Eigen::Matrix2f::Identity() - prior.inverse() * warp.affine;
  residual.tail<4>() -= kAffinePrior * Eigen::Vector4f(deviation(0, 0), deviation(0, 1), deviation(1, 0), deviation(1, 1));

  const Vector6f step = scale * covariance_affine_ * residual;
  Eigen::Matrix2f change;
  change << 1.0F + step[2], step[3], step[4], 1.0F + step[5];
  const Eigen::Matrix2f next = warp.affine * change.inverse();
  if (!(next.allFinite() && next.determinant() > 0.0F)) return std::nullopt;
  const Eigen::Vector2f moved = -(next * step.head<2>());
  warp.centre += moved;
  warp.affine = next;
  return Step{p.correlation, moved};
}

std::optional<float> PatchLevel::correlate(const GreyLevel& level, const Warp& warp) const {
  if (!inside(level, warp, kHalf)) return std::nullopt;
  Pixels image;
  sample<kSize>(level, warp, image.data());
  Sums sums;
  for (std::size_t at = 0; at < kPixels; at += kSize) {
    for (std::size_t i = 0; i < kSize; ++i) image[at + i] -= mean_;
    sums.add_row(&image[at], &value_[at]);
  }
  return sums.photometry(energy_).correlation;
}

}  // namespace ear
