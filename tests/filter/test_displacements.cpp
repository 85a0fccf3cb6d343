#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "filter/ekf/imu_displacement.h"
#include "filter/ekf/propagation.h"
#include "filter/sources/wheels/wheels.h"
#include "tests/support/about.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr TimeNs kStart = 1'000'000'000;
constexpr TimeNs kEnd = kStart + 200'000'000;
constexpr double kMeanOfSamples = 0.03;  // of H: the error goes on by the mean of the samples

/// A vehicle that turns and, if `shakes`, shakes; 200 samples a second.
ImuBuffer random_samples(std::mt19937_64& rng, const State& x, double accel_noise = 0.0, double shakes = 1.0) {
  std::mt19937_64 motion{5};
  ImuBuffer buffer(256);
  for (TimeNs t_ns = kStart - 50'000'000; t_ns <= kEnd + 50'000'000; t_ns += 5'000'000) {
    ImuSample sample;
    sample.t_ns = t_ns;
    sample.gyro_B = Eigen::Vector3d(0.2, -0.3, 1.0) + shakes * random_vector(motion, 0.1) + x.imu.b_g;
    sample.accel_B =
        Eigen::Vector3d(1.0, 0.5, 9.8) + shakes * random_vector(motion, 0.5) + random_vector(rng, accel_noise);
    buffer.push(sample);
  }
  return buffer;
}

State random_start(std::mt19937_64& rng) {
  State x = random_state(rng, 0);
  x.imu.t_ns = kStart;
  x.imu.R_WB = exp_so3(random_vector(rng, 0.1));
  return x;
}

Ring<WheelIncrement> random_turns(std::mt19937_64& rng) {
  Ring<WheelIncrement> turns(64);
  for (TimeNs t_ns = kStart - 3'000'000; t_ns < kEnd - 4'000'000; t_ns += 10'000'000) {
    const Eigen::Vector3d rate = Eigen::Vector3d::Constant(12.0) + random_vector(rng, 1.0);
    turns.push({t_ns, t_ns + 10'000'000, 0.01 * rate.head<2>()});
  }
  return turns;
}

/// Wheels and gyroscope without noise.
Calibration exact_wheels() {
  Calibration calibration;
  calibration.encoder.emplace().noise_counts = 0.0;
  calibration.imu.gyro_noise = 1e-9;
  return calibration;
}

/// p^o of a state whose error has the covariance `P`, by wheels without slip; along a plane that is known, or without
/// lasers.
Displacement by_wheels(const State& x, const Covariance& P, const WheelIncrements& turns, const ImuBuffer& samples,
                       TimeNs to_ns, bool on_plane) {
  OdometerConfig config;
  config.speed_sigma = config.slip = config.side_slip = config.side_slip_turn = config.roughness = 0.0;
  config.body_yaw = config.body_pitch = 0.0;
  const Calibration calibration = exact_wheels();
  Ekf ekf(FilterConfig{}, calibration);
  ekf.assume(x, P.matrix());
  return Wheels(config, calibration, on_plane).displacement(ekf, turns, samples, to_ns, true);
}

/// Draws errors of standard deviation `sigma` into a state; mean of what f says of the result, over its covariance.
template <typename Function>
double mean_chi_squared(std::mt19937_64& rng, const State& x, const Eigen::VectorXd& sigma,
                        const Displacement& expected, const Function& f) {
  constexpr int kRuns = 2000;
  const Eigen::LLT<Eigen::Matrix3d> llt(expected.covariance);
  std::normal_distribution<double> normal;
  double sum = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
    for (Eigen::Index i = 0; i < sigma.size(); ++i) d(i) = sigma(i) * normal(rng);
    const Eigen::Vector3d e = f(with_error(x, d)).p_BiBj - expected.p_BiBj;
    sum += e.dot(llt.solve(e)) / kRuns;
  }
  return sum;
}

}  // namespace

TEST_CASE("displacements: the IMU's is where propagation takes the body, and H its derivative") {
  std::mt19937_64 rng{71};
  for (int trial = 0; trial < 10; ++trial) {
    CAPTURE(trial);
    const State x = random_start(rng);
    const ImuBuffer samples = random_samples(rng, x);
    ImuState end = x.imu;
    samples.for_each_piece(kStart, kEnd, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
      end = integrate(end, gyro_B, accel_B, dt);
    });
    const ImuMotion motion = imu_motion(x.imu, samples, kEnd, ImuCalibration{});
    CHECK((motion.T_BiBj.p - x.imu.R_WB.transpose() * (end.p_WB - x.imu.p_WB)).norm() < 1e-9);
    CHECK((motion.T_BiBj.R - x.imu.R_WB.transpose() * end.R_WB).norm() < 1e-9);
    CHECK(motion.duration == doctest::Approx(0.2));
    const ImuBuffer steady = random_samples(rng, x, 0.0, 0.0);
    const auto moved = [&](const ImuBuffer& measured, const Eigen::VectorXd& d) -> Eigen::VectorXd {
      Eigen::VectorXd error = Eigen::VectorXd::Zero(x.error_size());
      error.head<err::imu_size>() = d;
      return imu_motion(with_error(x, error).imu, measured, kEnd, ImuCalibration{}).T_BiBj.p;
    };
    check_jacobian([&](const Eigen::VectorXd& d) { return moved(steady, d); },
                   imu_motion(x.imu, steady, kEnd, ImuCalibration{}).H, 1e-3);
    const Eigen::VectorXd error = 0.01 * Eigen::VectorXd::Ones(err::imu_size);
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(err::imu_size);
    const Eigen::VectorXd change = moved(samples, error) - moved(samples, none);
    CHECK((change - motion.H * error).norm() < kMeanOfSamples * change.norm());
  }
}

TEST_CASE("displacements: the IMU's noise spreads it as its covariance says") {
  std::mt19937_64 rng{72};
  const State x = random_start(rng);
  ImuCalibration noise;
  noise.gyro_noise = 1e-9;
  const double sample_noise = noise.accel_noise * std::sqrt(200.0);
  const ImuMotion clean = imu_motion(x.imu, random_samples(rng, x), kEnd, noise);
  double squares = 0.0;
  constexpr int kRuns = 1000;
  for (int run = 0; run < kRuns; ++run) {
    const ImuBuffer samples = random_samples(rng, x, sample_noise);
    squares += (imu_motion(x.imu, samples, kEnd, noise).T_BiBj.p - clean.T_BiBj.p).squaredNorm() / kRuns;
  }
  CHECK(squares == about(clean.covariance.trace(), 0.1));
}

TEST_CASE("displacements: a strike among the samples makes the IMU's uncertain") {
  std::mt19937_64 rng{73};
  const State x = random_start(rng);
  ImuBuffer samples = random_samples(rng, x);
  const double before = imu_motion(x.imu, samples, kEnd, ImuCalibration{}).covariance.trace();
  ImuBuffer struck(256);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ImuSample& sample = samples[i];
    const bool strike = sample.t_ns > kStart + 50'000'000 && sample.t_ns < kStart + 70'000'000;
    struck.push(sample, {1.0, strike ? 50.0 : 1.0});
  }
  CHECK(imu_motion(x.imu, struck, kEnd, ImuCalibration{}).covariance.trace() > 10.0 * before);
}

TEST_CASE("displacements: the covariance of the IMU's follows from the state's (2000 draws)") {
  std::mt19937_64 rng{74};
  const State x = random_start(rng);
  const ImuBuffer samples = random_samples(rng, x);
  ImuCalibration none;
  none.accel_noise = 1e-9;
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<3>(err::theta).setConstant(0.01);
  sigma.segment<3>(err::nu).setConstant(0.005);
  sigma.segment<3>(err::rho).setConstant(1.0);
  sigma.segment<3>(err::b_g).setConstant(0.01);
  sigma.segment<3>(err::b_a).setConstant(0.1);
  Covariance P(err::clones);
  P.reset(sigma);
  const auto displacement = [&](const State& state) {
    return imu_displacement(imu_motion(state.imu, samples, kEnd, none), P);
  };
  CHECK(mean_chi_squared(rng, x, sigma, displacement(x), displacement) == about(3.0, 0.1));
}

TEST_CASE("displacements: the covariance of the wheels' follows from the state's (2000 draws)") {
  std::mt19937_64 rng{75};
  const State x = random_start(rng);
  const ImuBuffer samples = random_samples(rng, x);
  const Ring<WheelIncrement> turns = random_turns(rng);
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<3>(err::theta).setConstant(0.05);
  sigma.segment<3>(err::b_g).setConstant(0.02);
  sigma.segment<2>(err::normal).setConstant(0.01);
  sigma.segment<2>(err::wheel_radius).setConstant(0.01);
  sigma(err::track_width) = 0.01;
  sigma.segment<3>(err::odometer).setConstant(0.01);
  Covariance P(err::clones);
  P.reset(sigma);
  for (const bool on_plane : {true, false}) {
    CAPTURE(on_plane);
    const auto displacement = [&](const State& state) {
      return by_wheels(state, P, WheelIncrements({}, turns), samples, kEnd, on_plane);
    };
    REQUIRE(displacement(x).available);
    CHECK(mean_chi_squared(rng, x, sigma, displacement(x), displacement) == about(3.0, 0.1));
  }
}

TEST_CASE("displacements: the wheels' is that of the body, and needs readings all the way") {
  std::mt19937_64 rng{76};
  State x = random_start(rng);
  x.imu.R_WB.setIdentity();
  x.imu.b_g.setZero();
  x.imu.gyro_matrix.setIdentity();
  x.imu.accel_matrix.setIdentity();
  x.ground.n_W = Eigen::Vector3d::UnitZ();
  x.odometer.wheel_radius.setConstant(0.08);
  x.odometer.T_BO = {Eigen::Matrix3d::Identity(), {0.1, 0.0, -0.05}};
  Covariance P(err::clones);
  P.reset(Eigen::VectorXd::Constant(err::clones, 1e-3));
  // On the spot, turning left at 1 rad/s: the axle's middle stands, the body goes round it.
  ImuBuffer samples(64);
  for (TimeNs t_ns = kStart; t_ns <= kEnd; t_ns += 5'000'000) samples.push({t_ns, {0, 0, 1.0}, {0, 0, 9.81}});
  Ring<WheelIncrement> turns(64);
  for (TimeNs t_ns = kStart + 6'000'000; t_ns < kEnd; t_ns += 10'000'000) {
    turns.push({t_ns, t_ns + 10'000'000, {-0.02, 0.02}});
  }
  const std::optional<WheelIncrement> passed = WheelIncrement{kStart - 4'000'000, kStart + 6'000'000, {-0.02, 0.02}};
  const auto displacement = [&](TimeNs until_ns) {
    return by_wheels(x, P, WheelIncrements(passed, turns), samples, until_ns, true);
  };
  const Eigen::Vector3d p_BO = x.odometer.T_BO.p;
  const Displacement turned = displacement(kStart + 50'000'000);  // as from frame to frame
  REQUIRE(turned.available);
  CHECK((turned.p_BiBj - (p_BO - exp_so3({0, 0, 0.05}) * p_BO)).norm() < 1e-6);
  CHECK(displacement(kEnd).available);
  CHECK_FALSE(displacement(kEnd + 150'000'000).available);  // no readings at the end
  CHECK_FALSE(displacement(kStart).available);
}
