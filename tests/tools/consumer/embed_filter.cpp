#include <filter/ekf/state.h>

#include <cstdlib>

int main() {
  ear::State state;
  Eigen::VectorXd error = Eigen::VectorXd::Zero(state.error_size());
  error(ear::err::rho) = 0.5;  // [m]
  const Eigen::VectorXd back = ear::boxminus(ear::boxplus(state, error), state);
  return (back - error).norm() < 1e-12 ? EXIT_SUCCESS : EXIT_FAILURE;
}
