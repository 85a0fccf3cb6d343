// The kernels themselves, without a name for the processor: each kernels_*.cpp says EAR_VARIANT and includes this.
// Nothing here may instantiate or inline what other files share, or the linker could take an AVX2 version of it: hence
// plain arrays, and definitions that no other file includes.
#pragma once

#include "frontend/eight.h"
#include "frontend/image_kernels.h"

// NOLINTBEGIN(modernize-avoid-c-arrays,misc-definitions-in-headers): see above
namespace ear::EAR_VARIANT {
namespace {

constexpr int kGroups = kPatchSize / 8;  // of eight columns
constexpr int kSize = kPatchSize;
constexpr int kSkip = kSize / 4;  // rows above and below that compare() leaves out

// Pixel coordinates in fixed point: integer part and weight are cheap to take apart.
constexpr int kFixedBits = 16;
constexpr int kFixedOne = 1 << kFixedBits;
constexpr int kWeightBits = 14;  // of a pixel against its neighbour in the row: products of 16 bits
constexpr float kUnit = static_cast<float>(1 << kWeightBits);  // of interpolated pixels: a grey value

// Added to coordinates before they are cut off, so that those in the border are positive and round down as well.
constexpr int kOffset = 64;

inline int to_fixed(float value) { return static_cast<int>(value * static_cast<float>(kFixedOne)); }
inline Ints to_fixed(const Floats& values) { return to_ints(values * static_cast<float>(kFixedOne)); }
inline std::uint8_t lesser(std::uint8_t a, std::uint8_t b) { return b < a ? b : a; }
inline std::uint8_t greater(std::uint8_t a, std::uint8_t b) { return b > a ? b : a; }
inline int smaller(int a, int b) { return b < a ? b : a; }

// Pixels at (x, y) and (x, y + 1), each with its right neighbour in the upper 16 bits.
struct Pairs {
  Ints above, below;
};

inline Ints pairs_of(const int* bytes) {  // both in the lower 16 bits
  const Ints both = load<Ints>(bytes);
  return (both & 0xff) | ((both & 0xff00) << 8);
}

// Any pixels, one by one; `x` and `y` in fixed point, from that at `p`.
inline Pairs fetch_each(const std::uint8_t* p, std::ptrdiff_t stride, const Ints& x, const Ints& y) {
  alignas(32) int at_x[8], at_y[8], above[8], below[8];
  store(at_x, x >> kFixedBits);
  store(at_y, y >> kFixedBits);
  for (int i = 0; i < 8; ++i) {
    const std::uint8_t* const q = p + at_y[i] * stride + at_x[i];
    std::uint16_t pair;
    std::memcpy(&pair, q, 2);
    above[i] = pair;
    std::memcpy(&pair, q + stride, 2);
    below[i] = pair;
  }
  return {pairs_of(above), pairs_of(below)};
}

// Pixels that are within 15 columns and two rows from that at `p`.
inline Pairs fetch_near(const std::uint8_t* p, std::ptrdiff_t stride, const Ints& x, const Ints& y) {
#if EAR_HAS_PICK
  const Ints left = x >> kFixedBits;
  const Ints numbers = (left | (left << 16)) + static_cast<int>(0x80018000U);
  const Ints first = pick(p, numbers);
  const Ints second = pick(p + stride, numbers);
  const Ints third = pick(p + 2 * stride, numbers);
  const Ints lower = y << (31 - kFixedBits);  // negative where the second row is above
  return {choose(first, second, lower), choose(second, third, lower)};
#else
  const Ints left = (x >> kFixedBits) - count_up();
  const Ints lower = y << (31 - kFixedBits);
  const auto rows = [&](const std::uint8_t* q) -> Pairs {
    const Ints second = neighbours(q + stride);
    return {choose(neighbours(q), second, lower), choose(second, neighbours(q + 2 * stride), lower)};
  };
  const int shift = smaller(at(left, 0), at(left, 7));
  const Ints further = left - shift;  // all 0 or 1, unless the warp stretches much
  if (!any(further)) return rows(p + shift);
  if (any(further & ~1)) return fetch_each(p, stride, x, y);
  const Pairs near = rows(p + shift);
  const Pairs far = rows(p + shift + 1);
  const Ints which = further << 31;
  return {choose(near.above, far.above, which), choose(near.below, far.below, which)};
#endif
}

// Eight pixels of the image in units of 1 / kUnit of a grey value, interpolated.
inline Floats interpolate(const Pairs& pairs, const Ints& x, const Ints& y) {
  const Ints weight = (x >> (kFixedBits - kWeightBits)) & ((1 << kWeightBits) - 1);
  const Ints weights = ((weight << 16) - weight) + (1 << kWeightBits);  // of the left pixel below, of the right above
  const Floats top = to_floats(add_products(pairs.above, weights));
  const Floats bottom = to_floats(add_products(pairs.below, weights));
  const Floats down = to_floats(y & (kFixedOne - 1)) * (1.0F / static_cast<float>(kFixedOne));
  return top + down * (bottom - top);
}

// Offsets from the patch's centre of eight pixels in a row.
inline Floats offsets(int group) {
  alignas(32) constexpr float kFirst[8] = {0.0F, 1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 7.0F};
  return load<Floats>(kFirst) + (static_cast<float>(8 * group) - kPatchHalf);
}

inline float offset(int row) { return static_cast<float>(row) - kPatchHalf; }

inline float size(float value) { return value < 0.0F ? -value : value; }

// Goes through a patch under a warp, row by row, eight columns at a time.
class Walk {
 public:
  // With o = (column - half, y): A o (1 - perspective . o), in powers of the column.
  Walk(const GreyLevel& level, const PatchPlace& place, int first_row)
      : place_(place), stride_(level.stride), origin_(level.origin - kOffset * (level.stride + 1)) {
    const float lx = place.perspective[0];
    const float ly = place.perspective[1];
    float steps[2], changes[2];
    for (std::size_t k = 0; k < 2; ++k) {  // x, y
      const float ax = place.column_x[k];
      const float ay = place.column_y[k];
      const float bend = -lx * ax;
      const float twist = -(ly * ax + lx * ay);  // change of the step from row to row
      const float step = ax + kPatchHalf * lx * ax + kPatchHalf * lx * ax + offset(first_row) * twist;
      for (int group = 0; group < kGroups; ++group) {
        const Floats column = offsets(group) + kPatchHalf;
        along_[k][group] = to_fixed(column * (column * bend + step));
        twist_[k][group] = to_fixed(column * twist);
      }
      steps[k] = step;
      changes[k] = static_cast<float>(kSize) * (2.0F * size(bend) + size(twist));  // of the step, at most
    }
    // Eight pixels lie near each other unless the warp turns or stretches a lot. The highest is the first or the last
    // of them, or above these by no more than the row bends, and than rounding.
    const float margin = 13.0F * size(place.perspective[0] * place.column_x[1]) + 0.01F;
    margin_ = to_fixed(margin);
    near_ = steps[0] - changes[0] > 0.0F && 7.0F * (steps[0] + changes[0]) < 14.0F &&
            7.0F * (size(steps[1]) + changes[1]) + margin < 0.99F;
  }

  void begin_row(int row) {
    const float y = offset(row);
    const float scale = 1.0F + kPatchHalf * place_.perspective[0] - y * place_.perspective[1];
    const float x0 = place_.centre[0] + (y * place_.column_y[0] - kPatchHalf * place_.column_x[0]) * scale;
    const float y0 = place_.centre[1] + (y * place_.column_y[1] - kPatchHalf * place_.column_x[1]) * scale;
    first_x_ = to_fixed(x0 + static_cast<float>(kOffset));
    first_y_ = to_fixed(y0 + static_cast<float>(kOffset));
  }

  // Of the row that was begun, each group once.
  Floats take(int group) {
    const int near_x = (first_x_ + at(along_[0][group], 0)) >> kFixedBits;
    const int highest = smaller(at(along_[1][group], 0), at(along_[1][group], 7));
    const int near_y = (first_y_ + highest - margin_) >> kFixedBits;
    const std::uint8_t* const p = origin_ + near_y * stride_ + near_x;
    const Ints x = along_[0][group] + (first_x_ - (near_x << kFixedBits));
    const Ints y = along_[1][group] + (first_y_ - (near_y << kFixedBits));
    along_[0][group] += twist_[0][group];
    along_[1][group] += twist_[1][group];
    return interpolate(near_ ? fetch_near(p, stride_, x, y) : fetch_each(p, stride_, x, y), x, y);
  }

 private:
  const PatchPlace& place_;
  std::ptrdiff_t stride_;
  const std::uint8_t* origin_;
  bool near_;
  int margin_;
  int first_x_ = 0;
  int first_y_ = 0;
  Ints along_[2][kGroups];  // from the first pixel of a row
  Ints twist_[2][kGroups];  // their change from row to row
};

inline float grey(const Floats& sums) { return sum(sums) * (1.0F / kUnit); }

struct Photometry {
  Floats image{}, image2{}, product{};

  void add(const Floats& pixels, const Floats& value) {
    image += pixels;
    image2 += pixels * pixels;
    product += pixels * value;
  }
  void put(AlignmentSums& sums) const {
    sums.image = grey(image);
    sums.image2 = grey(image2) * (1.0F / kUnit);
    sums.product = grey(product);
  }
};

void align_position(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums) {
  Walk walk(level, place, 0);
  const float mean = patch.mean * kUnit;
  Photometry photometry;
  Floats x{}, y{};
  for (int row = 0; row < kSize; ++row) {
    walk.begin_row(row);
#pragma GCC unroll 2
    for (int group = 0; group < kGroups; ++group) {
      const int at = row * kSize + 8 * group;
      const Floats pixels = walk.take(group) - mean;
      photometry.add(pixels, load<Floats>(patch.value.data() + at));
      x += load<Floats>(patch.gradient_x.data() + at) * pixels;
      y += load<Floats>(patch.gradient_y.data() + at) * pixels;
    }
  }
  photometry.put(sums);
  sums.x = grey(x);
  sums.y = grey(y);
}

void align_affine(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums) {
  Walk walk(level, place, 0);
  const float mean = patch.mean * kUnit;
  Photometry photometry;
  Floats x[kGroups] = {}, y[kGroups] = {};  // of columns: products with the offset in x wait until the end
  Floats x_y{}, y_y{};
  for (int row = 0; row < kSize; ++row) {
    walk.begin_row(row);
    Floats row_x{}, row_y{};
#pragma GCC unroll 2
    for (int group = 0; group < kGroups; ++group) {
      const int at = row * kSize + 8 * group;
      const Floats pixels = walk.take(group) - mean;
      photometry.add(pixels, load<Floats>(patch.value.data() + at));
      const Floats product_x = load<Floats>(patch.gradient_x.data() + at) * pixels;
      const Floats product_y = load<Floats>(patch.gradient_y.data() + at) * pixels;
      x[group] += product_x;
      y[group] += product_y;
      row_x += product_x;
      row_y += product_y;
    }
    x_y += row_x * offset(row);
    y_y += row_y * offset(row);
  }
  photometry.put(sums);
  sums.x = grey(x[0] + x[1]);
  sums.y = grey(y[0] + y[1]);
  sums.x_x = grey(x[0] * offsets(0) + x[1] * offsets(1));
  sums.y_x = grey(y[0] * offsets(0) + y[1] * offsets(1));
  sums.x_y = grey(x_y);
  sums.y_y = grey(y_y);
}

void compare(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums) {
  Walk walk(level, place, kSkip);
  const float mean = patch.mean * kUnit;
  Photometry photometry;
  for (int row = kSkip; row < kSize - kSkip; ++row) {
    walk.begin_row(row);
#pragma GCC unroll 2
    for (int group = 0; group < kGroups; ++group) {
      photometry.add(walk.take(group) - mean, load<Floats>(patch.value.data() + row * kSize + 8 * group));
    }
  }
  photometry.put(sums);
}

// First derivative. Five taps: with three, fine texture looks flatter than it is, and every step overshoots.
inline Floats derivative(const Floats& before2, const Floats& before, const Floats& after, const Floats& after2) {
  return ((after - before) * 8.0F - (after2 - before2)) * (1.0F / 12.0F);
}

void capture(const GreyLevel& level, const std::array<float, 2>& centre, PatchPixels& patch) {
  constexpr int kReach = 2;  // of the derivative
  constexpr int kWide = kSize + 2 * kReach;
  constexpr int kRow = 24;  // kWide, in eights
  alignas(32) float wide[kWide * kRow];
  const int x = to_fixed(centre[0] - kPatchHalf - static_cast<float>(kReach) + static_cast<float>(kOffset));
  const int y = to_fixed(centre[1] - kPatchHalf - static_cast<float>(kReach) + static_cast<float>(kOffset));
  const std::uint8_t* corner =
      level.origin + ((y >> kFixedBits) - kOffset) * level.stride + ((x >> kFixedBits) - kOffset);
  const float weight_x = static_cast<float>(x & (kFixedOne - 1)) * (1.0F / static_cast<float>(kFixedOne));
  const float weight_y = static_cast<float>(y & (kFixedOne - 1)) * (1.0F / static_cast<float>(kFixedOne));
  for (int row = 0; row < kWide; ++row, corner += level.stride) {
    float* const out = wide + row * kRow;
    const std::uint8_t* const below = corner + level.stride;
    for (int i = 0; i < kRow; ++i) {  // in eights; the last four are not looked at
      const auto top = static_cast<float>(corner[i]);
      const auto bottom = static_cast<float>(below[i]);
      const float left = top + weight_x * (static_cast<float>(corner[i + 1]) - top);
      const float right = bottom + weight_x * (static_cast<float>(below[i + 1]) - bottom);
      out[i] = left + weight_y * (right - left);
    }
  }
  Floats total{};
  for (int row = 0; row < kSize; ++row) {
    for (int group = 0; group < kGroups; ++group) {
      const float* const in = wide + (row + kReach) * kRow + kReach + 8 * group;
      const int at = row * kSize + 8 * group;
      const Floats pixels = load<Floats>(in);
      total += pixels;
      store(patch.value.data() + at, pixels);
      store(patch.gradient_x.data() + at,
            derivative(load<Floats>(in - 2), load<Floats>(in - 1), load<Floats>(in + 1), load<Floats>(in + 2)));
      store(patch.gradient_y.data() + at, derivative(load<Floats>(in - 2 * kRow), load<Floats>(in - kRow),
                                                     load<Floats>(in + kRow), load<Floats>(in + 2 * kRow)));
    }
  }
  patch.mean = sum(total) * (1.0F / static_cast<float>(kPatchPixels));
  for (int at = 0; at < kPatchPixels; at += 8) {
    store(patch.value.data() + at, load<Floats>(patch.value.data() + at) - patch.mean);
  }
}

// Sums over the rows of one group of columns, of a quantity times 1, y, y^2.
struct ColumnMoments {
  Floats one{}, y{}, yy{};

  void add(const Floats& quantity, float offset_y) {
    const Floats times_y = quantity * offset_y;
    one += quantity;
    y += times_y;
    yy += times_y * offset_y;
  }
};

struct ColumnSums {  // without y^2
  Floats one{}, y{};

  void add(const Floats& quantity, float offset_y) {
    one += quantity;
    y += quantity * offset_y;
  }
};

inline void put(const ColumnMoments (&columns)[kGroups], Moments& out) {
  const Floats x0 = columns[0].one * offsets(0);
  const Floats x1 = columns[1].one * offsets(1);
  out.one = sum(columns[0].one + columns[1].one);
  out.x = sum(x0 + x1);
  out.y = sum(columns[0].y + columns[1].y);
  out.xx = sum(x0 * offsets(0) + x1 * offsets(1));
  out.xy = sum(columns[0].y * offsets(0) + columns[1].y * offsets(1));
  out.yy = sum(columns[0].yy + columns[1].yy);
}

inline void put(const ColumnSums (&columns)[kGroups], Moments& out) {
  out.one = sum(columns[0].one + columns[1].one);
  out.x = sum(columns[0].one * offsets(0) + columns[1].one * offsets(1));
  out.y = sum(columns[0].y + columns[1].y);
}

void moments(const PatchPixels& patch, PatchMoments& out) {
  Floats energy{}, middle{}, middle2{};
  ColumnMoments gx_gx[kGroups], gx_gy[kGroups], gy_gy[kGroups];
  ColumnSums gx[kGroups], gy[kGroups], gx_value[kGroups], gy_value[kGroups];
  for (int group = 0; group < kGroups; ++group) {
    for (int row = 0; row < kSize; ++row) {
      const int at = row * kSize + 8 * group;
      const Floats x = load<Floats>(patch.gradient_x.data() + at);
      const Floats y = load<Floats>(patch.gradient_y.data() + at);
      const Floats value = load<Floats>(patch.value.data() + at);
      const float offset_y = offset(row);
      gx_gx[group].add(x * x, offset_y);
      gx_gy[group].add(x * y, offset_y);
      gy_gy[group].add(y * y, offset_y);
      gx[group].add(x, offset_y);
      gy[group].add(y, offset_y);
      gx_value[group].add(x * value, offset_y);
      gy_value[group].add(y * value, offset_y);
      energy += value * value;
      if (row < kSkip || row >= kSize - kSkip) continue;
      middle += value;
      middle2 += value * value;
    }
  }
  put(gx_gx, out.gx_gx);
  put(gx_gy, out.gx_gy);
  put(gy_gy, out.gy_gy);
  put(gx, out.gx);
  put(gy, out.gy);
  put(gx_value, out.gx_value);
  put(gy_value, out.gy_value);
  out.energy = sum(energy);
  out.middle = sum(middle);
  out.middle2 = sum(middle2);
}

void halve_row(const std::array<const std::uint8_t*, 5>& rows, int width, std::uint16_t* sums, std::uint8_t* out) {
  constexpr int kReach = 2;
  const std::uint8_t* const a = rows[0] - kReach;
  const std::uint8_t* const b = rows[1] - kReach;
  const std::uint8_t* const c = rows[2] - kReach;
  const std::uint8_t* const d = rows[3] - kReach;
  const std::uint8_t* const e = rows[4] - kReach;
  const int columns = 2 * width + 2 * kReach;
  for (int i = 0; i < columns; ++i) {
    sums[i] = static_cast<std::uint16_t>(a[i] + e[i] + 4 * (b[i] + d[i]) + 6 * c[i]);
  }
  for (int i = columns; i < columns + 16; ++i) sums[i] = 0;  // of pixels that nobody looks at
  for (int i = 0; i < width; i += 8) {                       // in pairs of neighbours
    const Ints first = add_products(load<Ints>(sums + 2 * i), all(1 | (4 << 16)));
    const Ints second = add_products(load<Ints>(sums + 2 * i + 2), all(6 | (4 << 16)));
    const Ints third = add_products(load<Ints>(sums + 2 * i + 4), all(1));
    store_bytes(out + i, (first + second + third + 128) >> 8);
  }
}

constexpr int kBlock = 32;  // pixels at a time
using Block = std::uint8_t[kBlock];

// The largest, over all arcs of nine, of the smallest of the 16 on the circle.
inline void add_arcs(const Block (&circle)[16], Block& best) {
  Block two[16], four[16];
  for (int k = 0; k < 16; ++k) {
    for (int i = 0; i < kBlock; ++i) two[k][i] = lesser(circle[k][i], circle[(k + 1) & 15][i]);
  }
  for (int k = 0; k < 16; ++k) {
    for (int i = 0; i < kBlock; ++i) four[k][i] = lesser(two[k][i], two[(k + 2) & 15][i]);
  }
  for (int k = 0; k < 16; ++k) {
    for (int i = 0; i < kBlock; ++i) {
      const std::uint8_t eight = lesser(four[k][i], four[(k + 4) & 15][i]);
      best[i] = greater(best[i], lesser(eight, circle[(k + 8) & 15][i]));
    }
  }
}

void corner_scores(const std::uint8_t* row, std::ptrdiff_t stride, int width, std::uint8_t* scores) {
  constexpr int kAcross[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kDown[16] = {3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};
  for (int from = 0; from < width; from += kBlock) {
    alignas(32) Block brighter[16], darker[16], best = {};
    const std::uint8_t* const centre = row + from;
    for (int k = 0; k < 16; ++k) {
      const std::uint8_t* const p = centre + kDown[k] * stride + kAcross[k];
      for (int i = 0; i < kBlock; ++i) {
        const std::uint8_t larger = greater(p[i], centre[i]);
        brighter[k][i] = static_cast<std::uint8_t>(larger - centre[i]);
        darker[k][i] = static_cast<std::uint8_t>(larger - p[i]);
      }
    }
    add_arcs(brighter, best);
    add_arcs(darker, best);
    for (int i = 0; i < kBlock; ++i) scores[from + i] = static_cast<std::uint8_t>(greater(best[i], 1) - 1);
  }
}

}  // namespace
}  // namespace ear::EAR_VARIANT
// NOLINTEND(modernize-avoid-c-arrays,misc-definitions-in-headers)
