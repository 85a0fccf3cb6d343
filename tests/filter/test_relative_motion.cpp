#include "filter/ekf/relative_motion.h"

#include <doctest/doctest.h>

#include <random>

#include "filter/ekf/so3.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

namespace {

Pose motion_since_clone(const State& x) { return x.clones.back().T_WB.inverse() * x.imu.T_WB(); }

struct Rows {
  Eigen::MatrixXd H;
  Eigen::Matrix<double, 6, 1> residual;
};

Rows linearized(const State& x, const Pose& T_B0B1) {
  Rows rows{Eigen::MatrixXd(6, x.error_size()), {}};
  linearize_relative_motion(x, T_B0B1, rows.H, rows.residual);
  return rows;
}

}  // namespace

TEST_CASE("relative_motion: nothing is left of the motion that the state has") {
  std::mt19937_64 rng{51};
  const State x = random_state(rng, 3);
  CHECK(linearized(x, motion_since_clone(x)).residual.norm() < 1e-12);
}

TEST_CASE("relative_motion: a body further ahead, and turned further left, than thought") {
  State x;
  x.clones.resize(1);  // at the origin, as the state
  const Rows rows = linearized(x, {exp_so3(Eigen::Vector3d(0.0, 0.0, 0.1)), Eigen::Vector3d(0.2, 0.0, 0.0)});
  CHECK(rows.residual(2) == doctest::Approx(0.1));
  CHECK(rows.residual(3) == doctest::Approx(0.2));
}

TEST_CASE("relative_motion: H is the derivative of what is expected") {
  std::mt19937_64 rng{52};
  const State x = random_state(rng, 3);
  const Pose measured = motion_since_clone(x);
  // The residual shrinks by what the state moves towards the measurement.
  check_jacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return -linearized(with_error(x, d), measured).residual; },
      linearized(x, measured).H);
}

TEST_CASE("relative_motion: shows nothing of the heading and the position, however far off the state is") {
  std::mt19937_64 rng{53};
  const State x = random_state(rng, 3);
  const Pose measured = motion_since_clone(x) * random_pose(rng, 0.5, 1.0);
  const Rows rows = linearized(x, measured);
  REQUIRE(rows.residual.norm() > 0.1);
  const Eigen::MatrixXd N = unobservable(x);
  CHECK((rows.H * N.col(0)).norm() < 1e-12);
  CHECK((rows.H * N.rightCols<3>() * Eigen::Vector3d(1.0, -2.0, 0.5)).norm() < 1e-12);
}
