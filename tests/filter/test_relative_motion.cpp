#include "filter/ekf/relative_motion.h"

#include <doctest/doctest.h>

#include <random>

#include "filter/ekf/so3.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr int kClone = 1;  // of three

Pose motion_since(const State& x, int clone) {
  const Pose& from = x.clones[static_cast<std::size_t>(clone)].T_WB;
  return {from.R.transpose() * x.imu.R_WB, from.R.transpose() * (x.imu.p_WB - from.p)};
}

}  // namespace

TEST_CASE("relative_motion: nothing is left of the motion that the state has") {
  std::mt19937_64 rng{51};
  const State x = random_state(rng, 3);
  CHECK(linearize_relative_motion(x, kClone, motion_since(x, kClone)).residual.norm() < 1e-12);
}

TEST_CASE("relative_motion: a body further ahead, and turned further left, than thought") {
  State x;
  x.clones.resize(1);  // at the origin, as the state
  const RelativeMotionRows rows =
      linearize_relative_motion(x, 0, {exp_so3(Eigen::Vector3d(0.0, 0.0, 0.1)), Eigen::Vector3d(0.2, 0.0, 0.0)});
  CHECK(rows.residual(2) == doctest::Approx(0.1));
  CHECK(rows.residual(3) == doctest::Approx(0.2));
}

TEST_CASE("relative_motion: H is the derivative of what is expected") {
  std::mt19937_64 rng{52};
  const State x = random_state(rng, 3);
  const RelativeMotionRows rows = linearize_relative_motion(x, kClone, motion_since(x, kClone));
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6, x.error_size());
  H.leftCols<err::imu_size>() = rows.H;
  H.middleCols<err::clone_size>(err::clone(kClone)) = rows.H_clone;
  // The residual shrinks by what the state moves towards the measurement.
  const Pose measured = motion_since(x, kClone);
  check_jacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
        return -linearize_relative_motion(boxplus(x, d), kClone, measured).residual;
      },
      H);
}
