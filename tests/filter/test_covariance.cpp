#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <random>

#include "filter/ekf/covariance.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

Eigen::MatrixXd random_matrix(std::mt19937_64& rng, Eigen::Index rows, Eigen::Index columns) {
  std::normal_distribution<double> normal;
  Eigen::MatrixXd m(rows, columns);
  for (auto& value : m.reshaped()) value = normal(rng);
  return m;
}

/// Random where a transition of inertial errors is not the identity.
ErrorTransition random_transition(std::mt19937_64& rng) {
  ErrorTransition transition;
  transition.Phi.block<3, 3>(err::theta, err::b_g) = 0.1 * random_matrix(rng, 3, 3);
  transition.Phi.block<3, 3>(err::nu, err::theta) = 0.1 * random_matrix(rng, 3, 3);
  transition.Phi.block<3, 6>(err::nu, err::b_g) = 0.1 * random_matrix(rng, 3, 6);
  transition.Phi.block<3, 6>(err::rho, err::theta) = 0.1 * random_matrix(rng, 3, 6);
  transition.Phi.block<3, 6>(err::rho, err::b_g) = 0.1 * random_matrix(rng, 3, 6);
  const Eigen::MatrixXd half = 0.1 * random_matrix(rng, err::imu_size, err::imu_size);
  transition.Q = half * half.transpose();
  return transition;
}

/// A covariance with two clones and correlations everywhere.
Covariance filled(std::mt19937_64& rng) {
  Covariance P(err::clone(4));
  P.reset(Eigen::VectorXd::Constant(err::clones, 0.5));
  for (int i = 0; i < 2; ++i) {
    P.propagate(random_transition(rng), {random_matrix(rng, 9, 9), random_matrix(rng, 6, 9)},
                tangent_basis(Eigen::Vector3d(0.1, -0.2, 0.97).normalized()), 0.01);
    P.append_clone(random_matrix(rng, 6, 1));
  }
  P.propagate(random_transition(rng), {random_matrix(rng, 9, 9), random_matrix(rng, 6, 9)},
              tangent_basis(Eigen::Vector3d(0.1, -0.2, 0.97).normalized()), 0.01);
  return P;
}

}  // namespace

TEST_CASE("covariance: propagation and cloning are the full matrix products") {
  std::mt19937_64 rng{31};
  Covariance P(err::clone(3));
  P.reset(Eigen::VectorXd::LinSpaced(err::clones, 0.1, 1.0));
  const auto offset_jacobian = random_matrix(rng, 6, 1);
  const Eigen::MatrixXd before = P.matrix();
  P.append_clone(offset_jacobian);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(err::clone(1), err::clones);
  J.topRows(err::clones).setIdentity();
  J.block<3, 3>(err::clones, err::theta).setIdentity();
  J.block<3, 3>(err::clones + 3, err::rho).setIdentity();
  J.bottomRows(6).col(err::time_offset) = offset_jacobian;
  CHECK((P.matrix() - J * before * J.transpose()).norm() < 1e-12);

  const ErrorTransition transition = random_transition(rng);
  const Eigen::MatrixXd cloned = P.matrix();
  const Eigen::Matrix<double, 3, 2> B = tangent_basis(Eigen::Vector3d(0.2, 0.3, 0.9).normalized());
  const MatrixEffect by_matrix{random_matrix(rng, 9, 9), random_matrix(rng, 6, 9)};
  P.propagate(transition, by_matrix, B, 0.02);
  // The normal's error in the world, delta + B^T theta, stays; it walks by itself.
  Eigen::MatrixXd to_world = Eigen::MatrixXd::Identity(P.size(), P.size());
  to_world.block<2, 3>(err::normal, err::theta) = B.transpose();
  Eigen::MatrixXd Phi = Eigen::MatrixXd::Identity(P.size(), P.size());
  Eigen::MatrixXd Q = Eigen::MatrixXd::Zero(P.size(), P.size());
  Phi.topLeftCorner<err::imu_size, err::imu_size>() = transition.Phi;
  Phi.block<9, 9>(0, err::gyro_matrix) = by_matrix.gyro;
  Phi.block<6, 9>(err::nu, err::accel_matrix) = by_matrix.accel;
  Q.topLeftCorner<err::imu_size, err::imu_size>() = transition.Q;
  Q.diagonal().segment<2>(err::normal).setConstant(0.02);
  const Eigen::MatrixXd to_body = to_world.inverse();
  Phi = to_body * Phi * to_world;
  Q = to_body * Q * to_body.transpose();
  CHECK((P.matrix() - (Phi * cloned * Phi.transpose() + Q)).norm() < 1e-12);
}

TEST_CASE("covariance: removing takes out rows and columns, and nothing else") {
  std::mt19937_64 rng{32};
  Covariance P = filled(rng);
  const Eigen::MatrixXd before = P.matrix();
  P.remove(err::clone(0), err::clone_size);
  std::vector<int> kept;
  for (int i = 0; i < err::clone(2); ++i) {
    if (i < err::clone(0) || i >= err::clone(1)) kept.push_back(i);
  }
  CHECK(P.size() == err::clone(1));
  CHECK((P.matrix() - before(kept, kept)).norm() == 0.0);
}

TEST_CASE("covariance: the update is Kalman's, and stays symmetric and positive") {
  for (const int rows : {1, 2, 3, 4, 7, 12, 13, 30}) {  // few and many are computed differently
    CAPTURE(rows);
    std::mt19937_64 rng{33};
    Covariance P = filled(rng);
    const Eigen::MatrixXd before = P.matrix();
    const int first = err::beams;
    Eigen::MatrixXd part = random_matrix(rng, rows, P.size() - first);
    part.col(2).setZero();
    const Eigen::VectorXd r = random_matrix(rng, rows, 1);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(rows, P.size());
    H.rightCols(part.cols()) = part;
    const Eigen::MatrixXd S = H * before * H.transpose() + Eigen::MatrixXd::Identity(rows, rows);
    const Eigen::MatrixXd K = before * H.transpose() * S.inverse();
    const Eigen::VectorXd beforehand = P.correction(part, first, r);
    CHECK((P.matrix() - before).norm() == 0.0);
    const ClonePair pair = P.corrected(err::clone(0), err::clone(1));
    const Eigen::VectorXd correction = P.update(part, first, r);
    CHECK((correction - K * r).norm() < 1e-9);
    CHECK((correction - beforehand).norm() == 0.0);
    CHECK((pair - P.matrix().block<err::clone_size, err::clone_size>(err::clone(0), err::clone(1))).norm() < 1e-12);
    CHECK((P.matrix() - (before - K * S * K.transpose())).norm() < 1e-9);
    CHECK((P.matrix() - P.matrix().transpose()).norm() == 0.0);
    CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(P.matrix()).eigenvalues().minCoeff() > 0.0);
  }
}

TEST_CASE("covariance: the way between two points that hang on clones, against numerical differentiation") {
  std::mt19937_64 rng{37};
  Covariance P = filled(rng);
  const State x = random_state(rng, 2);
  const std::array<Eigen::Vector3d, 2> in_clone{random_vector(rng, 0.3), random_vector(rng, 0.3)};
  const auto point = [&](const State& at, std::size_t k) -> Eigen::Vector3d {
    return at.clones[k].T_WB.R * in_clone[k] + at.clones[k].T_WB.p;
  };
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd J(3, x.error_size());
  for (int column = 0; column < x.error_size(); ++column) {
    const auto way = [&](double step) -> Eigen::Vector3d {
      State moved = x;
      boxplus(moved, step * Eigen::VectorXd::Unit(x.error_size(), column));
      return point(moved, 1) - point(moved, 0);
    };
    J.col(column) = (way(kStep) - way(-kStep)) / (2.0 * kStep);
  }
  const ClonePoint from{err::clone(0), point(x, 0)}, to{err::clone(1), point(x, 1)};
  const Eigen::Matrix3d expected = J * P.matrix() * J.transpose();
  CHECK((P.of_way(from, to) - expected).norm() < 1e-6 * expected.norm());
  const Eigen::MatrixXd H = random_matrix(rng, 5, P.size());
  const Eigen::VectorXd r = random_matrix(rng, 5, 1);
  (void)P.correction(H, 0, r);
  const Eigen::Matrix3d after = P.of_way(from, to, true);
  (void)P.update(H, 0, r);
  CHECK((after - P.of_way(from, to)).norm() < 1e-9 * expected.norm());
}

TEST_CASE("covariance: what is only considered keeps value and variance, the rest knows less than with it") {
  std::mt19937_64 rng{34};
  Covariance learned = filled(rng);
  Covariance considered = learned;
  const Eigen::MatrixXd before = learned.matrix();
  const Eigen::MatrixXd H = random_matrix(rng, 5, before.rows());
  const Eigen::VectorXd r = random_matrix(rng, 5, 1);
  learned.update(H, 0, r);
  const Eigen::VectorXd correction = considered.update(H, 0, r, err::camera, err::calibration_size);
  CHECK(correction.segment<err::calibration_size>(err::camera).norm() == 0.0);
  const auto calibration = [](const Eigen::MatrixXd& m) {
    return m.block<err::calibration_size, err::calibration_size>(err::camera, err::camera).eval();
  };
  CHECK((calibration(considered.matrix()) - calibration(before)).norm() == 0.0);
  // The Schmidt-Kalman covariance from its definition: gain rows of the considered part zero, Joseph form.
  const Eigen::MatrixXd S = H * before * H.transpose() + Eigen::MatrixXd::Identity(5, 5);
  Eigen::MatrixXd K = before * H.transpose() * S.inverse();
  K.middleRows(err::camera, err::calibration_size).setZero();
  const Eigen::MatrixXd I_KH = Eigen::MatrixXd::Identity(before.rows(), before.rows()) - K * H;
  CHECK((considered.matrix() - (I_KH * before * I_KH.transpose() + K * K.transpose())).norm() < 1e-9);
}

TEST_CASE("covariance: what is widened keeps its correlations") {
  std::mt19937_64 rng{36};
  Covariance P = filled(rng);
  const Eigen::MatrixXd before = P.matrix();
  Eigen::Matrix3d Q;
  Q << 0.01, 0.002, 0.0, 0.002, 0.04, -0.01, 0.0, -0.01, 0.09;
  P.inflate(err::nu, Q);
  Eigen::MatrixXd added = P.matrix() - before;
  CHECK((added.block<3, 3>(err::nu, err::nu) - Q).norm() < 1e-12);
  added.block<3, 3>(err::nu, err::nu).setZero();
  CHECK(added.norm() == 0.0);
}

TEST_CASE("covariance: rows that are not numbers change nothing") {
  std::mt19937_64 rng{35};
  Covariance P = filled(rng);
  const Eigen::MatrixXd before = P.matrix();
  Eigen::MatrixXd H = random_matrix(rng, 2, before.rows());
  Eigen::VectorXd r = random_matrix(rng, 2, 1);
  r(1) = std::nan("");
  CHECK(P.update(H, 0, r).norm() == 0.0);
  CHECK((P.matrix() - before).norm() == 0.0);
  r(1) = 0.0;
  H(0, 3) = std::nan("");
  CHECK(P.update(H, 0, r).norm() == 0.0);
  CHECK((P.matrix() - before).norm() == 0.0);
}
