// The filter's sums over many rows, once for each vector unit, as the front end has them for images: one program holds
// them all, and takes the best one that the processor has. All variants give the same bits: each sum has one order, and
// no product is fused with a sum. docs/performance.md, "Kernels".
//
// Matrices are stored by columns, a column every `stride` numbers. Rows are taken eight at a time: where there are
// fewer, those up to the next multiple of eight are read and written as well, and mean nothing.
#pragma once

#include <cstddef>

#include "ear/kernels.h"

namespace ear {

constexpr int kRowsAtOnce = 8;
[[nodiscard]] constexpr int rounded_up(int rows) { return (rows + kRowsAtOnce - 1) / kRowsAtOnce * kRowsAtOnce; }
/// Numbers from one column to the next. An odd multiple of eight: powers of two would fall on the same lines of the
/// processor's cache.
[[nodiscard]] constexpr int stride_for(int rows) { return rounded_up(rows) | kRowsAtOnce; }

struct ConstMatrix {
  const double* at;
  std::ptrdiff_t stride;
};
struct MutableMatrix {
  double* at;
  std::ptrdiff_t stride;
};

/// Features seen by both cameras in frame 0 and by the left one in frame 1. Of each, `stride` numbers after the one
/// before: where the left and the right camera see it in frame 0 and then in frame 1, two numbers each; and, in bytes
/// as far apart, whether the right one sees it in frame 1.
struct StereoTable {
  const double* at;
  std::ptrdiff_t stride;
  const bool* has_right1;
  int count;
};
// NOLINTBEGIN(modernize-avoid-c-arrays): the kernels use no functions of std::array, see kernels_body.h
/// R (by rows) and p: what takes points elsewhere.
struct PlainPose {
  double R[9], p[3];
};
/// Into which cameras the points are taken, by a least squares problem over turn and shift: stereo_motion.cpp.
struct StereoProblem {
  PlainPose right0;     ///< from the left camera to the right one
  PlainPose frame1[2];  ///< from the left camera of frame 0 to both of frame 1
  double sigma;         ///< of an observation
  double huber, fits;   ///< [sigma] from where one weighs less, and up to where it fits
  double least_depth;   ///< of a scaled point
};
/// A camera's normal equations: the lower triangle of A by columns, b.
struct StereoSums {
  double A[21], b[6];
};
// NOLINTEND(modernize-avoid-c-arrays)

struct FilterKernels {
  Kernels kind;
  /// C = A B, where of A only the `count` columns `used` are looked at, and of B these rows. Of C `columns`.
  void (*multiply)(ConstMatrix A, ConstMatrix B, const int* used, int count, int rows, int columns, MutableMatrix C);
  /// The lower triangle of A^T B, both with `rows` rows, a multiple of four: `size` rows and columns.
  void (*multiply_transposed)(ConstMatrix A, ConstMatrix B, int rows, int size, MutableMatrix C);
  /// The factor L of S = L L^T, and L^-1 z, in their places. Of S the lower triangle is read, and holds L then. False
  /// if S is not positive.
  bool (*factorize)(MutableMatrix S, int size, double* z);
  /// Y L^-T in the place of Y. Of L, `columns` rows and columns, the lower triangle is read.
  void (*solve)(ConstMatrix L, int rows, int columns, MutableMatrix Y);
  /// P - Y Y^T in the place of P: both triangles, by the lower one of P. P is `size` rows and columns, rounded up.
  void (*subtract_square)(ConstMatrix Y, int columns, int size, MutableMatrix P);
  /// M Phi^T in the place of M, of which the first columns belong to the inertial errors: the biases' stay. With M = P
  /// this is one half of Phi P Phi^T; the products are those of 3 x 3 blocks that are not zero. `Phi`: 15 x 15 by
  /// columns. Any number of rows, and none beyond.
  void (*carry)(const double* Phi, int rows, MutableMatrix M);
  /// See rows_from_sums(). Of A the lower triangle is read; b and pivots are overwritten. How many rows there are.
  int (*pivoted_rows)(ConstMatrix A, int size, double* b, double* pivots, const double* scale, double negligible,
                      MutableMatrix Ht, double* r);
  /// Adds the features to the sums of both cameras of frame 1; how many fit.
  int (*add_stereo)(const StereoTable& table, const StereoProblem& problem, StereoSums* sums);
};

/// Where this processor, or this build, does not have them: the next best.
[[nodiscard]] FilterKernels filter_kernels(Kernels kind = Kernels::best);

}  // namespace ear
