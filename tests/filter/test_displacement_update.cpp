#include "filter/displacement_update.h"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/check_jacobian.h"
#include "tests/support/random_drive.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr int kClone = 1;  // of three: where the displacement starts

Eigen::Vector3d start_normal(const State& x) { return x.clones[kClone].T_WB.R.transpose() * x.ground.n_W; }

WheelDisplacement displacement(const State& x, const std::vector<WheelInterval>& intervals, const WheelNoise& noise) {
  return preintegrate(intervals, wheel_model(x.odometer), noise, start_normal(x), x.imu.b_g);
}

/// On the ground, and now where the wheels have brought it since the clone.
State state_after(const std::vector<WheelInterval>& intervals, std::mt19937_64& rng) {
  State x = random_state(rng, 3);
  Pose& T_WBi = x.clones[kClone].T_WB;
  T_WBi.R = exp_so3(random_vector(rng, 0.2));
  const WheelDisplacement z = displacement(x, intervals, WheelNoise{});
  x.imu.R_WB = T_WBi.R * z.R_BiBj;
  x.imu.p_WB = T_WBi.p + T_WBi.R * (x.odometer.T_BO.p + z.alpha_Bi) - x.imu.R_WB * x.odometer.T_BO.p;
  return x;
}

/// H over the whole error vector.
Eigen::MatrixXd full_H(const DisplacementRows& rows, const State& x) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3, x.error_size());
  H.leftCols<err::camera>() = rows.H;
  H.middleCols<err::clone_size>(err::clone(kClone)) = rows.H_clone;
  return H;
}

}  // namespace

TEST_CASE("displacement_update: nothing is left when the poses are those of the wheels") {
  std::mt19937_64 rng{31};
  const std::vector<WheelInterval> intervals = random_drive(rng, 20);
  const State x = state_after(intervals, rng);
  const WheelDisplacement z = displacement(x, intervals, WheelNoise{});
  CHECK(linearize_displacement(x, kClone, z).residual.norm() < 1e-12);
  State further = x;
  further.imu.p_WB += x.clones[kClone].T_WB.R * Eigen::Vector3d(0.1, 0.0, 0.0);
  CHECK((linearize_displacement(further, kClone, z).residual + Eigen::Vector3d(0.1, 0.0, 0.0)).norm() < 1e-12);
}

TEST_CASE("displacement_update: H is the derivative, by poses, bias, normal, wheels and mounting") {
  std::mt19937_64 rng{32};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const std::vector<WheelInterval> intervals = random_drive(rng, 20);
    const State x = state_after(intervals, rng);
    const WheelDisplacement z = displacement(x, intervals, WheelNoise{});
    const Eigen::MatrixXd H = full_H(linearize_displacement(x, kClone, z), x);
    // Integrated anew with the disturbed state, and corrected to first order.
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          const State other = boxplus(x, d);
          return -linearize_displacement(other, kClone, displacement(other, intervals, WheelNoise{})).residual;
        },
        H);
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return -linearize_displacement(boxplus(x, d), kClone, z).residual;
        },
        H);
  }
}

TEST_CASE("displacement_update: where it is, and which way is north, cannot be seen") {
  std::mt19937_64 rng{33};
  const std::vector<WheelInterval> intervals = random_drive(rng, 20);
  const State x = state_after(intervals, rng);
  const Eigen::MatrixXd H = full_H(linearize_displacement(x, kClone, displacement(x, intervals, WheelNoise{})), x);
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(x.error_size(), 4);
  N.block<3, 1>(err::theta, 0) = Eigen::Vector3d::UnitZ();
  N.block<3, 3>(err::rho, 1).setIdentity();
  for (int i = 0; i < 3; ++i) {
    N.block<3, 1>(err::clone(i), 0) = Eigen::Vector3d::UnitZ();
    N.block<3, 3>(err::clone(i) + 3, 1).setIdentity();
  }
  CHECK((H * N).norm() < 1e-12);
}

TEST_CASE("displacement_update: the residual is as large as its covariance says (4000 draws)") {
  std::mt19937_64 rng{34};
  WheelNoise noise;
  noise.reading = 1e-3;
  noise.slip = 2e-3;
  const std::vector<WheelInterval> intervals = random_drive(rng, 20);
  const State truth = state_after(intervals, rng);
  const Eigen::VectorXd sigma = Eigen::VectorXd::Constant(truth.error_size(), 1e-3);
  constexpr int kRuns = 4000;
  std::normal_distribution<double> normal;
  double chi_squared = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    Eigen::VectorXd d(truth.error_size());
    for (double& entry : d) entry = normal(rng);
    const State x = boxplus(truth, d.cwiseProduct(sigma));
    std::vector<WheelInterval> read = intervals;
    Eigen::Vector2d error = random_vector(rng, noise.reading).head<2>();
    for (WheelInterval& interval : read) {
      const Eigen::Vector2d next = random_vector(rng, noise.reading).head<2>();
      interval.turn += next - error;
      error = next;
    }
    WheelDisplacement z = displacement(x, read, noise);
    z.alpha_Bi += noise.slip * std::sqrt(z.distance) * normal(rng) * z.alpha_Bi.normalized();
    const DisplacementRows rows = linearize_displacement(x, kClone, z);
    const Eigen::MatrixXd H = full_H(rows, x);
    const Eigen::Matrix3d S = H * sigma.array().square().matrix().asDiagonal() * H.transpose() + rows.covariance;
    chi_squared += rows.residual.dot(S.llt().solve(rows.residual)) / kRuns;
  }
  CHECK(std::abs(chi_squared - 3.0) < 4.0 * std::sqrt(2.0 * 3.0 / kRuns));  // of the mean of chi-squares
}
