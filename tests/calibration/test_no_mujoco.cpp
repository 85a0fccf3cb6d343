// In place of test_mujoco.cpp, where MuJoCo is not installed.
#include <doctest/doctest.h>

#include "tests/support/skip.h"

TEST_CASE("calibrate: wheels and beams of a vehicle of another physics") {
  ear::test::skip("MuJoCo is not installed (libmujoco-dev)");
}
