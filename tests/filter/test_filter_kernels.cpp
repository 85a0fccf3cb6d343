// Every variant that this processor can run gives the same bits, and those that the formulas say.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "filter/ekf/kernel_matrix.h"
#include "filter/kernels/filter_kernels.h"

namespace ear {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kClose = 1e-12;

/// Random, with room for whole groups of rows; what is beyond `rows` is not zero.
MatrixXd random_matrix(std::mt19937_64& rng, int rows, int columns) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(stride_for(rows), columns, [&](Eigen::Index, Eigen::Index) { return normal(rng); });
}

/// Those that this build has and this processor can run, the best one last.
std::vector<FilterKernels> all_filter_kernels() {
  std::vector<FilterKernels> all;
  for (const Kernels kind : {Kernels::plain, Kernels::neon, Kernels::sse2, Kernels::sse4, Kernels::avx2}) {
    const FilterKernels kernels = filter_kernels(kind);  // or the next best
    if (all.empty() || all.back().kind != kernels.kind) all.push_back(kernels);
  }
  return all;
}

/// Runs `work` with every variant: the same bits; the result of the first.
template <class Work>
auto by_all(const Work& work) {
  const std::vector<FilterKernels> all = all_filter_kernels();
  auto first = work(all.front());
  for (const FilterKernels& kernels : all) CHECK((work(kernels) == first));
  return first;
}

TEST_CASE("kernels: the best ones are the last, and any name gives some") {
  CHECK(filter_kernels().kind == all_filter_kernels().back().kind);
  for (const FilterKernels& kernels : all_filter_kernels()) CHECK(filter_kernels(kernels.kind).kind == kernels.kind);
  CHECK_NOTHROW((void)filter_kernels(Kernels::sse4));
}

TEST_CASE("kernels: strides are odd multiples of eight") {
  for (const int rows : {1, 7, 8, 9, 121, 128}) {
    CHECK(stride_for(rows) >= rounded_up(rows));
    CHECK(stride_for(rows) % 16 == 8);
  }
}

TEST_CASE("kernels: products of some columns") {
  std::mt19937_64 rng{1};
  for (const int rows : {1, 8, 9, 121}) {
    for (const int columns : {1, 2, 3, 4, 27}) {
      const MatrixXd A = random_matrix(rng, rows, 30);
      MatrixXd B = random_matrix(rng, 30, columns);
      std::vector<int> used(15);
      std::iota(used.begin(), used.end(), 7);
      const MatrixXd product = by_all([&](const FilterKernels& kernels) {
        MatrixXd C = MatrixXd::Zero(stride_for(rows), columns);
        kernels.multiply(readable(A), readable(B), used.data(), 15, rows, columns, writable(C));
        return MatrixXd(C.topRows(rows));
      });
      CHECK((product - A.block(0, 7, rows, 15) * B.middleRows(7, 15)).norm() < kClose * rows * columns);
    }
  }
}

TEST_CASE("kernels: the lower triangle of A^T B") {
  std::mt19937_64 rng{2};
  for (const int size : {1, 2, 3, 4, 8, 27}) {
    const MatrixXd A = random_matrix(rng, 92, size);
    const MatrixXd B = random_matrix(rng, 92, size);
    const MatrixXd lower = by_all([&](const FilterKernels& kernels) {
      MatrixXd C = MatrixXd::Zero(stride_for(size), size);
      kernels.multiply_transposed(readable(A), readable(B), 92, size, writable(C));
      return MatrixXd(C.topRows(size).triangularView<Eigen::Lower>());
    });
    const MatrixXd expected = A.topRows(92).transpose() * B.topRows(92);
    CHECK((lower - MatrixXd(expected.triangularView<Eigen::Lower>())).norm() < 1e3 * kClose);
  }
}

TEST_CASE("kernels: an update of a covariance") {
  std::mt19937_64 rng{3};
  for (const int size : {5, 24, 121}) {
    for (const int columns : {1, 2, 3, 4, 5, 40}) {
      const MatrixXd root = random_matrix(rng, columns, columns + 3);
      const MatrixXd S = root.topRows(columns) * root.topRows(columns).transpose();
      MatrixXd L = MatrixXd::Constant(stride_for(columns), columns, NAN);  // the upper triangle is not read
      const MatrixXd factor = S.llt().matrixL();
      for (int j = 0; j < columns; ++j) L.col(j).segment(j, columns - j) = factor.col(j).tail(columns - j);
      const MatrixXd factored = by_all([&](const FilterKernels& kernels) {
        MatrixXd M = MatrixXd::Zero(stride_for(columns), columns + 1);  // the last column: z
        M.topLeftCorner(columns, columns) = S.triangularView<Eigen::Lower>();
        M.col(columns).head(columns) = root.col(0).head(columns);
        CHECK(kernels.factorize(writable(M), columns, M.col(columns).data()));
        MatrixXd result = M.topRows(columns);
        result.leftCols(columns) = MatrixXd(result.leftCols(columns).triangularView<Eigen::Lower>());
        M.topLeftCorner(columns, columns) = -S;
        CHECK_FALSE(kernels.factorize(writable(M), columns, M.col(columns).data()));
        return result;
      });
      CHECK((factored.leftCols(columns) - factor).norm() < 1e4 * kClose * factor.norm());
      CHECK((factor * factored.col(columns) - root.col(0).head(columns)).norm() < 1e4 * kClose * factor.norm());
      const MatrixXd Y = random_matrix(rng, size, columns);
      const MatrixXd solved = by_all([&](const FilterKernels& kernels) {
        MatrixXd X = Y;
        kernels.solve(readable(L), size, columns, writable(X));
        return MatrixXd(X.topRows(size));
      });
      CHECK((solved * factor.transpose() - Y.topRows(size)).norm() < 1e4 * kClose * Y.norm());

      const MatrixXd half = random_matrix(rng, size, rounded_up(size));
      const MatrixXd lower = MatrixXd(half.triangularView<Eigen::Lower>());
      const MatrixXd difference = by_all([&](const FilterKernels& kernels) {
        MatrixXd P = half;
        kernels.subtract_square(readable(Y), columns, size, writable(P));
        return MatrixXd(P.topLeftCorner(size, size));
      });
      CHECK((difference == difference.transpose()));
      MatrixXd expected = lower.topLeftCorner(size, size).selfadjointView<Eigen::Lower>();
      expected -= Y.topRows(size) * Y.topRows(size).transpose();
      CHECK((difference - expected).norm() < kClose * size * columns);
    }
  }
}

TEST_CASE("kernels: an error carried along, whatever the number of rows") {
  std::mt19937_64 rng{6};
  MatrixXd Phi = MatrixXd::Identity(15, 15);  // rotation, velocity, position, biases of gyroscope and accelerometer
  Phi.block(0, 9, 3, 3) = random_matrix(rng, 3, 3).topRows(3);
  Phi.block(3, 0, 3, 3) = random_matrix(rng, 3, 3).topRows(3);
  Phi.block(6, 0, 3, 6) = random_matrix(rng, 3, 6).topRows(3);
  Phi.block(3, 9, 6, 6) = random_matrix(rng, 6, 6).topRows(6);
  for (const int rows : {1, 3, 4, 15, 121}) {
    const MatrixXd M = random_matrix(rng, rows, 15);
    const MatrixXd carried = by_all([&](const FilterKernels& kernels) {
      MatrixXd result = M;
      kernels.carry(Phi.data(), rows, writable(result));
      return result;
    });
    CHECK((carried.topRows(rows) - M.topRows(rows) * Phi.transpose()).norm() < kClose * rows * 100);
    CHECK((carried.bottomRows(M.rows() - rows) == M.bottomRows(M.rows() - rows)));
  }
}

struct Rows {
  MatrixXd H;
  VectorXd r;
  bool operator==(const Rows& other) const { return H == other.H && r == other.r; }
};

TEST_CASE("kernels: rows of a singular sum, the largest pivot first") {
  std::mt19937_64 rng{4};
  for (const int size : {5, 19, 91}) {
    const int rank = size / 2;
    const MatrixXd H = random_matrix(rng, rank, size).topRows(rank);
    const VectorXd r = VectorXd::LinSpaced(rank, -1.0, 2.0);
    MatrixXd A = MatrixXd::Zero(stride_for(size), size);
    A.topRows(size) = MatrixXd((H.transpose() * H).triangularView<Eigen::Lower>());
    const int room = rounded_up(size);
    const Rows rows = by_all([&](const FilterKernels& kernels) {
      VectorXd b = VectorXd::Zero(room), pivots = VectorXd::Zero(room), scale = VectorXd::Ones(room), z(room);
      b.head(size) = H.transpose() * r;
      pivots.head(size) = scale.head(size) = A.diagonal().head(size);
      MatrixXd Ht = MatrixXd::Zero(stride_for(size), size);
      const int count =
          kernels.pivoted_rows(readable(A), size, b.data(), pivots.data(), scale.data(), 1e-10, writable(Ht), z.data());
      return Rows{Ht.topLeftCorner(size, count).transpose(), z.head(count)};
    });
    REQUIRE(rows.r.size() == rank);
    CHECK((rows.H.transpose() * rows.H - H.transpose() * H).norm() < 1e-9 * H.squaredNorm());
    CHECK((rows.H.transpose() * rows.r - H.transpose() * r).norm() < 1e-9 * H.squaredNorm());
  }
}

struct Equations {
  std::array<MatrixXd, 2> A = {MatrixXd::Zero(6, 6), MatrixXd::Zero(6, 6)};
  std::array<VectorXd, 2> b = {VectorXd::Zero(6), VectorXd::Zero(6)};
  int fitting = 0;
  bool operator==(const Equations& o) const { return A == o.A && b == o.b && fitting == o.fitting; }
};

/// A feature as it stands in a table: nine numbers, of which the last one's first byte says whether the right camera
/// sees it in frame 1.
struct Feature {
  std::array<double, 8> seen;
  bool has_right1;
};

/// What add_stereo() is to give, feature by feature.
Equations expected_equations(const std::vector<Feature>& features, const StereoProblem& problem) {
  Equations sums;
  const auto taken = [](const PlainPose& T, const Eigen::Vector3d& ray, double s) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(T.R);
    return Eigen::Vector3d(R * ray + s * Eigen::Map<const Eigen::Vector3d>(T.p));
  };
  for (const Feature& feature : features) {
    const Eigen::Map<const VectorXd> seen(feature.seen.data(), 8);
    const Eigen::Vector3d ray = Eigen::Vector2d(seen.head<2>()).homogeneous();
    const Eigen::Vector3d a = taken(problem.right0, ray, 0.0);
    const Eigen::Map<const Eigen::Vector3d> p(problem.right0.p);
    const Eigen::Vector2d slope = p.head<2>() - seen.segment<2>(2) * p.z();
    const double s = (seen.segment<2>(2) * a.z() - a.head<2>()).dot(slope) / slope.squaredNorm();
    if (s < 0.0) continue;
    bool fits = true;
    for (std::size_t camera = 0; camera < (feature.has_right1 ? 2U : 1U); ++camera) {
      const Eigen::Vector3d h = taken(problem.frame1[camera], ray, s);
      fits = fits && h.z() >= problem.least_depth;
      if (h.z() < problem.least_depth) continue;
      Eigen::Matrix<double, 2, 3> J;
      J << 1.0 / h.z(), 0.0, -h.x() / (h.z() * h.z()), 0.0, 1.0 / h.z(), -h.y() / (h.z() * h.z());
      Eigen::Matrix<double, 3, 6> J_h;  // dh = [h]x theta - s tau
      J_h << 0.0, -h.z(), h.y(), -s, 0.0, 0.0, h.z(), 0.0, -h.x(), 0.0, -s, 0.0, -h.y(), h.x(), 0.0, 0.0, 0.0, -s;
      const Eigen::Matrix<double, 2, 6> H = J * J_h;
      const Eigen::Vector2d r = seen.segment<2>(4 + 2 * static_cast<Eigen::Index>(camera)) - h.head<2>() / h.z();
      const double distance = r.norm() / problem.sigma;
      const double w = std::min(1.0, problem.huber / distance) / (problem.sigma * problem.sigma);
      fits = fits && distance < problem.fits;
      sums.A[camera] += w * H.transpose() * H;
      sums.b[camera] += w * H.transpose() * r;
    }
    sums.fitting += fits ? 1 : 0;
  }
  return sums;
}

TEST_CASE("kernels: a step of the motion between stereo images") {
  std::mt19937_64 rng{5};
  std::normal_distribution<double> normal;
  StereoProblem problem{};
  problem.right0 = {{1.0, 0.01, 0.0, -0.01, 1.0, 0.02, 0.0, -0.02, 1.0}, {-0.1, 0.001, 0.002}};
  problem.frame1[0] = {{1.0, 0.02, -0.01, -0.02, 1.0, 0.03, 0.01, -0.03, 1.0}, {0.03, 0.02, -0.2}};
  problem.frame1[1] = {{1.0, 0.03, 0.0, -0.03, 1.0, 0.0, 0.0, 0.0, 1.0}, {-0.07, 0.02, -0.2}};
  problem.sigma = 0.01;
  problem.huber = 2.0;
  problem.fits = 3.5;
  problem.least_depth = 1e-3;
  for (const std::size_t count : {1U, 3U, 4U, 5U, 8U, 150U}) {
    std::vector<Feature> features(count);
    for (Feature& f : features) {
      const Eigen::Vector3d p = Eigen::Vector3d(normal(rng), normal(rng), 4.0 + normal(rng)) * 0.5;
      const double noise = 0.015;
      const double wrong = normal(rng) > 1.5 ? -0.3 : 0.0;  // some seem behind the cameras
      f.seen = {p.x() / p.z(),
                p.y() / p.z(),
                (p.x() + problem.right0.p[0]) / p.z() - wrong,
                p.y() / p.z(),
                p.x() / p.z() + noise * normal(rng),
                p.y() / p.z() + noise * normal(rng),
                (p.x() - 0.1) / p.z() + noise * normal(rng),
                p.y() / p.z() + noise * normal(rng)};
      f.has_right1 = normal(rng) > -1.0;
    }
    const StereoTable table{features.front().seen.data(), sizeof(Feature) / sizeof(double),
                            &features.front().has_right1, static_cast<int>(count)};
    const Equations found = by_all([&](const FilterKernels& kernels) {
      std::array<StereoSums, 2> sums;
      Equations equations;
      equations.fitting = kernels.add_stereo(table, problem, sums.data());
      for (std::size_t camera = 0; camera < 2; ++camera) {
        const double* entry = sums[camera].A;
        for (int j = 0; j < 6; ++j) {
          for (int i = j; i < 6; ++i) equations.A[camera](i, j) = equations.A[camera](j, i) = *entry++;
          equations.b[camera](j) = sums[camera].b[j];
        }
      }
      return equations;
    });
    const Equations expected = expected_equations(features, problem);
    CHECK(found.fitting == expected.fitting);
    for (std::size_t camera = 0; camera < 2; ++camera) {
      const double scale = expected.A[camera].norm() + 1.0;
      CHECK((found.A[camera] - expected.A[camera]).norm() < kClose * scale);
      CHECK((found.b[camera] - expected.b[camera]).norm() < kClose * scale);
    }
  }
}

}  // namespace
}  // namespace ear
