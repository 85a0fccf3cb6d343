#include <doctest/doctest.h>

#include <random>

#include "filter/ekf/propagation.h"
#include "tests/support/about.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

namespace {

Eigen::VectorXd imu_difference(const ImuState& truth, const ImuState& estimate) {
  State a, b;
  a.imu = truth;
  b.imu = estimate;
  return boxminus(a, b).head<err::imu_size>();
}

ImuState disturbed(const ImuState& x, const Eigen::VectorXd& d) {
  State state;
  state.imu = x;
  Eigen::VectorXd full = Eigen::VectorXd::Zero(err::clones);
  full.head<err::imu_size>() = d;
  return with_error(state, full).imu;
}

}  // namespace

TEST_CASE("propagation: free fall, and standing still") {
  ImuState x;
  x.v_W = {1.0, 0.0, 2.0};
  const ImuState fallen = integrate(x, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.5);
  CHECK((fallen.v_W - Eigen::Vector3d(1.0, 0.0, 2.0 - 9.81 * 0.5)).norm() < 1e-12);
  CHECK((fallen.p_WB - Eigen::Vector3d(0.5, 0.0, 1.0 - 0.5 * 9.81 * 0.25)).norm() < 1e-12);
  CHECK(fallen.t_ns == 500'000'000);
  const ImuState stood = integrate(ImuState{}, Eigen::Vector3d::Zero(), -kGravity_W, 1.0);
  CHECK(stood.v_W.norm() < 1e-12);
}

TEST_CASE("propagation: a circle at constant speed, one step at a time and in one") {
  // Left turn: rate about z, force towards the centre on the left (y), plus gravity.
  ImuState x;
  x.v_W = {2.0, 0.0, 0.0};
  const Eigen::Vector3d rate{0.0, 0.0, 0.5};
  const Eigen::Vector3d force{0.0, 2.0 * 0.5, 9.81};
  ImuState steps = x;
  for (int i = 0; i < 200; ++i) steps = integrate(steps, rate, force, 0.005);
  const ImuState once = integrate(x, rate, force, 1.0);
  const Eigen::Vector3d expected{4.0 * std::sin(0.5), 4.0 * (1.0 - std::cos(0.5)), 0.0};  // radius 4 m
  CHECK((steps.p_WB - expected).norm() < 1e-9);
  CHECK((once.p_WB - expected).norm() < 1e-9);
  CHECK(once.v_W.y() > 0.0);
}

TEST_CASE("propagation: Phi is the derivative, biases included") {
  std::mt19937_64 rng{11};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const ImuState x = random_state(rng, 0).imu;
    const Eigen::Vector3d gyro = random_vector(rng, 1.0);
    const Eigen::Vector3d accel = random_vector(rng, 5.0) - kGravity_W;
    const double dt = 0.01;
    const ImuState next = integrate(x, gyro, accel, dt);
    const ErrorTransition step = error_transition(x, gyro, accel, dt, ImuCalibration{});
    check_jacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return imu_difference(integrate(disturbed(x, d), gyro, accel, dt), next);
        },
        step.Phi);
  }
}

TEST_CASE("propagation: what the inertial sensors' matrices do is the derivative") {
  std::mt19937_64 rng{14};
  const auto with = [](const Eigen::VectorXd& E) -> Eigen::Matrix3d {
    return Eigen::Matrix3d::Identity() + Eigen::Matrix3d(E.reshaped(3, 3));
  };
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const ImuState start = random_state(rng, 0).imu;
    const double dt = 0.01;
    MatrixEffect effect;
    ImuState end = start;
    std::vector<Eigen::Vector3d> gyro, accel;
    for (std::size_t i = 0; i < 5; ++i) {
      gyro.push_back(random_vector(rng, 1.0));
      accel.emplace_back(random_vector(rng, 5.0) - kGravity_W);
      const ErrorTransition step = error_transition(end, gyro[i], accel[i], dt, ImuCalibration{});
      chain(effect.gyro, step, gyro[i] - end.b_g);
      chain(effect.accel, step, accel[i] - end.b_a);
      end = integrate(end, gyro[i], accel[i], dt);
    }
    const auto reached = [&](const Eigen::Matrix3d& by_gyro, const Eigen::Matrix3d& by_accel) {
      ImuState x = start;
      x.gyro_matrix *= by_gyro;
      x.accel_matrix *= by_accel;
      for (std::size_t i = 0; i < gyro.size(); ++i) x = integrate(x, gyro[i], accel[i], dt);
      return x;
    };
    const Eigen::Matrix3d exact = Eigen::Matrix3d::Identity();
    check_jacobian(
        [&](const Eigen::VectorXd& E) -> Eigen::VectorXd {
          return imu_difference(reached(with(E), exact), end).head<9>();
        },
        effect.gyro);
    check_jacobian(
        [&](const Eigen::VectorXd& E) -> Eigen::VectorXd {
          return imu_difference(reached(exact, with(E)), end).segment<6>(err::nu);
        },
        effect.accel);
    leave_out_heading(effect.gyro, end);
    check_jacobian(
        [&](const Eigen::VectorXd& E) -> Eigen::VectorXd {
          ImuState x = reached(with(E), exact);
          const double turn = imu_difference(x, end)(err::theta + 2);
          x.R_WB = exp_so3({0.0, 0.0, -turn}) * x.R_WB;
          return imu_difference(x, end).head<9>();
        },
        effect.gyro);
  }
}

TEST_CASE("propagation: the state that users get needs no matrix where gravity is all that is felt") {
  std::mt19937_64 rng{16};
  const ImuState x = random_state(rng, 0).imu;
  const Eigen::Vector3d rest_B = -(x.R_WB.transpose() * kGravity_W);
  const Eigen::Vector3d accel_B = x.b_a + x.accel_matrix.inverse() * rest_B;
  REQUIRE((accel_B - x.b_a - rest_B).norm() > 0.01);
  CHECK((accel_B - nav_state(x).b_a - rest_B).norm() < 1e-12);
}

TEST_CASE("propagation: Q is the covariance of many noisy integrations") {
  std::mt19937_64 rng{12};
  std::normal_distribution<double> normal;
  ImuCalibration noise;
  noise.gyro_noise = 0.01;
  noise.accel_noise = 0.1;
  noise.gyro_random_walk = 0.01;
  noise.accel_random_walk = 0.1;
  const ImuState start = random_state(rng, 0).imu;
  const double dt = 0.01;
  constexpr int kSteps = 20;
  std::vector<Eigen::Vector3d> gyro, accel;
  for (int i = 0; i < kSteps; ++i) {
    gyro.push_back(random_vector(rng, 1.0));
    accel.emplace_back(random_vector(rng, 3.0) - kGravity_W);
  }
  ErrorTransition total;
  ImuState mean = start;
  for (int i = 0; i < kSteps; ++i) {
    const auto s = static_cast<std::size_t>(i);
    chain(filter_kernels(), total, error_transition(mean, gyro[s], accel[s], dt, noise));
    mean = integrate(mean, gyro[s], accel[s], dt);
  }
  constexpr int kRuns = 4000;
  ImuErrorMatrix sampled = ImuErrorMatrix::Zero();
  for (int run = 0; run < kRuns; ++run) {
    // The truth follows the true rates; its sensors add white noise to their means over dt, and its biases walk.
    ImuState truth = start;
    for (int i = 0; i < kSteps; ++i) {
      const auto s = static_cast<std::size_t>(i);
      const Eigen::Vector3d n_g = random_vector(rng, noise.gyro_noise / std::sqrt(dt));
      const Eigen::Vector3d n_a = random_vector(rng, noise.accel_noise / std::sqrt(dt));
      truth = integrate(truth, gyro[s] - n_g, accel[s] - n_a, dt);
      truth.b_g += random_vector(rng, noise.gyro_random_walk * std::sqrt(dt));
      truth.b_a += random_vector(rng, noise.accel_random_walk * std::sqrt(dt));
    }
    const Eigen::VectorXd e = imu_difference(truth, mean);
    sampled += e * e.transpose() / kRuns;
  }
  // Whitened by Q the sample covariance is the identity, each entry to within its own sampling error of 1 / sqrt(runs).
  const Eigen::LLT<ImuErrorMatrix> llt(total.Q);
  REQUIRE(llt.info() == Eigen::Success);
  const ImuErrorMatrix half = llt.matrixL().solve(sampled);
  const ImuErrorMatrix white = llt.matrixL().solve(half.transpose());
  CHECK((white - ImuErrorMatrix::Identity()).cwiseAbs().maxCoeff() < 5.0 * std::sqrt(2.0 / kRuns));
}

TEST_CASE("propagation: yaw and position stay unobservable whatever the state") {
  // A common turn about gravity and a common shift go through unchanged: Phi keeps them where they are.
  std::mt19937_64 rng{13};
  const State x = random_state(rng, 0);
  const ErrorTransition step =
      error_transition(x.imu, random_vector(rng, 1.0), random_vector(rng, 9.0), 0.01, ImuCalibration{});
  const Eigen::MatrixXd N = unobservable(x).topRows<err::imu_size>();
  CHECK((step.Phi * N - N).norm() < 1e-12);
}

TEST_CASE(
    "propagation: a velocity taken back is less certain by gravity over the delay, as far as the state is tilted") {
  std::mt19937_64 rng{23};
  const double tilt = 0.01, delay = 0.4;
  ImuBuffer samples(300);
  for (int i = 0; i <= 200; ++i) {  // it stands
    ImuSample sample;
    sample.t_ns = TimeNs{5'000'000} * i;
    sample.accel_B = -kGravity_W;
    samples.push(sample, {});
  }
  double squares = 0.0;
  const int draws = 2000;
  for (int k = 0; k < draws; ++k) {
    ImuState x;
    x.t_ns = 1'000'000'000;
    std::normal_distribution<double> draw(0.0, tilt);
    x.R_WB = exp_so3({draw(rng), draw(rng), 0.0});
    squares += motion_at(x.t_ns - 400'000'000, x, samples).v_W.head<2>().squaredNorm() / 2.0;
  }
  CHECK(taken_back_sigma(tilt, delay) == about(std::sqrt(squares / draws), 0.05));
  CHECK(taken_back_sigma(tilt, -delay) == 0.0);
}
