#include <doctest/doctest.h>

#include "filter/ekf/state.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

TEST_CASE("state: boxminus undoes boxplus") {
  std::mt19937_64 rng{21};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const State x = random_state(rng, 3);
    Eigen::VectorXd d(x.error_size());
    for (auto& value : d) value = 0.1 * random_vector(rng, 1.0).x();
    CHECK((boxminus(with_error(x, d), x) - d).norm() < 1e-9);
  }
}

TEST_CASE("state: the invariant error of a common yaw and shift is the same in the body and in every clone") {
  std::mt19937_64 rng{22};
  const State x = random_state(rng, 2);
  const Eigen::Matrix3d R = exp_so3({0.0, 0.0, 0.3});
  const Eigen::Vector3d shift{1.0, -2.0, 0.5};
  State moved = x;
  moved.imu.R_WB = R * x.imu.R_WB;
  moved.imu.v_W = R * x.imu.v_W;
  moved.imu.p_WB = R * x.imu.p_WB + shift;
  for (Clone& clone : moved.clones) clone.T_WB = {R * clone.T_WB.R, R * clone.T_WB.p + shift};
  const Eigen::VectorXd d = boxminus(moved, x);
  CHECK((d.segment<3>(err::theta) - Eigen::Vector3d(0.0, 0.0, 0.3)).norm() < 1e-9);
  CHECK(d.segment<3>(err::nu).norm() < 1e-9);
  CHECK((d.segment<3>(err::rho) - shift).norm() < 1e-9);
  for (int i = 0; i < 2; ++i) {
    CHECK((d.segment<3>(err::clone(i)) - Eigen::Vector3d(0.0, 0.0, 0.3)).norm() < 1e-9);
    CHECK((d.segment<3>(err::clone(i) + 3) - shift).norm() < 1e-9);
  }
}
