// The kernels themselves, without a name for the processor: each kernels_*.cpp says EAR_VARIANT and includes this.
// Nothing here may instantiate or inline what other files share, or the linker could take an AVX2 version of it: hence
// plain arrays, and definitions that no other file includes.
#pragma once

#include "frontend/eight.h"
#include "frontend/image_kernels.h"
#include "frontend/sixteen.h"

// NOLINTBEGIN(modernize-avoid-c-arrays,misc-definitions-in-headers): see above
namespace ear::EAR_VARIANT {
namespace {

constexpr int kGroups = kPatchSize / 8;  // of eight columns
constexpr int kSize = kPatchSize;
constexpr int kSkip = kSize / 4;  // rows above and below that compare() leaves out

// Coordinates are in fixed point: with 16 bits behind the point those of a row's first pixel, with 11 the sixteen of a
// row, from the upper left one of the pixels that are fetched for them.
constexpr int kFixedBits = 16;
constexpr int kFixedOne = 1 << kFixedBits;
constexpr int kNearBits = 11;
constexpr int kNearOne = 1 << kNearBits;
constexpr int kLessBits = kFixedBits - kNearBits;

// Between pixels, values have six bits behind the point; with four they go into sums of products, which 32 bits hold.
// interpolate() and less() round down, by 2.5 of the smaller units in the mean.
constexpr int kBetweenBits = 6;
constexpr float kRounding = 2.5F;

// Added to coordinates before they are cut off, so that those in the border are positive and round down as well.
constexpr int kOffset = 64;

inline int to_fixed(float value) { return static_cast<int>(value * static_cast<float>(kFixedOne)); }
inline Ints to_fixed(const Floats& values) { return to_ints(values * static_cast<float>(kFixedOne)); }
inline std::uint8_t lesser(std::uint8_t a, std::uint8_t b) { return b < a ? b : a; }
inline std::uint8_t greater(std::uint8_t a, std::uint8_t b) { return b > a ? b : a; }
inline int smaller(int a, int b) { return b < a ? b : a; }
inline std::int16_t word(int number) { return static_cast<std::int16_t>(number); }

// Pixels to the left and right above of sixteen places and below, and what of the way from the first to the second the
// places are: 1 is 32768.
struct Corners {
  Words left, right, left_below, right_below;
};

// Of pixels, with kBetweenBits.
inline Words between(const Words& left, const Words& right, const Words& across) {
  return (left << kBetweenBits) + multiply_high((right - left) << (kBetweenBits + 1), across);
}

inline Words interpolate(const Corners& corners, const Words& across, const Words& down) {
  const Words above = between(corners.left, corners.right, across);
  const Words below = between(corners.left_below, corners.right_below, across);
  return above + multiply_high((below - above) << 1, down);
}

#if EAR_HAS_PICK

// Pixels that are within 15 columns and two rows from those at `p`, one for either half; three rows where it is steep.
inline Corners fetch_near(const std::uint8_t* const (&p)[2], std::ptrdiff_t stride, const Words& x, const Words& y,
                          bool steep) {
  const Words left = (x >> kNearBits) | word(0x8000 - 0x10000);
  const Words right = left + word(1);
  const Words lower = (y << (15 - kNearBits)) >> 15;  // where the first row is above
  const Words first = bytes_at(p[0], p[1]);
  const Words second = bytes_at(p[0] + stride, p[1] + stride);
  const Words third = bytes_at(p[0] + 2 * stride, p[1] + 2 * stride);
  const Words left_second = pick(second, left);
  const Words right_second = pick(second, right);
  const Words left_third = pick(third, left);
  const Words right_third = pick(third, right);
  Corners corners{choose(pick(first, left), left_second, lower), choose(pick(first, right), right_second, lower),
                  choose(left_second, left_third, lower), choose(right_second, right_third, lower)};
  if (steep) {
    const Words fourth = bytes_at(p[0] + 3 * stride, p[1] + 3 * stride);
    const Words lowest = (y << (14 - kNearBits)) >> 15;  // where two rows are above
    corners = {choose(corners.left, left_third, lowest), choose(corners.right, right_third, lowest),
               choose(corners.left_below, pick(fourth, left), lowest),
               choose(corners.right_below, pick(fourth, right), lowest)};
  }
  return corners;
}

#else

// Of one half.
struct HalfCorners {
  Eight16 left, right, left_below, right_below;
};

inline HalfCorners fetch_each(const std::uint8_t* p, std::ptrdiff_t stride, const Eight16& x, const Eight16& y) {
  HalfCorners corners;
  for (int i = 0; i < 8; ++i) {
    const std::uint8_t* const q = p + (y[i] >> kNearBits) * stride + (x[i] >> kNearBits);
    corners.left[i] = q[0];
    corners.right[i] = q[1];
    corners.left_below[i] = q[stride];
    corners.right_below[i] = q[stride + 1];
  }
  return corners;
}

// Without picking: columns follow each other by one, with at most one gap or one twice, unless the warp stretches much;
// rows are mostly the same two for all eight.
inline HalfCorners fetch_near(const std::uint8_t* p, std::ptrdiff_t stride, const Eight16& x, const Eight16& y) {
  const Eight16 left = (x >> kNearBits) - Eight16{0, 1, 2, 3, 4, 5, 6, 7};
  const int shift = smaller(left[0], left[7]);
  const Eight16 further = left - word(shift);  // all 0 or 1
  const int above = smaller(y[0], y[7]) >> kNearBits;
  const Eight16 down = (y >> kNearBits) - word(above);  // likewise, unless it is steep
  if (any((further | down) & word(~1))) return fetch_each(p, stride, x, y);
  const bool gap = any(further);
  const Eight16 which = word(0) - further;
  struct Row {
    Eight16 left, right;
  };
  const auto fetch = [&](int row) -> Row {
    const std::uint8_t* const q = p + (above + row) * stride + shift;
    const Eight16 first = words_of(q);
    const Eight16 second = words_of(q + 1);
    if (!gap) return {first, second};
    return {choose(first, second, which), choose(second, words_of(q + 2), which)};
  };
  const Row first = fetch(0);
  const Row second = fetch(1);
  if (!any(down)) return {first.left, first.right, second.left, second.right};
  const Row third = fetch(2);
  const Eight16 lower = word(0) - down;
  return {choose(first.left, second.left, lower), choose(first.right, second.right, lower),
          choose(second.left, third.left, lower), choose(second.right, third.right, lower)};
}

inline Corners fetch_near(const std::uint8_t* const (&p)[2], std::ptrdiff_t stride, const Words& x, const Words& y,
                          bool /*steep*/) {
  const HalfCorners low = fetch_near(p[0], stride, x.low, y.low);
  const HalfCorners high = fetch_near(p[1], stride, x.high, y.high);
  return {{low.left, high.left},
          {low.right, high.right},
          {low.left_below, high.left_below},
          {low.right_below, high.right_below}};
}

#endif

inline Floats count_up() {
  alignas(32) constexpr float kFirst[8] = {0.0F, 1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 7.0F};
  return load<Floats>(kFirst);
}

// Offsets from the patch's centre of eight pixels in a row.
inline Floats offsets(int group) { return count_up() + (static_cast<float>(8 * group) - kPatchHalf); }

inline float offset(int row) { return static_cast<float>(row) - kPatchHalf; }

inline float size(float value) { return value < 0.0F ? -value : value; }

// Pixels of a level under a warp, row by row of the patch.
class Walk {
 public:
  // Of rows from `first`: eight, or sixteen. With o = (column - half, y): A o (1 - perspective . o), in powers of the
  // column.
  Walk(const GreyLevel& level, const PatchPlace& place, int first, int rows)
      : stride_(level.stride), origin_(level.origin - kOffset * (level.stride + 1)) {
    const float lx = place.perspective[0];
    const float ly = place.perspective[1];
    float steps[2], changes[2];
    for (std::size_t k = 0; k < 2; ++k) {  // x, y
      const float ax = place.column_x[k];
      const float ay = place.column_y[k];
      const float bend = -lx * ax;
      const float twist = -(ly * ax + lx * ay);  // change of the step from row to row
      const float step = ax + kPatchHalf * lx * ax + kPatchHalf * lx * ax;
      bend_[k] = to_fixed(bend);
      for (int from = 0; from < rows; from += 8) {
        const Floats y = count_up() + offset(first + from);
        const Floats scale = all(1.0F + kPatchHalf * lx) - y * ly;
        const Floats begin = (y * ay - kPatchHalf * ax) * scale + (place.centre[k] + static_cast<float>(kOffset));
        store(begin_[k] + from, to_fixed(begin));
        store(step_[k] + from, to_fixed(y * twist + step));
      }
      steps[k] = step + offset(first) * twist;
      changes[k] = static_cast<float>(kSize) * (2.0F * size(bend) + size(twist));  // of the step, at most
    }
    // Eight pixels lie near each other unless the warp turns or stretches a lot. The highest is the first or the last
    // of them, or above these by no more than the row bends, and than rounding.
    const float margin = 13.0F * size(lx * place.column_x[1]) + 0.01F;
    const float rise = 7.0F * (size(steps[1]) + changes[1]) + margin;
    near_ = steps[0] - changes[0] > 0.0F && 7.0F * (steps[0] + changes[0]) < 14.0F && rise < 1.99F;
    steep_ = rise > 0.99F;
    if (near_) prepare(rows, to_fixed(margin));
  }

  // Row by row from the first: brightness with kBetweenBits behind the point.
  [[nodiscard]] Words take(int row) const { return near_ ? take_near(row) : take_each(row); }

 private:
  // For either half of a row: the pixels that are fetched, and where between them the first of the eight lies.
  void prepare(int rows, int margin) {
    constexpr int kHalf = 1 << (kLessBits - 1);
    alignas(32) constexpr int kSquares[kSize] = {0, 1,  4,  9,  16, 25,  36,  49,    // of the column in its half, and
                                                 0, 17, 36, 57, 80, 105, 132, 161};  // what eight more columns add
    for (std::size_t k = 0; k < 2; ++k) {
      const int bend = bend_[k];
      bent_[k] = narrow((load<Ints>(kSquares) * bend) >> kLessBits, (load<Ints>(kSquares + 8) * bend) >> kLessBits);
      last_bent_[k][0] = (kSquares[7] * bend) >> kLessBits;
      last_bent_[k][1] = (kSquares[15] * bend) >> kLessBits;
    }
    const auto stride = static_cast<int>(stride_);
    for (int from = 0; from < rows; from += 8) {
      for (std::size_t k = 0; k < 2; ++k) {
        const Ints near_step = (load<Ints>(step_[k] + from) + kHalf) >> kLessBits;
        store(near_step_[k] + from, near_step);
      }
      const Ints last = load<Ints>(near_step_[1] + from) * 7;
      for (std::size_t half = 0; half < 2; ++half) {
        Ints x = load<Ints>(begin_[0] + from);
        Ints y = load<Ints>(begin_[1] + from);
        if (half == 1) {
          x += load<Ints>(step_[0] + from) * 8 + 64 * bend_[0];
          y += load<Ints>(step_[1] + from) * 8 + 64 * bend_[1];
        }
        const Ints rise = last + last_bent_[1][half];
        const Ints highest = y - margin + ((rise & (rise >> 31)) << kLessBits);
        const Ints row = highest >> kFixedBits;
        store(offset_[half] + from, row * stride + (x >> kFixedBits));
        store(near_begin_[0][half] + from, ((x & (kFixedOne - 1)) + kHalf) >> kLessBits);
        store(near_begin_[1][half] + from, (y - (row << kFixedBits) + kHalf) >> kLessBits);
      }
    }
  }

  [[nodiscard]] Words take_near(int row) const {
    alignas(32) constexpr std::int16_t kColumns[kSize] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
    const auto columns = load<Words>(kColumns);
    const auto along = [&](std::size_t k) {
      return columns * spread(word(near_step_[k][row])) + bent_[k] +
             spread(word(near_begin_[k][0][row]), word(near_begin_[k][1][row]));
    };
    const Words x = along(0);
    const Words y = along(1);
    const std::uint8_t* const p[2] = {origin_ + offset_[0][row], origin_ + offset_[1][row]};
    const auto weight = [](const Words& at) { return (at & word(kNearOne - 1)) << (15 - kNearBits); };
    return interpolate(fetch_near(p, stride_, x, y, steep_), weight(x), weight(y));
  }

  [[nodiscard]] Words take_each(int row) const {
    alignas(32) std::int16_t left[kSize], right[kSize], left_below[kSize], right_below[kSize];
    alignas(32) std::int16_t across[kSize], down[kSize];
    for (int i = 0; i < kSize; ++i) {
      const int x = begin_[0][row] + i * step_[0][row] + i * i * bend_[0];
      const int y = begin_[1][row] + i * step_[1][row] + i * i * bend_[1];
      const std::uint8_t* const p = origin_ + (y >> kFixedBits) * stride_ + (x >> kFixedBits);
      left[i] = p[0];
      right[i] = p[1];
      left_below[i] = p[stride_];
      right_below[i] = p[stride_ + 1];
      across[i] = word((x & (kFixedOne - 1)) >> 1);
      down[i] = word((y & (kFixedOne - 1)) >> 1);
    }
    return interpolate({load<Words>(left), load<Words>(right), load<Words>(left_below), load<Words>(right_below)},
                       load<Words>(across), load<Words>(down));
  }

  std::ptrdiff_t stride_;
  const std::uint8_t* origin_;
  bool near_;
  bool steep_;
  int bend_[2];                              // half the change of the step from column to column
  alignas(32) int begin_[2][kSize];          // by x and y, for each row: its first pixel,
  alignas(32) int step_[2][kSize];           // and the way to the next
  alignas(32) int near_step_[2][kSize];      // the same in kNearBits
  alignas(32) int near_begin_[2][2][kSize];  // for either half, from the pixels that are fetched
  alignas(32) int offset_[2][kSize];         // of these from the origin
  Words bent_[2];
  int last_bent_[2][2];
};

inline float grey(const Ints& sums, float unit) { return sum(to_floats(sums)) * unit; }

// Of the image under a patch, less the patch's mean; products with the patch and with itself.
struct Photometry {
  Ints image{}, image2{}, product{};

  void add(const Words& pixels, const Words& value) {
    image += dot(pixels, spread(1));
    image2 += dot(pixels, pixels);
    product += dot(pixels, value);
  }
  void put(AlignmentSums& sums) const {
    sums.image = grey(image, kPatchUnit);
    sums.image2 = grey(image2, kPatchUnit * kPatchUnit);
    sums.product = grey(product, kPatchUnit * kPatchUnit);
  }
};

constexpr float kGradientProduct = kPatchUnit * kGradientUnit;

// What is taken off pixels with kBetweenBits, before they become those of Photometry.
inline Words level_of(const PatchPixels& patch) {
  return spread(word(static_cast<int>(patch.mean * static_cast<float>(1 << kBetweenBits) + (0.5F - kRounding))));
}
inline Words less(const Words& pixels, const Words& level) { return (pixels - level) >> 2; }

void align_position(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums) {
  const Walk walk(level, place, 0, kSize);
  const Words mean = level_of(patch);
  Photometry photometry;
  Ints x{}, y{};
  for (int row = 0; row < kSize; ++row) {
    const Words pixels = less(walk.take(row), mean);
    photometry.add(pixels, load<Words>(patch.value.data() + row * kSize));
    x += dot(pixels, load<Words>(patch.gradient_x.data() + row * kSize));
    y += dot(pixels, load<Words>(patch.gradient_y.data() + row * kSize));
  }
  photometry.put(sums);
  sums.x = grey(x, kGradientProduct);
  sums.y = grey(y, kGradientProduct);
}

void align_affine(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums) {
  alignas(32) constexpr std::int16_t kFromMiddle[kSize] = {-7, -6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6, 7, 8};
  const Walk walk(level, place, 0, kSize);
  const Words mean = level_of(patch);
  const auto from_middle = load<Words>(kFromMiddle);
  Photometry photometry;
  Ints x{}, y{}, x_x{}, y_x{};
  Ints x_above{}, y_above{};  // sums of x and y as they are after each row: rows count 16, 15, ... 1 times
  for (int row = 0; row < kSize; ++row) {
    const Words pixels = less(walk.take(row), mean);
    const auto gradient_x = load<Words>(patch.gradient_x.data() + row * kSize);
    const auto gradient_y = load<Words>(patch.gradient_y.data() + row * kSize);
    photometry.add(pixels, load<Words>(patch.value.data() + row * kSize));
    x += dot(pixels, gradient_x);
    y += dot(pixels, gradient_y);
    x_above += x;
    y_above += y;
    const Words weighted = pixels * from_middle;
    x_x += dot(weighted, gradient_x);
    y_x += dot(weighted, gradient_y);
  }
  photometry.put(sums);
  sums.x = grey(x, kGradientProduct);
  sums.y = grey(y, kGradientProduct);
  sums.x_x = grey(x_x, kGradientProduct) - 0.5F * sums.x;
  sums.y_x = grey(y_x, kGradientProduct) - 0.5F * sums.y;
  constexpr float kRows = static_cast<float>(kSize) - kPatchHalf;
  sums.x_y = kRows * sums.x - grey(x_above, kGradientProduct);
  sums.y_y = kRows * sums.y - grey(y_above, kGradientProduct);
}

void compare(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums) {
  const Walk walk(level, place, kSkip, kSize - 2 * kSkip);
  const Words mean = level_of(patch);
  Photometry photometry;
  for (int row = 0; row < kSize - 2 * kSkip; ++row) {
    photometry.add(less(walk.take(row), mean), load<Words>(patch.value.data() + (kSkip + row) * kSize));
  }
  photometry.put(sums);
}

// What compare() gives at places one column of the patch apart, from pixels that are taken once.
void compare_along(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch,
                   std::array<AlignmentSums, kPatchSize>& sums) {
  constexpr int kRows = kSize - 2 * kSkip;
  constexpr float kColumns = static_cast<float>(kSize);
  const PatchPlace further{
      {place.centre[0] + kColumns * place.column_x[0], place.centre[1] + kColumns * place.column_x[1]},
      place.column_x,
      place.column_y,
      place.perspective};
  const Walk first(level, place, kSkip, kRows);
  const Walk second(level, further, kSkip, kRows);
  const Words mean = level_of(patch);
  alignas(32) std::int16_t strip[kRows][2 * kSize];
  alignas(32) std::int16_t total[2 * kSize];  // of the columns, 32640 at most
  Words total_first = spread(0), total_second = spread(0);
  for (int row = 0; row < kRows; ++row) {
    const Words pixels = less(first.take(row), mean);
    const Words next = less(second.take(row), mean);
    store(strip[row], pixels);
    store(strip[row] + kSize, next);
    total_first = total_first + pixels;
    total_second = total_second + next;
  }
  store(total, total_first);
  store(total + kSize, total_second);
  for (int at = 0; at < kSize; ++at) {
    Photometry photometry;
    photometry.image = dot(load<Words>(total + at), spread(1));
    for (int row = 0; row < kRows; ++row) {
      const auto pixels = load<Words>(strip[row] + at);
      photometry.image2 += dot(pixels, pixels);
      photometry.product += dot(pixels, load<Words>(patch.value.data() + (kSkip + row) * kSize));
    }
    photometry.put(sums[static_cast<std::size_t>(at)]);
  }
}

// First derivative of what has kBetweenBits, in kGradientUnit. Five taps: with three, fine texture looks flatter than
// it is, and every step overshoots.
inline Words derivative(const Words& before2, const Words& before, const Words& after, const Words& after2) {
  static_assert(kBetweenBits == 6 && 8.0F * kGradientUnit == 1.0F, "(8 (after - before) - (after2 - before2)) / 96");
  return multiply_high((after - before) - ((after2 - before2) >> 3) + word(6), spread(word((1 << 16) / 12)));
}

void capture(const GreyLevel& level, const std::array<float, 2>& centre, PatchPixels& patch) {
  constexpr int kReach = 2;  // of the derivative
  constexpr int kWide = kSize + 2 * kReach;
  constexpr int kRow = 2 * kSize;  // kWide, in sixteens
  alignas(32) std::int16_t wide[kWide][kRow];
  const int x = to_fixed(centre[0] - kPatchHalf - static_cast<float>(kReach) + static_cast<float>(kOffset));
  const int y = to_fixed(centre[1] - kPatchHalf - static_cast<float>(kReach) + static_cast<float>(kOffset));
  const std::uint8_t* corner =
      level.origin + ((y >> kFixedBits) - kOffset) * level.stride + ((x >> kFixedBits) - kOffset);
  const Words across = spread(word((x & (kFixedOne - 1)) >> 1));
  const Words down = spread(word((y & (kFixedOne - 1)) >> 1));
  for (int from = 0; from < kRow; from += kSize) {
    Words above = between(words_at(corner + from), words_at(corner + from + 1), across);
    for (int row = 0; row < kWide; ++row) {
      const std::uint8_t* const next = corner + (row + 1) * level.stride + from;
      const Words below = between(words_at(next), words_at(next + 1), across);
      store(wide[row] + from, above + multiply_high((below - above) << 1, down));
      above = below;
    }
  }
  Ints total{};
  for (int row = 0; row < kSize; ++row) {
    total += dot(load<Words>(wide[row + kReach] + kReach), spread(1));
  }
  constexpr float kOne = static_cast<float>(1 << kBetweenBits);
  const float mean = sum(to_floats(total)) * (1.0F / static_cast<float>(kPatchPixels));
  patch.mean = mean * (1.0F / kOne);
  const int nearest = static_cast<int>(mean + 0.5F);  // NOLINT(bugprone-incorrect-roundings): mean is not negative
  const Words less_mean = spread(word(nearest - 2));  // to the next, when two bits are cut off
  for (int row = 0; row < kSize; ++row) {
    const std::int16_t* const in = wide[row + kReach] + kReach;
    const auto at = [&](int further) { return load<Words>(in + further); };
    store(patch.value.data() + row * kSize, less(at(0), less_mean));
    store(patch.gradient_x.data() + row * kSize, derivative(at(-2), at(-1), at(1), at(2)));
    store(patch.gradient_y.data() + row * kSize, derivative(at(-2 * kRow), at(-kRow), at(kRow), at(2 * kRow)));
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

inline void put(const ColumnMoments (&columns)[kGroups], float unit, Moments& out) {
  const Floats x0 = columns[0].one * offsets(0);
  const Floats x1 = columns[1].one * offsets(1);
  out.one = sum(columns[0].one + columns[1].one) * unit;
  out.x = sum(x0 + x1) * unit;
  out.y = sum(columns[0].y + columns[1].y) * unit;
  out.xx = sum(x0 * offsets(0) + x1 * offsets(1)) * unit;
  out.xy = sum(columns[0].y * offsets(0) + columns[1].y * offsets(1)) * unit;
  out.yy = sum(columns[0].yy + columns[1].yy) * unit;
}

inline void put(const ColumnSums (&columns)[kGroups], float unit, Moments& out) {
  out.one = sum(columns[0].one + columns[1].one) * unit;
  out.x = sum(columns[0].one * offsets(0) + columns[1].one * offsets(1)) * unit;
  out.y = sum(columns[0].y + columns[1].y) * unit;
}

void moments(const PatchPixels& patch, PatchMoments& out) {
  Floats energy{}, middle{}, middle2{};
  ColumnMoments gx_gx[kGroups], gx_gy[kGroups], gy_gy[kGroups];
  ColumnSums gx[kGroups], gy[kGroups], gx_value[kGroups], gy_value[kGroups];
  for (int group = 0; group < kGroups; ++group) {
    for (int row = 0; row < kSize; ++row) {
      const int at = row * kSize + 8 * group;
      const Floats x = floats_at(patch.gradient_x.data() + at);
      const Floats y = floats_at(patch.gradient_y.data() + at);
      const Floats value = floats_at(patch.value.data() + at);
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
  put(gx_gx, kGradientUnit * kGradientUnit, out.gx_gx);
  put(gx_gy, kGradientUnit * kGradientUnit, out.gx_gy);
  put(gy_gy, kGradientUnit * kGradientUnit, out.gy_gy);
  put(gx, kGradientUnit, out.gx);
  put(gy, kGradientUnit, out.gy);
  put(gx_value, kGradientProduct, out.gx_value);
  put(gy_value, kGradientProduct, out.gy_value);
  out.energy = sum(energy) * (kPatchUnit * kPatchUnit);
  out.middle = sum(middle) * kPatchUnit;
  out.middle2 = sum(middle2) * (kPatchUnit * kPatchUnit);
}

void position_moments(const PatchPixels& patch, PatchMoments& out) {
  Ints gx_gx{}, gx_gy{}, gy_gy{}, gx{}, gy{}, gx_value{}, gy_value{}, energy{}, middle{}, middle2{};
  for (int row = 0; row < kSize; ++row) {
    const auto x = load<Words>(patch.gradient_x.data() + row * kSize);
    const auto y = load<Words>(patch.gradient_y.data() + row * kSize);
    const auto value = load<Words>(patch.value.data() + row * kSize);
    const Ints value2 = dot(value, value);
    gx_gx += dot(x, x);
    gx_gy += dot(x, y);
    gy_gy += dot(y, y);
    gx += dot(x, spread(1));
    gy += dot(y, spread(1));
    gx_value += dot(x, value);
    gy_value += dot(y, value);
    energy += value2;
    if (row < kSkip || row >= kSize - kSkip) continue;
    middle += dot(value, spread(1));
    middle2 += value2;
  }
  out.gx_gx.one = grey(gx_gx, kGradientUnit * kGradientUnit);
  out.gx_gy.one = grey(gx_gy, kGradientUnit * kGradientUnit);
  out.gy_gy.one = grey(gy_gy, kGradientUnit * kGradientUnit);
  out.gx.one = grey(gx, kGradientUnit);
  out.gy.one = grey(gy, kGradientUnit);
  out.gx_value.one = grey(gx_value, kGradientProduct);
  out.gy_value.one = grey(gy_value, kGradientProduct);
  out.energy = grey(energy, kPatchUnit * kPatchUnit);
  out.middle = grey(middle, kPatchUnit);
  out.middle2 = grey(middle2, kPatchUnit * kPatchUnit);
}

// Sixteen pixels of all rows at a time, so that each row is summed across only once.
void halve(const std::uint8_t* middle, std::ptrdiff_t stride, int width, int rows, std::uint8_t* out,
           std::ptrdiff_t out_stride) {
  constexpr int kReach = 2;
  const auto across = [](const std::uint8_t* p) { return pairs(p, 1, 4) + pairs(p + 2, 6, 4) + evens(p + 4); };
  for (int from = 0; from < width; from += kSize) {
    const std::uint8_t* p = middle - kReach * stride + (2 * from - kReach);
    std::uint8_t* to = out + from;
    Words first = across(p);
    Words second = across(p + stride);
    Words third = across(p + 2 * stride);
    for (int row = 0; row < rows; ++row, to += out_stride) {
      const Words fourth = across(p + 3 * stride);
      const Words fifth = across(p + 4 * stride);
      // With its rounding the sum is up to 65408. 32768 less the rounding, four times 8160, is taken off.
      const Words inner = (second + third + fourth + word(-8160)) << 2;
      const Words sum = inner + (first + fifth + (third << 1));
      store_bytes(to, (sum >> 8) + word(128));
      first = third;
      second = fourth;
      third = fifth;
      p += 2 * stride;
    }
  }
}

alignas(32) constexpr std::int16_t kAllButLast[16] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, 0};

void texture(const std::uint8_t* middle, std::ptrdiff_t stride, TextureSums& out) {
  constexpr int kReach = 7;
  const Words counts = load<Words>(kAllButLast);
  Ints across2{}, down2{}, across_down{}, right2{}, below2{};
  for (int row = -kReach; row <= kReach; ++row) {
    const std::uint8_t* const p = middle + row * stride - kReach;
    const Words here = words_at(p);
    const Words next = words_at(p + 1);
    const Words under = words_at(p + stride);
    const Words across = (next - words_at(p - 1)) & counts;
    const Words down = (under - words_at(p - stride)) & counts;
    const Words right = (next - here) & counts;
    const Words below = (under - here) & counts;
    across2 += dot(across, across);
    down2 += dot(down, down);
    across_down += dot(across, down);
    right2 += dot(right, right);
    below2 += dot(below, below);
  }
  const auto whole = [](const Ints& sums) { return static_cast<int>(sum(to_floats(sums))); };  // below 2^24: exact
  out = {whole(across2), whole(down2), whole(across_down), whole(right2), whole(below2)};
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

// What no score of these pixels exceeds: an arc of nine holds two neighbours of the four pixels straight above, below,
// left and right.
inline std::uint8_t most_of(const std::uint8_t* centre, std::ptrdiff_t stride) {
  Block most;
  for (int i = 0; i < kBlock; ++i) {
    const std::uint8_t* const p = centre + i;
    const std::uint8_t upright_high = greater(p[-3 * stride], p[3 * stride]);
    const std::uint8_t upright_low = lesser(p[-3 * stride], p[3 * stride]);
    const std::uint8_t level_high = greater(p[-3], p[3]);
    const std::uint8_t level_low = lesser(p[-3], p[3]);
    const std::uint8_t high = greater(lesser(upright_high, level_high), p[0]);
    const std::uint8_t low = lesser(greater(upright_low, level_low), p[0]);
    most[i] = greater(static_cast<std::uint8_t>(high - p[0]), static_cast<std::uint8_t>(p[0] - low));
  }
  std::uint8_t largest = 0;
  for (const std::uint8_t one : most) largest = greater(largest, one);
  return largest;
}

void corner_scores(const std::uint8_t* row, std::ptrdiff_t stride, int width, int threshold, std::uint8_t* scores) {
  constexpr int kAcross[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kDown[16] = {3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};
  for (int from = 0; from < width; from += kBlock) {
    alignas(32) Block brighter[16], darker[16], best = {};
    const std::uint8_t* const centre = row + from;
    if (most_of(centre, stride) <= threshold) {
      std::memset(scores + from, 0, kBlock);
      continue;
    }
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
