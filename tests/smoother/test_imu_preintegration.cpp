#include "tests/smoother/support.h"

#include "smoother/imu_preintegration.h"

#include <Eigen/Cholesky>
#include <vector>

#include "filter/ekf/propagation.h"
#include "smoother/imu_factor.h"

using namespace ear;
using namespace ear::smoother;
using namespace ear::smoother::test;
using ear::test::random_vector;

namespace {

struct Piece {
  Eigen::Vector3d gyro_B, accel_B;
  double dt = 0.0;
};

std::vector<Piece> random_pieces(std::mt19937_64& rng, int count) {
  std::uniform_real_distribution<double> time(0.003, 0.007);
  std::vector<Piece> pieces;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d gyro = random_vector(rng, 0.8);
    const Eigen::Vector3d accel = random_vector(rng, 2.0) + Eigen::Vector3d(0.0, 0.0, 9.81);
    pieces.push_back({gyro, accel, time(rng)});
  }
  return pieces;
}

ImuPreintegration preintegrate(const std::vector<Piece>& pieces, const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a,
                               const ImuCalibration& noise = {}) {
  ImuPreintegration result(b_g, b_a);
  for (const Piece& piece : pieces) result.add(piece.gyro_B, piece.accel_B, piece.dt, noise);
  return result;
}

ImuState random_start(std::mt19937_64& rng) {
  ImuState x = ear::test::random_state(rng, 0).imu;
  return x;
}

ImuState propagated(ImuState x, const std::vector<Piece>& pieces) {
  for (const Piece& piece : pieces) x = integrate(x, piece.gyro_B, piece.accel_B, piece.dt);
  return x;
}

Eigen::VectorXd motion(const ImuState& x) {
  Eigen::VectorXd values(9);
  values << x.v_W, x.b_g, x.b_a;
  return values;
}

std::vector<Eigen::VectorXd> values_of(const ImuState& i, const ImuState& j) {
  return {block({i.R_WB, i.p_WB}), motion(i), block({j.R_WB, j.p_WB}), motion(j)};
}

/// (xi, dv, dp) of `truth` less `estimate`.
Eigen::Matrix<double, 9, 1> difference(const ImuPreintegration& truth, const ImuPreintegration& estimate) {
  Eigen::Matrix<double, 9, 1> d;
  d << log_so3(truth.R_BiBj() * estimate.R_BiBj().transpose()), truth.dv_Bi() - estimate.dv_Bi(),
      truth.dp_Bi() - estimate.dp_Bi();
  return d;
}

}  // namespace

TEST_CASE("imu_preintegration: by hand: a constant push forward, and a turn to the left") {
  ImuPreintegration push(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  for (int i = 0; i < 10; ++i) push.add(Eigen::Vector3d::Zero(), {2.0, 0.0, 0.0}, 0.1, {});
  CHECK(push.dv_Bi().isApprox(Eigen::Vector3d(2.0, 0.0, 0.0), 1e-12));
  CHECK(push.dp_Bi().isApprox(Eigen::Vector3d(1.0, 0.0, 0.0), 1e-12));
  ImuPreintegration turn(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  for (int i = 0; i < 10; ++i) turn.add({0.0, 0.0, 0.05 * M_PI}, Eigen::Vector3d::Zero(), 1.0, {});
  const Eigen::Vector3d ahead_Bi = turn.R_BiBj() * Eigen::Vector3d::UnitX();
  CHECK((ahead_Bi - Eigen::Vector3d::UnitY()).norm() < 1e-9);  // what is ahead now was to the left
}

TEST_CASE("imu_preintegration: the factor is zero where the state was integrated, and only there") {
  std::mt19937_64 rng{1};
  ImuState i = random_start(rng);
  i.gyro_matrix.setIdentity();
  i.accel_matrix.setIdentity();  // the smoother estimates none
  const std::vector<Piece> pieces = random_pieces(rng, 40);
  const ImuState j = propagated(i, pieces);
  const ImuFactor factor(preintegrate(pieces, i.b_g, i.b_a));
  CHECK(residual(factor, values_of(i, j)).norm() < 1e-6);
  ImuState off = j;
  off.p_WB.x() += 0.01;
  CHECK(residual(factor, values_of(i, off)).norm() > 1.0);
}

TEST_CASE("imu_preintegration: derivatives by the biases") {
  std::mt19937_64 rng{2};
  const std::vector<Piece> pieces = random_pieces(rng, 40);
  const Eigen::Vector3d b_g = random_vector(rng, 0.02), b_a = random_vector(rng, 0.1);
  const ImuPreintegration nominal = preintegrate(pieces, b_g, b_a);
  ear::test::check_jacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
        return difference(preintegrate(pieces, b_g + d.head<3>(), b_a + d.tail<3>()), nominal);
      },
      nominal.J_bias());
}

TEST_CASE("imu_preintegration: the factor's derivatives, also away from its minimum and from its biases") {
  std::mt19937_64 rng{3};
  for (int trial = 0; trial < 10; ++trial) {
    CAPTURE(trial);
    ImuState i = random_start(rng);
    const std::vector<Piece> pieces = random_pieces(rng, 20);
    ImuState j = propagated(i, pieces);
    const ImuFactor factor(preintegrate(pieces, i.b_g, i.b_a));
    i.b_g += random_vector(rng, 0.01);
    i.b_a += random_vector(rng, 0.1);
    j.R_WB = exp_so3(random_vector(rng, 0.05)) * j.R_WB;
    j.p_WB += random_vector(rng, 0.1);
    check_factor(factor, values_of(i, j));
  }
}

TEST_CASE("imu_preintegration: two in a row are one over both") {
  std::mt19937_64 rng{4};
  const std::vector<Piece> pieces = random_pieces(rng, 40);
  const Eigen::Vector3d b_g = random_vector(rng, 0.02), b_a = random_vector(rng, 0.1);
  const ImuPreintegration whole = preintegrate(pieces, b_g, b_a);
  ImuPreintegration joined = preintegrate({pieces.begin(), pieces.begin() + 15}, b_g, b_a);
  joined.append(preintegrate({pieces.begin() + 15, pieces.end()}, b_g, b_a));
  CHECK(joined.duration() == doctest::Approx(whole.duration()));
  CHECK(difference(joined, whole).norm() < 1e-12);
  CHECK(joined.J_bias().isApprox(whole.J_bias(), 1e-10));
  CHECK(joined.covariance().isApprox(whole.covariance(), 1e-10));

  // The second with other biases: of second order.
  ImuPreintegration other = preintegrate({pieces.begin(), pieces.begin() + 15}, b_g, b_a);
  other.append(preintegrate({pieces.begin() + 15, pieces.end()}, b_g + random_vector(rng, 1e-4),
                            b_a + random_vector(rng, 1e-3)));
  CHECK(difference(other, whole).norm() < 1e-7);
}

TEST_CASE("imu_preintegration: the covariance is that of noisy samples (Monte-Carlo, 2000 draws)") {
  std::mt19937_64 rng{5};
  ImuCalibration noise;
  noise.gyro_noise = 2e-3;
  noise.accel_noise = 3e-2;
  noise.gyro_random_walk = 4e-3;
  noise.accel_random_walk = 5e-2;
  const std::vector<Piece> pieces = random_pieces(rng, 60);
  const ImuPreintegration nominal = preintegrate(pieces, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), noise);
  const Eigen::LLT<Eigen::Matrix<double, imu_error::size, imu_error::size>> llt(nominal.covariance());
  constexpr int kRuns = 2000;
  Eigen::Matrix<double, imu_error::size, imu_error::size> whitened =
      Eigen::Matrix<double, imu_error::size, imu_error::size>::Zero();
  for (int run = 0; run < kRuns; ++run) {
    Eigen::Vector3d b_g = Eigen::Vector3d::Zero(), b_a = Eigen::Vector3d::Zero();
    std::vector<Piece> truth = pieces;  // measured = truth + bias + noise
    for (Piece& piece : truth) {
      const double root = std::sqrt(piece.dt);
      piece.gyro_B -= b_g + random_vector(rng, noise.gyro_noise / root);
      piece.accel_B -= b_a + random_vector(rng, noise.accel_noise / root);
      b_g += random_vector(rng, noise.gyro_random_walk * root);
      b_a += random_vector(rng, noise.accel_random_walk * root);
    }
    const ImuPreintegration drawn = preintegrate(truth, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    Eigen::Matrix<double, imu_error::size, 1> e;
    e << difference(drawn, nominal), b_g, b_a;
    const Eigen::Matrix<double, imu_error::size, 1> w = llt.matrixL().solve(e);
    whitened += w * w.transpose() / kRuns;
  }
  // Entries of a sample covariance of unit normals: sigma 1 / sqrt(n), on the diagonal sqrt(2 / n).
  CHECK((whitened - Eigen::Matrix<double, imu_error::size, imu_error::size>::Identity()).cwiseAbs().maxCoeff() <
        4.5 * std::sqrt(2.0 / kRuns));
}
