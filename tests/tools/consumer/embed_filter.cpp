#include <filter/ekf/state.h>

#include <cstdlib>

int main() {
  ear::State state;
  Eigen::VectorXd error = Eigen::VectorXd::Zero(state.error_size());
  error(ear::err::rho) = 0.5;  // [m]
  ear::boxplus(state, error);
  return (state.imu.p_WB - Eigen::Vector3d(0.5, 0.0, 0.0)).norm() < 1e-12 ? EXIT_SUCCESS : EXIT_FAILURE;
}
