// The small filter: what it does to state and covariance, and the gate.
#include "filter/ekf/ekf.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "filter/ekf/propagation.h"
#include "tests/support/about.h"
#include "tests/support/state_error.h"

using namespace ear;
using ear::test::about;

namespace {

constexpr TimeNs kStart = 1'000'000'000;
constexpr TimeNs kPeriod = 5'000'000;

Calibration vehicle() {
  Calibration calibration;
  calibration.cameras.resize(2);
  calibration.encoder.emplace();
  return calibration;
}

/// At 1 m/s, standard deviations of 0.1 of everything.
Ekf started() {
  Ekf ekf(FilterConfig{}, vehicle());
  ImuState x;
  x.t_ns = kStart;
  x.v_W = {1.0, 0.0, 0.0};
  x.p_WB = {3.0, 2.0, 1.0};
  ekf.start(x, Eigen::VectorXd::Constant(err::clones, 0.1));
  return ekf;
}

/// A second of samples at rest against gravity, turning left at 0.5 rad/s.
ImuBuffer samples() {
  ImuBuffer imu(512);
  for (TimeNs t_ns = kStart; t_ns <= kStart + 1'000'000'000; t_ns += kPeriod) {
    imu.push({t_ns, {0.0, 0.0, 0.5}, {0.0, 0.0, 9.81}});
  }
  return imu;
}

/// A row that measures the velocity along x.
GroundRows velocity_row(double residual, double sigma) {
  GroundRows z;
  z.H(0, ground_column(err::nu)) = 1.0;
  z.residual(0) = residual;
  z.sigma(0) = sigma;
  z.count = 1;
  return z;
}

/// One row, if the gate takes it: whether it does.
bool apply_if_it_fits(Ekf& ekf, GroundRows& z, double weight) {
  if (!gate_test(ekf, z.H.row(0), z.residual(0), z.sigma(0)).fits) return false;
  ekf.apply(z, weight, CameraUpdate::learned);
  return true;
}

}  // namespace

TEST_CASE("ekf: a fresh one has no state, and reset() is back there") {
  Ekf ekf(FilterConfig{}, vehicle());
  CHECK_FALSE(ekf.running());
  CHECK_FALSE(time_of(ekf));
  ekf = started();
  ekf.clone(1.0);
  CHECK(time_of(ekf) == kStart);
  ekf.reset();
  CHECK_FALSE(ekf.running());
  CHECK(ekf.state().clones.empty());
  CHECK(ekf.state().imu.v_W.isZero());
}

TEST_CASE("ekf: propagation goes to the time asked for, and not back") {
  Ekf ekf = started();
  const ImuBuffer imu = samples();
  CHECK_FALSE(ekf.propagate(imu, kStart + 400'000'000, {}, 0.0));
  CHECK(ekf.state().imu.t_ns == kStart + 400'000'000);
  CHECK((ekf.state().imu.p_WB - Eigen::Vector3d(3.4, 2.0, 1.0)).norm() < 1e-9);
  const State before = ekf.state();
  CHECK_FALSE(ekf.propagate(imu, kStart, {}, 0.0));
  CHECK(ekf.state().imu.t_ns == before.imu.t_ns);
}

TEST_CASE("ekf: a factor of two makes the accelerometer's noise twice as large") {
  const auto grown = [](double factor) {
    Ekf ekf = started();
    ekf.propagate(samples(), kStart + 1'000'000'000, {1.0, factor}, 0.0);
    return ekf.covariance().matrix()(err::nu, err::nu);
  };
  const double noise = Calibration{}.imu.accel_noise;
  CHECK(grown(2.0) - grown(1.0) == about(3.0 * noise * noise, 0.01));  // 4 - 1, over one second
}

TEST_CASE("ekf: a clipped sample is reported with the time from which on the state is uncertain") {
  ImuBuffer imu(64);
  for (TimeNs t_ns = kStart; t_ns <= kStart + 100'000'000; t_ns += kPeriod) {
    const bool clipped = t_ns == kStart + 50'000'000;
    imu.push({t_ns, {0.0, 0.0, 8.7}, {0.0, 0.0, 9.81}}, {clipped ? 1e4 : 1.0, 1.0});
  }
  Ekf ekf = started();
  const std::optional<TimeNs> uncertain_ns = ekf.propagate(imu, kStart + 100'000'000, {}, 0.0);
  REQUIRE(uncertain_ns);
  CHECK(*uncertain_ns == kStart + 45'000'000);  // the piece that ends with it
}

TEST_CASE("ekf: the gate takes what the state and the noise allow, and nothing else changes the state") {
  const double sigma = 0.05;
  const double expected = std::sqrt(0.1 * 0.1 + sigma * sigma);
  const double limit = std::sqrt(Gate(FilterConfig{}.gate_probability, 1).quantile(1)) * expected;
  for (const double share : {-0.99, 0.99, 1.01, -1.01}) {
    CAPTURE(share);
    Ekf ekf = started();
    GroundRows z = velocity_row(share * limit, sigma);
    const bool used = apply_if_it_fits(ekf, z, 1.0);
    CHECK(used == (std::abs(share) < 1.0));
    CHECK((ekf.state().imu.v_W.x() != 1.0) == used);
    CHECK((ekf.covariance().matrix()(err::nu, err::nu) < 0.009) == used);
  }
}

TEST_CASE("ekf: what is no number never passes") {
  Ekf ekf = started();
  GroundRows z = velocity_row(std::nan(""), 0.05);
  CHECK_FALSE(apply_if_it_fits(ekf, z, 1.0));
  CHECK(ekf.possible());
}

TEST_CASE("ekf: no vehicle is farther from its start than the fastest one gets") {
  Ekf ekf = started();
  const State x = ekf.state();
  const Eigen::MatrixXd P = ekf.covariance().matrix();
  const auto possible = [&](double distance, double sigma, double later) {
    State there = x;
    there.imu.p_WB.x() += distance;
    there.imu.t_ns += static_cast<TimeNs>(1e9 * later);
    Eigen::MatrixXd vague = P;
    vague(err::rho + 1, err::rho + 1) = sigma * sigma;
    ekf.assume(there, vague);
    return ekf.possible();
  };
  CHECK(possible(0.0, 0.1, 0.0));
  CHECK(possible(190.0, 190.0, 0.0));  // what stamps and updates may be off by at the start
  CHECK_FALSE(possible(210.0, 0.1, 0.0));
  CHECK_FALSE(possible(0.0, 210.0, 0.0));
  CHECK(possible(900.0, 900.0, 8.0));
  CHECK_FALSE(possible(1100.0, 0.1, 8.0));
}

TEST_CASE("ekf: a weight divides the noise of a row: R / w^2") {
  Ekf weighted = started(), noisy = started();
  GroundRows z = velocity_row(0.1, 0.05);
  CHECK(apply_if_it_fits(weighted, z, 0.5));
  z = velocity_row(0.1, 0.1);
  CHECK(apply_if_it_fits(noisy, z, 1.0));
  CHECK(weighted.state().imu.v_W.isApprox(noisy.state().imu.v_W, 1e-12));
  CHECK(weighted.covariance().matrix().isApprox(noisy.covariance().matrix(), 1e-12));
}

TEST_CASE("ekf: the cameras' calibration is learned or considered") {
  for (const CameraUpdate update : {CameraUpdate::learned, CameraUpdate::considered}) {
    CAPTURE(static_cast<int>(update));
    Ekf ekf = started();
    const double before = ekf.covariance().matrix()(err::camera, err::camera);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, err::clones);
    H(0, err::nu) = 10.0;
    H(0, err::camera) = 10.0;
    ekf.apply(H, 0, Eigen::VectorXd::Constant(1, 1.0), update);
    const bool learned = update == CameraUpdate::learned;
    CHECK(ekf.state().camera.T_BC0.R.isIdentity(0.0) != learned);
    CHECK((ekf.covariance().matrix()(err::camera, err::camera) < before) == learned);
    CHECK(ekf.state().imu.v_W.x() != 1.0);
  }
}

TEST_CASE("ekf: what may be noise shows nothing of the time offset and the gyroscope") {
  struct Case {
    double rate;   // in noise over a second
    double speed;  // [m/s], with a standard deviation of 0.1
    bool gyro, time_offset;
  };
  for (const Case& c : {Case{20.0, 1.0, false, false}, {20.0, 8.0, false, true}, {200.0, 1.0, true, true}}) {
    CAPTURE(c.rate);
    CAPTURE(c.speed);
    ImuBuffer imu(512);
    for (TimeNs t_ns = kStart; t_ns <= kStart + 1'000'000'000; t_ns += kPeriod) {
      imu.push({t_ns, {0.0, 0.0, c.rate * vehicle().imu.gyro_noise}, {0.0, 0.0, 9.81}});
    }
    Ekf ekf(FilterConfig{}, vehicle());
    ImuState x;
    x.t_ns = kStart;
    x.v_W = {c.speed, 0.0, 0.0};
    Eigen::VectorXd sigma = Eigen::VectorXd::Constant(err::clones, 0.1);
    sigma.segment<3>(err::theta).setConstant(1e-3);
    sigma.segment<6>(err::b_g).setConstant(1e-3);
    sigma.segment<9>(err::accel_matrix).setConstant(1e-3);
    ekf.start(x, sigma);
    ekf.propagate(imu, kStart + 1'000'000'000, {}, 0.0);
    const State before = ekf.state();
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, err::clones);
    H(0, err::theta + 2) = H(0, err::time_offset) = H(0, err::camera) = 10.0;
    ekf.apply(H, 0, Eigen::VectorXd::Constant(1, 1.0), CameraUpdate::learned);
    CHECK((ekf.state().imu.gyro_matrix != before.imu.gyro_matrix) == c.gyro);
    CHECK((ekf.state().camera.time_offset != before.camera.time_offset) == c.time_offset);
    CHECK(ekf.state().camera.T_BC0.R != before.camera.T_BC0.R);
  }
}

// With the samples as they are it learned 2.3 standard deviations of the prior: it explained their noise.
TEST_CASE("ekf: a vehicle that stands learns nothing of the accelerometer's matrix from noise") {
  std::mt19937_64 rng{8};
  std::normal_distribution<double> normal;
  FilterConfig config;
  Ekf ekf(config, vehicle());
  ImuState x;
  x.t_ns = kStart;
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<9>(err::theta).setConstant(1e-3);
  sigma.segment<3>(err::b_a).setConstant(config.prior.accel_bias);
  sigma.segment<9>(err::accel_matrix).setConstant(config.prior.accel_scale);
  ekf.start(x, sigma);
  const double noise = vehicle().imu.accel_noise / std::sqrt(1e-9 * static_cast<double>(kPeriod));  // of a sample
  ImuBuffer imu(16);
  for (TimeNs t_ns = kStart; t_ns < kStart + 60'000'000'000; t_ns += kPeriod) {
    const Eigen::Vector3d n = noise * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
    imu.push({t_ns, Eigen::Vector3d::Zero(), n - kGravity_W});
    ekf.propagate(imu, t_ns, {}, 0.0);
    const Eigen::Vector3d residual = -ekf.state().imu.v_W / config.standstill.velocity_sigma;
    const Eigen::Matrix3d H = Eigen::Matrix3d::Identity() / config.standstill.velocity_sigma;
    ekf.apply(H, err::nu, residual, CameraUpdate::considered);
  }
  const Eigen::Matrix3d E = ekf.state().imu.accel_matrix - Eigen::Matrix3d::Identity();
  CHECK(E.cwiseAbs().maxCoeff() < 0.5 * config.prior.accel_scale);
}

TEST_CASE("ekf: a clone is the body's pose now, and can be marginalised") {
  Ekf ekf = started();
  ekf.clone(1.5);
  ekf.propagate(samples(), kStart + 100'000'000, {}, 0.0);
  ekf.clone(1.0);
  REQUIRE(ekf.state().clones.size() == 2);
  CHECK(ekf.covariance().size() == err::clone(2));
  CHECK(ekf.state().clones[0].feature_noise == 1.5);
  CHECK(ekf.state().clones[0].T_WB.p == Eigen::Vector3d(3.0, 2.0, 1.0));
  CHECK(ekf.state().clones[0].frame != ekf.state().clones[1].frame);
  const Eigen::Matrix<double, 6, 6> newest = ekf.covariance().matrix().bottomRightCorner<6, 6>();
  ekf.marginalise(0);
  REQUIRE(ekf.state().clones.size() == 1);
  CHECK(ekf.covariance().matrix().bottomRightCorner<6, 6>() == newest);
}

TEST_CASE("ekf: inflated motion is about the body, inflated biases are each sensor's own") {
  Ekf ekf = started();
  const Eigen::MatrixXd before = ekf.covariance().matrix();
  ekf.inflate_motion(0.2, 0.3, 0.4);
  const ImuErrorMatrix ordinary = ekf.ordinary_covariance({});
  Ekf other = started();
  const ImuErrorMatrix without = other.ordinary_covariance({});
  const auto grown = (ordinary - without).diagonal();
  CHECK(grown.segment<3>(estimate_error::rotation).isApprox(Eigen::Vector3d::Constant(0.04), 1e-9));
  CHECK(grown.segment<3>(estimate_error::velocity).isApprox(Eigen::Vector3d::Constant(0.09), 1e-9));
  CHECK(grown.segment<3>(estimate_error::position).isApprox(Eigen::Vector3d::Constant(0.16), 1e-9));
  ekf.inflate(err::b_g, bias_sigma(0.0, 0.5));
  const Eigen::MatrixXd after = ekf.covariance().matrix();
  CHECK(after(err::b_g, err::b_g) == before(err::b_g, err::b_g));
  CHECK(after(err::b_a, err::b_a) == doctest::Approx(before(err::b_a, err::b_a) + 0.25));
}

TEST_CASE("ekf: a clock that may be further off is as if less had been known of it when the clones were made") {
  const auto with_clones = [](double time_offset) {
    Ekf ekf(FilterConfig{}, vehicle());
    ImuState x;
    x.t_ns = kStart;
    x.v_W = {1.0, 0.0, 0.0};
    x.p_WB = {3.0, 2.0, 1.0};
    Eigen::VectorXd sigma = Eigen::VectorXd::Constant(err::clones, 1e-3);
    sigma(err::time_offset) = time_offset;
    ekf.start(x, sigma);
    const ImuBuffer imu = samples();
    for (int i = 1; i <= 6; ++i) {
      ekf.propagate(imu, kStart + i * 50'000'000, {}, 0.0);
      ekf.clone(1.0);
    }
    return ekf;
  };
  const double known = 0.002, off = 0.05;
  Ekf ekf = with_clones(known);
  const Eigen::MatrixXd before = ekf.covariance().matrix();
  ekf.inflate_clock(off);
  const Eigen::MatrixXd added = ekf.covariance().matrix() - before;
  const Eigen::MatrixXd expected = with_clones(std::hypot(known, off)).covariance().matrix() - before;
  CHECK(expected.norm() > 0.01);
  CHECK((added - expected).norm() < 0.03 * expected.norm());  // a clone's motion is by its neighbours
}

TEST_CASE("ekf: what was held down is one error of velocity, position and the clones since") {
  Ekf ekf = started();
  const ImuBuffer imu = samples();
  for (const double t : {0.2, 0.5, 0.7, 0.8}) {
    ekf.propagate(imu, kStart + static_cast<TimeNs>(std::llround(t * 1e9)), {}, 0.0);
    if (t < 0.8) ekf.clone(1.0);
  }
  const Eigen::MatrixXd before = ekf.covariance().matrix();
  const Eigen::Vector3d v_W(0.1, -0.2, 0.3);
  const Eigen::Vector3d p_W = 0.2 * v_W;  // by a force that is constant for 0.4 s
  ekf.inflate_held(v_W, p_W, 0.4);
  // At 0.2 s nothing held yet; at 0.5 and 0.7 s it had for a quarter of the time, and for three.
  Eigen::VectorXd J = Eigen::VectorXd::Zero(before.rows());
  J.segment<3>(err::nu) = v_W;
  J.segment<3>(err::rho) = p_W;
  J.segment<3>(err::clone(1) + 3) = p_W / 16.0;
  J.segment<3>(err::clone(2) + 3) = p_W * 9.0 / 16.0;
  CHECK((ekf.covariance().matrix() - before - J * J.transpose()).norm() < 1e-9);
}

TEST_CASE("ekf: an unknown time is one error of turn and velocity, and one of the place, along what the state does") {
  Ekf ekf = started();
  const ImuBuffer imu = samples();
  ekf.propagate(imu, kStart + 500'000'000, {}, 0.0);
  const auto motion = [&ekf] { return ekf.covariance().matrix().block<9, 9>(err::theta, err::theta).eval(); };
  const State before = ekf.state();
  const Eigen::MatrixXd P = motion();
  ekf.inflate_time(0.2);
  const Eigen::MatrixXd grown = (motion() - P) / 0.04;
  constexpr double kStep = 1e-4;  // [s]
  ekf.propagate(imu, before.imu.t_ns + 100'000, {}, 0.0);
  const Eigen::VectorXd J = ear::test::boxminus(ekf.state(), before).segment<9>(err::theta) / kStep;
  REQUIRE(J.norm() > 1.0);
  Eigen::Matrix<double, 9, 2> apart = Eigen::Matrix<double, 9, 2>::Zero();
  apart.col(0) = J;
  apart.col(0).tail<3>() -= before.imu.v_W;
  apart.col(1).tail<3>() = before.imu.v_W;
  CHECK((grown - apart * apart.transpose()).norm() < 1e-3 * J.squaredNorm());
}

TEST_CASE("ekf: what a sample has beyond the stated noise comes to the usual noise, which may be more") {
  const auto turned = [](double of_sample, double usual) {
    Ekf ekf = started();
    ImuBuffer imu(512);
    for (TimeNs t_ns = kStart; t_ns <= kStart + 100'000'000; t_ns += kPeriod) {
      imu.push({t_ns, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}}, {of_sample, 1.0});
    }
    const double before = ekf.covariance().matrix()(err::theta, err::theta);
    ekf.propagate(imu, kStart + 100'000'000, {usual, 1.0}, 0.0);
    return ekf.covariance().matrix()(err::theta, err::theta) - before;
  };
  const double stated = turned(1.0, 1.0), usual = turned(1.0, 30.0), sample = turned(40.0, 1.0);
  CHECK(turned(40.0, 30.0) - stated == about(usual - stated + sample - stated, 1e-3));
}

TEST_CASE("ekf: a scale that nothing measures counts from where the state started") {
  Ekf ekf = started();
  const auto grown = [&ekf] {
    return Eigen::VectorXd((ekf.ordinary_covariance({0.1, 0.0}) - ekf.ordinary_covariance({})).diagonal());
  };
  CHECK(grown().segment<3>(estimate_error::position).isZero());
  CHECK(grown().segment<3>(estimate_error::velocity).isApprox(Eigen::Vector3d(0.01, 0.0, 0.0), 1e-9));
  ekf.propagate(samples(), kStart + 500'000'000, {}, 0.0);
  const Eigen::Vector3d way = ekf.state().imu.p_WB - Eigen::Vector3d(3.0, 2.0, 1.0);
  REQUIRE(way.norm() > 0.4);
  CHECK(grown().segment<3>(estimate_error::position).isApprox(0.01 * way.cwiseAbs2(), 1e-9));
}

TEST_CASE("ekf: what updates did to the biases is given once") {
  Ekf ekf = started();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, err::clones);
  H(0, err::b_g + 1) = 10.0;
  ekf.apply(H, 0, Eigen::VectorXd::Constant(1, 1.0), CameraUpdate::learned);
  ekf.apply(H, 0, Eigen::VectorXd::Constant(1, 1.0), CameraUpdate::learned);
  const BiasChanges changes = ekf.take_bias_changes();
  CHECK(changes.correction(1) == doctest::Approx(ekf.state().imu.b_g.y()));
  CHECK(changes.variance_lowered(1) == doctest::Approx(0.01 - ekf.covariance().matrix()(10, 10)));
  CHECK(ekf.take_bias_changes().correction.isZero());
  ekf.inflate_held(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.1);
  CHECK(ekf.take_bias_changes().restarted);
}

TEST_CASE("ekf: at the start both wheels are known apart better than alike") {
  FilterConfig config;
  Ekf ekf(config, vehicle());
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<2>(err::wheel_radius).setConstant(config.prior.wheel_radius);
  ekf.start(ImuState{}, sigma);
  const Eigen::Matrix2d P = ekf.covariance().matrix().block<2, 2>(err::wheel_radius, err::wheel_radius);
  const Eigen::RowVector2d apart(1.0, -1.0), mean(0.5, 0.5);
  CHECK(std::sqrt((apart * P * apart.transpose()).value()) < std::sqrt(2.0) * config.prior.wheel_apart);
  CHECK(std::sqrt((mean * P * mean.transpose()).value()) == about(config.prior.wheel_radius / std::sqrt(2.0), 0.01));
}

TEST_CASE("ekf: at the start the product of baseline and focal length is known, each of them less well") {
  Calibration calibration = vehicle();
  calibration.cameras[1].T_BC.translation().x() = 0.5;
  Ekf ekf(FilterConfig{}, calibration);
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(err::clones, 0.1);
  sigma.segment<3>(err::stereo + 3).setConstant(5e-4);  // [m] of the product, at the stated focal length
  for (int camera = 0; camera < 2; ++camera) sigma(err::lens(camera)) = 2e-3;
  ekf.start(ImuState{}, sigma);
  const auto P = ekf.covariance().matrix();
  Eigen::RowVectorXd baseline = Eigen::RowVectorXd::Zero(P.cols());
  baseline(err::stereo + 3) = 1.0 / 0.5;
  Eigen::RowVectorXd focal = Eigen::RowVectorXd::Zero(P.cols());
  focal(err::lens(0)) = focal(err::lens(1)) = 0.5;
  const auto deviation = [&](const Eigen::RowVectorXd& h) { return std::sqrt((h * P * h.transpose()).value()); };
  CHECK(deviation(baseline + focal) == doctest::Approx(1e-3));
  CHECK(deviation(focal) == doctest::Approx(2e-3 / std::sqrt(2.0)));
  CHECK(deviation(baseline) == doctest::Approx(std::hypot(1e-3, 2e-3 / std::sqrt(2.0))));
  CHECK(P(err::stereo + 4, err::stereo + 4) == doctest::Approx(25e-8));  // across the baseline nothing changes
  CHECK((P - P.transpose()).norm() == 0.0);
}

TEST_CASE("ekf: with the origin moved to the body, errors are those of the positions from there") {
  Ekf ekf = started();
  for (int i = 0; i < 2; ++i) {
    ekf.clone(1.0);
    ekf.propagate(samples(), kStart + 200'000'000 * (i + 1), {1.0, 1.0}, 0.0);
  }
  const State before = ekf.state();
  const Eigen::MatrixXd P = ekf.covariance().matrix();
  ekf.move_origin();
  const auto moved = [](State x) {
    const Eigen::Vector3d p = x.imu.p_WB;
    x.imu.p_WB.setZero();
    for (Clone& clone : x.clones) clone.T_WB.p -= p;
    return x;
  };
  Eigen::MatrixXd J(P.rows(), P.cols());
  constexpr double kStep = 1e-6;
  for (Eigen::Index i = 0; i < P.cols(); ++i) {
    const State truth = test::with_error(before, kStep * Eigen::VectorXd::Unit(P.cols(), i));
    J.col(i) = test::boxminus(moved(truth), moved(before)) / kStep;
  }
  const Eigen::MatrixXd expected = J * P * J.transpose();
  CHECK((ekf.covariance().matrix() - expected).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(ekf.state().imu.p_WB.isZero(0.0));
  CHECK((ekf.state().clones[0].T_WB.p - moved(before).clones[0].T_WB.p).norm() < 1e-12);
}
