#include "frontend/patch.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <cstring>

namespace ear {
namespace {

constexpr int kSize = PatchLevel::kSize;
constexpr float kHalf = PatchLevel::kHalf;

// How firmly the affine map is held near its prior: (grey noise / deviation expected)^2 = (3 / 0.05)^2.
constexpr float kAffinePrior = 3600.0F;

constexpr float kMinGain = 0.1F;  // contrast of the image over that of the patch; below, it is not the same thing

// Pixel coordinates in fixed point: integer part and weight are cheap to take apart.
constexpr int kFixedBits = 16;
constexpr int kFixedOne = 1 << kFixedBits;

// Added to coordinates before they are cut off, so that those in the border are positive and round down as well.
constexpr int kOffset = 64;

int to_fixed(float value) { return static_cast<int>(value * static_cast<float>(kFixedOne)); }

// Interpolates within a pair of neighbouring pixels, fetched from memory as one number (little-endian).
float blend(int pair, float weight) {
  const float first = static_cast<float>(pair & 255);
  const float second = static_cast<float>(pair >> 8);
  return first + weight * (second - first);
}

// Whether all offsets up to `half` from the centre can be interpolated.
bool inside(const GreyLevel& level, const Warp& warp, float half) {
  const float widest = 1.0F + half * warp.perspective.cwiseAbs().sum();
  const Eigen::Vector2f reach = half * widest * warp.affine.cwiseAbs().rowwise().sum();
  const float low = -static_cast<float>(level.border);
  const float high_x = static_cast<float>(level.width + level.border) - 2.0F;
  const float high_y = static_cast<float>(level.height + level.border) - 2.0F;
  // Written so that NaN is outside.
  return warp.centre.x() - reach.x() >= low && warp.centre.y() - reach.y() >= low &&
         warp.centre.x() + reach.x() <= high_x && warp.centre.y() + reach.y() <= high_y;
}

// Bilinear samples of an n x n patch under a warp; the caller has checked that it is inside. Fetching is kept apart
// from arithmetic, which compilers then turn into vector code. Leaves out `skip` rows above and below.
template <int n, int skip = 0>
void sample(const GreyLevel& level, const Warp& warp, float* out) {
  constexpr float kReach = 0.5F * (n - 1);
  constexpr float kScale = 1.0F / static_cast<float>(kFixedOne);
  // With o = (column - kReach, y): affine o (1 - perspective . o), in powers of the column.
  const Eigen::Vector2f ax = warp.affine.col(0);
  const Eigen::Vector2f ay = warp.affine.col(1);
  const float lx = warp.perspective.x();
  const float ly = warp.perspective.y();
  const std::ptrdiff_t stride = level.stride;
  const std::uint8_t* origin = level.origin - kOffset * (stride + 1);
  const Eigen::Vector2f bend = -lx * ax;
  const Eigen::Vector2f twist = -(ly * ax + lx * ay);  // change of the step from row to row
  const float top_y = static_cast<float>(skip) - kReach;
  const Eigen::Vector2f step = ax + kReach * lx * ax + kReach * lx * ax + top_y * twist;
  std::array<int, n> along_x, along_y;  // from the first pixel of a row
  std::array<int, n> twist_x, twist_y;  // their change from row to row
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto column = static_cast<float>(i);
    along_x[at] = to_fixed(column * (step.x() + column * bend.x()));
    along_y[at] = to_fixed(column * (step.y() + column * bend.y()));
    twist_x[at] = to_fixed(column * twist.x());
    twist_y[at] = to_fixed(column * twist.y());
  }
  std::array<int, n> x, y, above, below;  // the last two: pairs of neighbouring pixels
  for (int row = skip; row < n - skip; ++row, out += n) {
    const float offset_y = static_cast<float>(row) - kReach;
    const Eigen::Vector2f first = warp.centre + (offset_y * ay - kReach * ax) * (1.0F + kReach * lx - offset_y * ly);
    const int first_x = to_fixed(first.x() + static_cast<float>(kOffset));
    const int first_y = to_fixed(first.y() + static_cast<float>(kOffset));
    for (std::size_t i = 0; i < n; ++i) {
      x[i] = first_x + along_x[i];
      y[i] = first_y + along_y[i];
      along_x[i] += twist_x[i];
      along_y[i] += twist_y[i];
    }
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint8_t* p = origin + (y[i] >> kFixedBits) * stride + (x[i] >> kFixedBits);
      std::uint16_t pair;
      std::memcpy(&pair, p, 2);
      above[i] = pair;
      std::memcpy(&pair, p + stride, 2);
      below[i] = pair;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const float weight_x = kScale * static_cast<float>(x[i] & (kFixedOne - 1));
      const float weight_y = kScale * static_cast<float>(y[i] & (kFixedOne - 1));
      const float top = blend(above[i], weight_x);
      const float bottom = blend(below[i], weight_x);
      out[i] = top + weight_y * (bottom - top);
    }
  }
}

// First derivative along a direction of memory. Five taps: with three, fine texture looks flatter than it is, and
// every step overshoots.
float derivative(const float* p, std::ptrdiff_t stride) {
  return (8.0F * (p[stride] - p[-stride]) - (p[2 * stride] - p[-2 * stride])) * (1.0F / 12.0F);
}

// Brightness of the image under the patch, relative to the patch.
struct Photometry {
  float mean = 0.0F;         // of the image, less the mean of the patch
  float gain = 0.0F;         // contrast of the image over that of the patch
  float correlation = 0.0F;  // zero-mean normalized
};

using Quad = Eigen::Array4f;  // four pixels of a row, side by side in a vector register

constexpr std::size_t kQuad = 4;

Quad load(const float* p) { return Eigen::Map<const Quad, Eigen::Aligned16>(p); }

// Offsets from the patch's centre of four pixels in a row.
Quad offsets(std::size_t first_column) {
  return Quad(0.0F, 1.0F, 2.0F, 3.0F) + (static_cast<float>(first_column) - kHalf);
}

float offset(std::size_t row) { return static_cast<float>(row) - kHalf; }

// What every comparison of image and patch adds up. The image has the mean of the patch removed.
struct PhotometricSums {
  Quad image = Quad::Zero();
  Quad image2 = Quad::Zero();
  Quad product = Quad::Zero();

  void add(const Quad& image_quad, const Quad& value_quad) {
    image += image_quad;
    image2 += image_quad * image_quad;
    product += image_quad * value_quad;
  }

  [[nodiscard]] Photometry photometry(float energy) const {
    constexpr float kInverseCount = 1.0F / static_cast<float>(kSize * kSize);
    Photometry p;
    const float sum = image.sum();
    p.mean = sum * kInverseCount;
    const float variance = image2.sum() - sum * p.mean;
    const float covariance = product.sum();
    p.gain = covariance / energy;
    p.correlation = variance > 0.0F ? covariance / std::sqrt(variance * energy) : 0.0F;
    return p;
  }
};

// Sums of one row of a quantity q: q, q x, q x^2 with the offset x of each pixel.
struct RowMoments {
  Quad q = Quad::Zero();
  Quad q_x = Quad::Zero();
  Quad q_xx = Quad::Zero();

  void add(const Quad& value, const Quad& offset_x) {
    const Quad value_x = value * offset_x;
    q += value;
    q_x += value_x;
    q_xx += value_x * offset_x;
  }

  // Adds q (1, x, y) of the row at offset y.
  void add_to(Eigen::Vector3f& sum, float y) const {
    const float s = q.sum();
    sum += Eigen::Vector3f(s, q_x.sum(), s * y);
  }

  // Adds q (1, x, y)^T (1, x, y) of the row at offset y.
  void add_to(Eigen::Matrix3f& sum, float y) const {
    const float s = q.sum();
    const float s_x = q_x.sum();
    Eigen::Matrix3f m;
    m << s, s_x, s * y, s_x, q_xx.sum(), s_x * y, s * y, s_x * y, s * y * y;
    sum += m;
  }
};

float smaller_eigenvalue(const Eigen::Matrix2f& m) {
  const float half_difference = 0.5F * (m(0, 0) - m(1, 1));
  return 0.5F * m.trace() - std::sqrt(half_difference * half_difference + m(0, 1) * m(0, 1));
}

}  // namespace

bool PatchLevel::capture(const GreyLevel& level, const Eigen::Vector2f& centre) {
  constexpr int kReach = 2;  // of the derivative filter
  constexpr int kWide = kSize + 2 * kReach;
  const Warp warp{centre};
  if (!inside(level, warp, kHalf + kReach)) return false;
  alignas(16) std::array<float, kWide * kWide> wide;
  sample<kWide>(level, warp, wide.data());

  float sum = 0.0F;
  for (std::size_t row = 0; row < kSize; ++row) {
    const float* in = &wide[(row + kReach) * kWide + kReach];
    for (std::size_t i = 0; i < kSize; ++i) {
      const std::size_t at = row * kSize + i;
      value_[at] = in[i];
      gradient_x_[at] = derivative(in + i, 1);
      gradient_y_[at] = derivative(in + i, kWide);
      sum += in[i];
    }
  }
  mean_ = sum / static_cast<float>(kPixels);
  for (float& v : value_) v -= mean_;
  return solve_normal_equations();
}

bool PatchLevel::solve_normal_equations() {
  // A gradient times (1, x, y) gives three parameters, so every sum below is a 3x3 or 3x1 of moments over the patch.
  Eigen::Matrix3f xx = Eigen::Matrix3f::Zero();
  Eigen::Matrix3f xy = Eigen::Matrix3f::Zero();
  Eigen::Matrix3f yy = Eigen::Matrix3f::Zero();
  Eigen::Vector3f x_sum = Eigen::Vector3f::Zero();
  Eigen::Vector3f y_sum = Eigen::Vector3f::Zero();
  Eigen::Vector3f x_value = Eigen::Vector3f::Zero();
  Eigen::Vector3f y_value = Eigen::Vector3f::Zero();
  energy_ = 0.0F;
  for (std::size_t row = 0; row < kSize; ++row) {
    RowMoments gxx, gxy, gyy, gx, gy, gxv, gyv;
    Quad energy = Quad::Zero();
    for (std::size_t column = 0; column < kSize; column += kQuad) {
      const std::size_t at = row * kSize + column;
      const Quad x = load(&gradient_x_[at]);
      const Quad y = load(&gradient_y_[at]);
      const Quad v = load(&value_[at]);
      const Quad offset_x = offsets(column);
      gxx.add(x * x, offset_x);
      gxy.add(x * y, offset_x);
      gyy.add(y * y, offset_x);
      gx.add(x, offset_x);
      gy.add(y, offset_x);
      gxv.add(x * v, offset_x);
      gyv.add(y * v, offset_x);
      energy += v * v;
    }
    const float offset_y = offset(row);
    gxx.add_to(xx, offset_y);
    gxy.add_to(xy, offset_y);
    gyy.add_to(yy, offset_y);
    gx.add_to(x_sum, offset_y);
    gy.add_to(y_sum, offset_y);
    gxv.add_to(x_value, offset_y);
    gyv.add_to(y_value, offset_y);
    energy_ += energy.sum();
  }
  if (!(energy_ > 0.0F)) return false;

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
  information -= J_sum_ * J_sum_.transpose() / static_cast<float>(kPixels);
  information -= J_value_ * J_value_.transpose() / energy_;

  const Eigen::Matrix2f structure = information.topLeftCorner<2, 2>();
  corner_strength_ = smaller_eigenvalue(structure);
  if (!(corner_strength_ > 1.0F)) return false;
  covariance_position_ = structure.inverse();
  information.diagonal().tail<4>().array() += kAffinePrior;
  covariance_affine_ = information.llt().solve(Matrix6f::Identity());
  return true;
}

std::optional<PatchLevel::Step> PatchLevel::step_position(const GreyLevel& level, float scale, Warp& warp) const {
  if (!inside(level, warp, kHalf)) return std::nullopt;
  alignas(16) Pixels image;
  sample<kSize>(level, warp, image.data());
  PhotometricSums sums;
  Quad x = Quad::Zero();
  Quad y = Quad::Zero();
  for (std::size_t at = 0; at < kPixels; at += kQuad) {
    const Quad quad = load(&image[at]) - mean_;
    sums.add(quad, load(&value_[at]));
    x += load(&gradient_x_[at]) * quad;
    y += load(&gradient_y_[at]) * quad;
  }
  const Photometry p = sums.photometry(energy_);
  if (!(p.gain > kMinGain)) return std::nullopt;
  const Eigen::Vector2f residual =
      Eigen::Vector2f(x.sum(), y.sum()) - p.mean * J_sum_.head<2>() - p.gain * J_value_.head<2>();
  const Eigen::Vector2f moved = warp.affine * (covariance_position_ * residual) * (-scale / p.gain);
  warp.centre += moved;
  return Step{p.correlation, moved};
}

std::optional<PatchLevel::Step> PatchLevel::step_affine(const GreyLevel& level, const Eigen::Matrix2f& prior,
                                                        float scale, Warp& warp) const {
  if (!inside(level, warp, kHalf)) return std::nullopt;
  alignas(16) Pixels image;
  sample<kSize>(level, warp, image.data());
  PhotometricSums sums;
  Quad x = Quad::Zero(), x_x = x, x_y = x;  // gradient in x times image, times 1, offset in x, offset in y
  Quad y = Quad::Zero(), y_x = y, y_y = y;
  for (std::size_t row = 0; row < kSize; ++row) {
    const float offset_y = offset(row);
    for (std::size_t column = 0; column < kSize; column += kQuad) {
      const std::size_t at = row * kSize + column;
      const Quad quad = load(&image[at]) - mean_;
      sums.add(quad, load(&value_[at]));
      const Quad product_x = load(&gradient_x_[at]) * quad;
      const Quad product_y = load(&gradient_y_[at]) * quad;
      const Quad offset_x = offsets(column);
      x += product_x;
      x_x += product_x * offset_x;
      x_y += product_x * offset_y;
      y += product_y;
      y_x += product_y * offset_x;
      y_y += product_y * offset_y;
    }
  }
  const Photometry p = sums.photometry(energy_);
  if (!(p.gain > kMinGain)) return std::nullopt;
  Vector6f residual;
  residual << x.sum(), y.sum(), x_x.sum(), x_y.sum(), y_x.sum(), y_y.sum();
  residual -= p.mean * J_sum_ + p.gain * J_value_;
  residual /= p.gain;

  // The warp has already gone this far from its prior, in the parameters of the step.
  const Eigen::Matrix2f deviation = Eigen::Matrix2f::Identity() - prior.inverse() * warp.affine;
  residual.tail<4>() -=
      kAffinePrior * Eigen::Vector4f(deviation(0, 0), deviation(0, 1), deviation(1, 0), deviation(1, 1));

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
  constexpr std::size_t kSkip = 4;
  constexpr std::size_t kRows = kSize - 2 * kSkip;
  constexpr float kInverseCount = 1.0F / static_cast<float>(kRows * kSize);
  if (!inside(level, warp, kHalf)) return std::nullopt;
  alignas(16) std::array<float, kRows * kSize> image;
  sample<kSize, kSkip>(level, warp, image.data());
  PhotometricSums sums;
  Quad value = Quad::Zero();
  Quad value2 = Quad::Zero();
  for (std::size_t at = 0; at < image.size(); at += kQuad) {
    const Quad value_quad = load(&value_[kSkip * kSize + at]);
    sums.add(load(&image[at]) - mean_, value_quad);
    value += value_quad;
    value2 += value_quad * value_quad;
  }
  const float image_sum = sums.image.sum();
  const float value_sum = value.sum();
  const float covariance = sums.product.sum() - image_sum * value_sum * kInverseCount;
  const float variances = (sums.image2.sum() - image_sum * image_sum * kInverseCount) *
                          (value2.sum() - value_sum * value_sum * kInverseCount);
  return variances > 0.0F ? covariance / std::sqrt(variances) : 0.0F;
}

}  // namespace ear
