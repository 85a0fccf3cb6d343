// The kernels themselves, without a name for the processor: each kernels_*.cpp says EAR_VARIANT and includes this.
// Nothing here may instantiate or inline what other files share, or the linker could take an AVX2 version of it: hence
// plain arrays, and definitions that no other file includes.
#pragma once

#include "filter/kernels/filter_kernels.h"
#include "filter/kernels/four.h"

// NOLINTBEGIN(modernize-avoid-c-arrays,misc-definitions-in-headers): see above
namespace ear::EAR_VARIANT {
namespace {

// Sums of products for a block of rows (eight with AVX2, else four: there are sixteen registers) and of columns.
#if defined(__AVX2__)
constexpr int kFours = 2;
#else
constexpr int kFours = 1;
#endif
constexpr int kBlockRows = 4 * kFours;

constexpr int whole(int rows) { return (rows + 7) / 8 * 8; }

template <int i>
struct Index {
  static constexpr int value = i;
  constexpr operator int() const { return i; }  // NOLINT(google-explicit-constructor): it stands for its number
};

// f(0), f(1), ... f(n - 1), written out: sums then stay in registers.
template <int n, int i = 0, class Function>
[[gnu::always_inline]] inline void each(const Function& f) {
  if constexpr (i < n) {
    f(Index<i>{});
    each<n, i + 1>(f);
  }
}

template <int columns, int fours = kFours>
struct Block {
  Four sums[fours][columns];

  [[gnu::always_inline]] Block() {
    each<fours>([&](int f) { each<columns>([&](int c) { sums[f][c] = all(0.0); }); });
  }

  // `values`: of each column.
  [[gnu::always_inline]] void add(const double* rows, const double* values, std::ptrdiff_t stride) {
    Four row[fours];
    each<fours>([&](int f) { row[f] = load(rows + 4 * f); });
    each<columns>([&](int c) {
      const Four value = all(values[c * stride]);
      each<fours>([&](int f) { sums[f][c] += row[f] * value; });
    });
  }
};

template <int columns>
void multiply_block(ConstMatrix A, ConstMatrix B, const int* used, int count, double* C, std::ptrdiff_t stride) {
  Block<columns> block;
  for (int u = 0; u < count; ++u) block.add(A.at + used[u] * A.stride, B.at + used[u], B.stride);
  each<columns>([&](int c) { each<kFours>([&](int f) { store(C + c * stride + 4 * f, block.sums[f][c]); }); });
}

void multiply(ConstMatrix A, ConstMatrix B, const int* used, int count, int rows, int columns, MutableMatrix C) {
  for (int i = 0; i < whole(rows); i += kBlockRows) {
    const ConstMatrix panel{A.at + i, A.stride};
    int j = 0;
    const auto next = [&](auto block, int width) {
      block(panel, ConstMatrix{B.at + j * B.stride, B.stride}, used, count, C.at + i + j * C.stride, C.stride);
      j += width;
    };
    while (j + 4 <= columns) next(multiply_block<4>, 4);
    if (j + 3 == columns) next(multiply_block<3>, 3);
    if (j + 2 == columns) next(multiply_block<2>, 2);
    if (j + 1 == columns) next(multiply_block<1>, 1);
  }
}

template <int height, int width>
void multiply_transposed_block(ConstMatrix A, ConstMatrix B, int rows, double* C, std::ptrdiff_t stride) {
  Four sums[height][width];
  each<height>([&](int i) { each<width>([&](int j) { sums[i][j] = all(0.0); }); });
  for (int k = 0; k < rows; k += 4) {
    Four a[height];
    each<height>([&](int i) { a[i] = load(A.at + i * A.stride + k); });
    each<width>([&](int j) {
      const Four b = load(B.at + j * B.stride + k);
      each<height>([&](int i) { sums[i][j] += a[i] * b; });
    });
  }
  each<height>([&](int i) { each<width>([&](int j) { C[i + j * stride] = sum(sums[i][j]); }); });
}

void multiply_transposed(ConstMatrix A, ConstMatrix B, int rows, int size, MutableMatrix C) {
  constexpr int kSide = kFours + 1;  // 3 x 3 sums with AVX2, else 2 x 2
  for (int j = 0; j < size; j += kSide) {
    const bool wide = j + kSide <= size;
    for (int i = j; i < size; i += kSide) {
      const ConstMatrix a{A.at + i * A.stride, A.stride};
      const ConstMatrix b{B.at + j * B.stride, B.stride};
      double* const c = C.at + i + j * C.stride;
      if (wide && i + kSide <= size) {
        multiply_transposed_block<kSide, kSide>(a, b, rows, c, C.stride);
        continue;
      }
      const int width = size - j < kSide ? size - j : kSide;
      const int height = size - i < kSide ? size - i : kSide;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          multiply_transposed_block<1, 1>({a.at + y * a.stride, a.stride}, {b.at + x * b.stride, b.stride}, rows,
                                          c + y + x * C.stride, C.stride);
        }
      }
    }
  }
}

bool factorize(MutableMatrix S, int size, double* z) {
  for (int k = 0; k < size; ++k) {
    double* const column = S.at + k * S.stride;
    for (int i = k - k % 4; i < size; i += 4) {
      Block<1, 1> before;
      for (int l = 0; l < k; ++l) before.add(S.at + i + l * S.stride, S.at + k + l * S.stride, 1);
      store(column + i, load(column + i) - before.sums[0][0]);
    }
    const double pivot = column[k];
    if (!(pivot > 0.0)) return false;
    double roots[4];
    store(roots, root(all(pivot)));
    for (int i = k - k % 4; i < size; i += 4) store(column + i, load(column + i) / all(roots[0]));
    column[k] = roots[0];
    double sum_before = 0.0;
    for (int l = 0; l < k; ++l) sum_before += S.at[k + l * S.stride] * z[l];
    z[k] = (z[k] - sum_before) / roots[0];
  }
  return true;
}

template <int columns>
void solve_block(ConstMatrix L, int k, double* Y, std::ptrdiff_t stride) {
  Block<columns> before;
  for (int l = 0; l < k; ++l) before.add(Y + l * stride, L.at + k + l * L.stride, 1);
  Four y[kFours][columns];
  each<columns>([&](auto c) {
    const double* const row = L.at + k + c + k * L.stride;
    const Four pivot = all(row[c * L.stride]);
    each<kFours>([&](int f) {
      y[f][c] = load(Y + (k + c) * stride + 4 * f) - before.sums[f][c];
      each<decltype(c)::value>([&](int l) { y[f][c] -= all(row[l * L.stride]) * y[f][l]; });
      y[f][c] = y[f][c] / pivot;
      store(Y + (k + c) * stride + 4 * f, y[f][c]);
    });
  });
}

void solve(ConstMatrix L, int rows, int columns, MutableMatrix Y) {
  for (int i = 0; i < whole(rows); i += kBlockRows) {
    int k = 0;
    for (; k + 4 <= columns; k += 4) solve_block<4>(L, k, Y.at + i, Y.stride);
    if (k + 3 == columns) solve_block<3>(L, k, Y.at + i, Y.stride);
    if (k + 2 == columns) solve_block<2>(L, k, Y.at + i, Y.stride);
    if (k + 1 == columns) solve_block<1>(L, k, Y.at + i, Y.stride);
  }
}

// Rows from i on, of columns j to j + 3; what is below the diagonal goes above it as well.
template <int fours>
void subtract_block(ConstMatrix Y, int columns, int i, int j, MutableMatrix P) {
  Block<4, fours> square;
  for (int k = 0; k < columns; ++k) square.add(Y.at + i + k * Y.stride, Y.at + j + k * Y.stride, 1);
  each<fours>([&](int f) {
    const int row = i + 4 * f;
    Four tile[4];
    each<4>([&](int c) {
      double* const p = P.at + row + (j + c) * P.stride;
      tile[c] = load(p) - square.sums[f][c];
      store(p, tile[c]);
    });
    if (row < j + 4) return;
    transpose(tile);
    each<4>([&](int c) { store(P.at + j + (row + c) * P.stride, tile[c]); });
  });
}

void subtract_square(ConstMatrix Y, int columns, int size, MutableMatrix P) {
  const int rows = (size + 3) / 4 * 4;
  for (int j = 0; j < rows; j += 4) {
    int i = j;
    for (; i + kBlockRows <= rows; i += kBlockRows) subtract_block<kFours>(Y, columns, i, j, P);
    for (; i < rows; i += 4) subtract_block<1>(Y, columns, i, j, P);
    for (int c = 1; c < 4; ++c) {  // within the block on the diagonal
      for (int r = 0; r < c; ++r) P.at[j + r + (j + c) * P.stride] = P.at[j + c + (j + r) * P.stride];
    }
  }
}

// A row of a matrix as it is, or four of them.
struct OneRow {
  using Number = double;
  [[gnu::always_inline]] static double from(const double* p) { return *p; }
  [[gnu::always_inline]] static void to(double* p, double value) { *p = value; }
  [[gnu::always_inline]] static double same(double value) { return value; }
};
struct FourRows {
  using Number = Four;
  [[gnu::always_inline]] static Four from(const double* p) { return load(p); }
  [[gnu::always_inline]] static void to(double* p, const Four& value) { store(p, value); }
  [[gnu::always_inline]] static Four same(double value) { return all(value); }
};

// Rows of M: rotation, velocity, position and the biases of gyroscope and accelerometer, three columns each.
template <class Rows>
void carry_rows(const double* Phi, double* M, std::ptrdiff_t stride) {
  constexpr int kErrors = 15;
  typename Rows::Number m[kErrors];
  each<kErrors>([&](int k) { m[k] = Rows::from(M + k * stride); });
  const auto add = [&](auto to, auto from) {
    each<3>([&](int j) {
      const double* const row = Phi + to + j;
      m[to + j] += Rows::same(row[kErrors * from]) * m[from] + Rows::same(row[kErrors * (from + 1)]) * m[from + 1] +
                   Rows::same(row[kErrors * (from + 2)]) * m[from + 2];
    });
  };
  add(Index<6>{}, Index<0>{});
  add(Index<6>{}, Index<3>{});
  add(Index<6>{}, Index<9>{});
  add(Index<6>{}, Index<12>{});
  add(Index<3>{}, Index<0>{});
  add(Index<3>{}, Index<9>{});
  add(Index<3>{}, Index<12>{});
  add(Index<0>{}, Index<9>{});
  each<9>([&](int k) { Rows::to(M + k * stride, m[k]); });
}

void carry(const double* Phi, int rows, MutableMatrix M) {
  int i = 0;
  for (; i + 4 <= rows; i += 4) carry_rows<FourRows>(Phi, M.at + i, M.stride);
  for (; i < rows; ++i) carry_rows<OneRow>(Phi, M.at + i, M.stride);
}

inline Four count_up() {
  const double lanes[4] = {0.0, 1.0, 2.0, 3.0};
  return load(lanes);
}

// The largest of pivots / scale that is above `negligible`; -1 if there is none. Of equal ones the first of its column
// of four.
int largest_pivot(const double* pivots, const double* scale, int size, double negligible) {
  Four best = all(negligible);
  Four found = all(-1.0);
  Four index = count_up();
  for (int k = 0; k < size; k += 4) {
    const Four ratio = load(pivots + k) / load(scale + k);
    found = where_greater(ratio, best, index, found);
    best = where_greater(ratio, best, ratio, best);
    index += all(4.0);
  }
  double value[4], at[4];
  store(value, best);
  store(at, found);
  int winner = 0;
  for (int k = 1; k < 4; ++k) {
    if (value[k] > value[winner] || at[winner] < 0.0) winner = k;
  }
  return static_cast<int>(at[winner]);
}

int pivoted_rows(ConstMatrix A, int size, double* b, double* pivots, const double* scale, double negligible,
                 MutableMatrix Ht, double* r) {
  const int rows = whole(size);
  int count = 0;
  while (count < size) {
    const int j = largest_pivot(pivots, scale, rows, negligible);
    if (j < 0) break;
    double* const u = Ht.at + count * Ht.stride;
    for (int k = 0; k < j; ++k) u[k] = A.at[j + k * A.stride];
    for (int k = j; k < size; ++k) u[k] = A.at[k + j * A.stride];
    const double pivot = pivots[j];
    const Four root_of_pivot = root(all(pivot));
    double first[4];
    store(first, root_of_pivot);
    r[count] = b[j] / first[0];
    const Four residual = all(r[count]);
    for (int i = 0; i < rows; i += kBlockRows) {
      Block<1> before;
      for (int k = 0; k < count; ++k) before.add(Ht.at + i + k * Ht.stride, Ht.at + j + k * Ht.stride, 1);
      each<kFours>([&](int f) {
        const int at = i + 4 * f;
        const Four left = load(pivots + at);
        Four value = (load(u + at) - before.sums[f][0]) / root_of_pivot;
        value = where_greater(left, all(0.0), value, all(0.0));  // those that came before are done
        store(u + at, value);
        store(b + at, load(b + at) - residual * value);
        store(pivots + at, left - value * value);
      });
    }
    u[j] = first[0];
    b[j] = 0.0;
    pivots[j] = 0.0;
    ++count;
  }
  return count;
}

struct Fours3 {
  Four x, y, z;
};

// R (x, y, 1) + s p
inline Fours3 taken(const PlainPose& T, Four x, Four y, Four s) {
  Four h[3];
  each<3>([&](int k) { h[k] = all(T.R[3 * k]) * x + all(T.R[3 * k + 1]) * y + all(T.R[3 * k + 2]) + s * all(T.p[k]); });
  return {h[0], h[1], h[2]};
}

// Four features, their depth by least squares over the right camera, linear: stereo_inverse_depth().
struct FourFeatures {
  Four left0[2], right0[2], frame1[2][2];
  Four right1_known, inverse_depth;

  FourFeatures(const StereoTable& table, int first, const PlainPose& right) {
    Four frame0[4], rest[4];
    double flags[4];
    each<4>([&](int k) {
      const bool exists = first + k < table.count;
      const std::ptrdiff_t at = (exists ? first + k : first) * table.stride;
      frame0[k] = load(table.at + at);
      rest[k] = load(table.at + at + 4);
      flags[k] = table.has_right1[at * static_cast<std::ptrdiff_t>(sizeof(double))] ? 1.0 : 0.0;
    });
    transpose(frame0);
    transpose(rest);
    each<2>([&](int k) {
      left0[k] = frame0[k];
      right0[k] = frame0[2 + k];
      frame1[0][k] = rest[k];
      frame1[1][k] = rest[2 + k];
    });
    right1_known = load(flags);
    const Four zero = all(0.0);
    const Fours3 a = taken(right, left0[0], left0[1], zero);
    const Four slope_x = all(right.p[0]) - right0[0] * all(right.p[2]);
    const Four slope_y = all(right.p[1]) - right0[1] * all(right.p[2]);
    const Four numerator = (right0[0] * a.z - a.x) * slope_x + (right0[1] * a.z - a.y) * slope_y;
    const Four denominator = slope_x * slope_x + slope_y * slope_y;
    inverse_depth =
        where_greater(denominator, zero, numerator, zero) / where_greater(denominator, zero, denominator, all(1.0));
  }
};

// Lower triangle by columns.
constexpr int entry(int row, int column) { return column * 6 - column * (column + 1) / 2 + row; }

struct FourSums {
  Four A[21], b[6];

  FourSums() {
    each<21>([&](int k) { A[k] = all(0.0); });
    each<6>([&](int k) { b[k] = all(0.0); });
  }

  // Observations of weight `known`, 1 or 0; 1 for those that fit.
  Four add(const Fours3& h, Four s, const Four (&seen)[2], Four known, const StereoProblem& problem) {
    const Four one = all(1.0);
    const Four zero = all(0.0);
    const Four least_depth = all(problem.least_depth);
    const Four information = all(1.0 / (problem.sigma * problem.sigma));
    const Four huber2 = all(problem.huber * problem.huber);
    const Four per_depth = one / where_greater(h.z, least_depth, h.z, one);
    const Four u = h.x * per_depth;
    const Four v = h.y * per_depth;
    const Four q = s * per_depth;
    const Four r_u = seen[0] - u;
    const Four r_v = seen[1] - v;
    const Four distance2 = (r_u * r_u + r_v * r_v) * information;
    const Four less = all(problem.huber) / root(where_greater(distance2, huber2, distance2, one));
    Four w = known * information * where_greater(distance2, huber2, less, one);
    w = where_greater(h.z, least_depth, w, zero);

    // H = [uv, -(1 + uu), v, -q, 0, qu; 1 + vv, -uv, -u, 0, -q, qv]
    const Four uv = u * v;
    const Four row_u[6] = {uv, -(one + u * u), v, -q, zero, q * u};
    const Four row_v[6] = {one + v * v, -uv, -u, zero, -q, q * v};
    each<6>([&](auto column) {
      constexpr int j = decltype(column)::value;
      const Four w_u = w * row_u[j];
      const Four w_v = w * row_v[j];
      each<6>([&](auto row) {
        constexpr int i = decltype(row)::value;
        constexpr bool by_u = i != 4 && j != 4;  // the others are zero
        constexpr bool by_v = i != 3 && j != 3;
        if constexpr (i >= j && by_u && by_v) A[entry(i, j)] += w_u * row_u[i] + w_v * row_v[i];
        if constexpr (i >= j && by_u && !by_v) A[entry(i, j)] += w_u * row_u[i];
        if constexpr (i >= j && !by_u && by_v) A[entry(i, j)] += w_v * row_v[i];
      });
      if constexpr (j == 3) {
        b[j] += w_u * r_u;
      } else if constexpr (j == 4) {
        b[j] += w_v * r_v;
      } else {
        b[j] += w_u * r_u + w_v * r_v;
      }
    });
    const Four fits = where_greater(all(problem.fits * problem.fits), distance2, one, zero);
    return where_greater(h.z, least_depth, fits, zero);
  }
};

int add_stereo(const StereoTable& table, const StereoProblem& problem, StereoSums* sums) {
  const Four one = all(1.0);
  FourSums left, right;
  Four fitting = all(0.0);
  for (int first = 0; first < table.count; first += 4) {
    const FourFeatures f(table, first, problem.right0);
    const double left_over = table.count - first;
    Four usable = where_greater(all(left_over), count_up(), one, all(0.0));
    usable = where_greater(all(0.0), f.inverse_depth, all(0.0), usable);  // behind the cameras
    const Four s = f.inverse_depth;
    const Four known = usable * f.right1_known;
    const Four fits_left =
        left.add(taken(problem.frame1[0], f.left0[0], f.left0[1], s), s, f.frame1[0], usable, problem);
    const Four fits_right =
        right.add(taken(problem.frame1[1], f.left0[0], f.left0[1], s), s, f.frame1[1], known, problem);
    fitting += usable * fits_left * (one - f.right1_known + f.right1_known * fits_right);
  }
  each<21>([&](int k) {
    sums[0].A[k] = sum(left.A[k]);
    sums[1].A[k] = sum(right.A[k]);
  });
  each<6>([&](int k) {
    sums[0].b[k] = sum(left.b[k]);
    sums[1].b[k] = sum(right.b[k]);
  });
  return static_cast<int>(sum(fitting));
}

}  // namespace

inline FilterKernels kernels(Kernels kind) {
  return {kind, multiply, multiply_transposed, factorize, solve, subtract_square, carry, pivoted_rows, add_stereo};
}

}  // namespace ear::EAR_VARIANT
// NOLINTEND(modernize-avoid-c-arrays,misc-definitions-in-headers)
