#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>

#include "filter/ekf/covariance.h"
#include "filter/ekf/gate.h"
#include "filter/sources/cameras/feature_update.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

namespace {

const Gate kOpen(std::vector<double>{1e9});

constexpr double kSigma = 1e-3;

/// A point seen by both cameras of all clones, with noise; the point is triangulated, as the filter does it.
struct Scene {
  State x;
  InverseDepthPoint point;
  std::vector<LinearizedObservation> observations;
  std::vector<Sighting> sightings;
};

/// What camera 0 or 1 of a clone sees of a point; the test's own projection.
Eigen::Vector2d project(const State& x, int clone, int camera, const Eigen::Vector3d& f_W) {
  const Pose& T_WB = x.clones[static_cast<std::size_t>(clone)].T_WB;
  const Eigen::Vector3d f_B = T_WB.R.inverse() * (f_W - T_WB.p);
  Eigen::Vector3d f_C = x.camera.T_BC0.R.inverse() * (f_B - x.camera.T_BC0.p);
  if (camera == 1) f_C = x.camera.T_C0C1.R.inverse() * (f_C - x.camera.T_C0C1.p);
  const LensError& lens = x.camera.lens_error[static_cast<std::size_t>(camera)];
  const double focal = 1.0 + lens.focal_length;
  return {focal * f_C.x() / f_C.z() + lens.principal_point.x(), focal * f_C.y() / f_C.z() + lens.principal_point.y()};
}

/// Both cameras of the clones from `first` on see the point, with noise; `outlier` is added to one x, that of camera 0
/// of the clone after the very first.
void see(std::mt19937_64& rng, const Eigen::Vector3d& f_W, int first, double outlier, Scene& scene) {
  std::vector<CameraPose> cameras;
  camera_poses(scene.x, cameras);
  std::vector<std::pair<int, int>> who;
  std::vector<Eigen::Vector2d> seen;
  for (int i = first; i < static_cast<int>(scene.x.clones.size()); ++i) {
    for (int camera = 0; camera < 2; ++camera) {
      Eigen::Vector2d uv = project(scene.x, i, camera, f_W) + kSigma * random_vector(rng, 1.0).head<2>();
      if (i == 1 && camera == 0) uv.x() += outlier;
      const CameraPose& pose = cameras[static_cast<std::size_t>(2 * i + camera)];
      const LensError& lens = scene.x.camera.lens_error[static_cast<std::size_t>(camera)];
      scene.sightings.push_back({pose.R_CW, pose.p_WC, lens.corrected(uv)});
      seen.push_back(uv);
      who.emplace_back(i, camera);
    }
  }
  const auto point = triangulate(scene.sightings);
  REQUIRE(point);
  scene.point = *point;
  for (std::size_t k = 0; k < who.size(); ++k) {
    scene.observations.push_back(linearize_observation(scene.x, who[k].first, who[k].second, scene.point, seen[k]));
  }
}

Scene random_scene(std::mt19937_64& rng, int clones, double outlier = 0.0) {
  Scene scene;
  scene.x = random_state(rng, clones);
  const Eigen::Vector3d ahead = scene.x.camera.T_BC0.p + scene.x.camera.T_BC0.R * Eigen::Vector3d(0.3, -0.2, 4.0);
  see(rng, scene.x.imu.R_WB * ahead + scene.x.imu.p_WB, 0, outlier, scene);
  return scene;
}

/// As in a drive at a few decimetres a second: clones are centimetres apart, and few see the point, near or far.
Scene slow_scene(std::mt19937_64& rng, int clones) {
  Scene scene;
  scene.x = random_state(rng, clones);
  const Pose start = scene.x.clones.front().T_WB;
  for (int i = 0; i < clones; ++i) {
    Pose& T_WB = scene.x.clones[static_cast<std::size_t>(i)].T_WB;
    T_WB.R = start.R * exp_so3(0.01 * i * random_vector(rng, 1.0));
    T_WB.p = start.p + start.R * (0.02 * i * Eigen::Vector3d::UnitX() + random_vector(rng, 0.001));
  }
  scene.x.camera.T_BC0.R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  scene.x.camera.T_C0C1 = {Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.05, 0.0, 0.0)};
  std::vector<CameraPose> cameras;
  camera_poses(scene.x, cameras);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double depth = 0.3 * std::pow(30.0, unit(rng));
  const CameraPose& last = cameras[static_cast<std::size_t>(2 * clones - 2)];
  const Eigen::Vector3d f_W =
      last.p_WC + depth * (last.R_CW.transpose() * Eigen::Vector3d(unit(rng) - 0.5, unit(rng) - 0.5, 1.0));
  const int first = static_cast<int>(unit(rng) * (clones - 1));
  see(rng, f_W, first, 0.0, scene);
  return scene;
}

/// All rows of a feature over the full error vector, whitened.
void stack(const Scene& scene, Eigen::MatrixXd& H_x, Eigen::MatrixXd& H_f, Eigen::VectorXd& r) {
  const auto rows = static_cast<Eigen::Index>(2 * scene.observations.size());
  H_x = Eigen::MatrixXd::Zero(rows, scene.x.error_size());
  H_f.resize(rows, 3);
  r.resize(rows);
  for (std::size_t k = 0; k < scene.observations.size(); ++k) {
    const LinearizedObservation& z = scene.observations[k];
    const auto row = static_cast<Eigen::Index>(2 * k);
    H_x.block<2, err::poses_size>(row, err::camera) = z.H_poses / kSigma;
    H_x.block<2, err::lens_size>(row, err::lens(z.camera)) = z.H_lens / kSigma;
    H_x.block<2, 6>(row, err::clone(z.clone)) = z.H_clone / kSigma;
    H_f.middleRows<2>(row) = z.H_f / kSigma;
    r.segment<2>(row) = z.residual / kSigma;
  }
}

/// The textbook form: left null space of H_f.
void project_out(Eigen::MatrixXd& H_x, const Eigen::MatrixXd& H_f, Eigen::VectorXd& r) {
  const Eigen::MatrixXd Q = H_f.householderQr().householderQ();
  const Eigen::MatrixXd N = Q.rightCols(Q.cols() - 3);
  H_x = (N.transpose() * H_x).eval();
  r = (N.transpose() * r).eval();
}

Covariance some_covariance(std::mt19937_64& rng, const State& x) {
  Covariance P(x.error_size());
  P.reset(Eigen::VectorXd::Constant(err::clones, 0.01));
  for (std::size_t i = 0; i < x.clones.size(); ++i) {
    ErrorTransition walk;
    walk.Q.diagonal().setConstant(1e-5);
    P.propagate(walk, MatrixEffect{}, tangent_basis(Eigen::Vector3d::UnitZ()), 1e-5);
    P.append_clone(random_vector(rng, 0.1).homogeneous().replicate<2, 1>().head<6>());
  }
  return P;
}

}  // namespace

TEST_CASE("feature: H is the derivative of the observation, for both cameras, calibration included") {
  std::mt19937_64 rng{61};
  for (int trial = 0; trial < 10; ++trial) {
    for (int camera = 0; camera < 2; ++camera) {
      CAPTURE(trial);
      CAPTURE(camera);
      const Scene scene = random_scene(rng, 3);
      const Eigen::Vector3d f_W = scene.point.scaled_W() / scene.point.inverse_depth;
      const LinearizedObservation z = linearize_observation(scene.x, 1, camera, scene.point, Eigen::Vector2d::Zero());
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(2, scene.x.error_size());
      H.block<2, err::poses_size>(0, err::camera) = z.H_poses;
      H.block<2, err::lens_size>(0, err::lens(camera)) = z.H_lens;
      H.block<2, 6>(0, err::clone(1)) = z.H_clone;
      check_jacobian(
          [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return project(with_error(scene.x, d), 1, camera, f_W); },
          H);
      check_jacobian(
          [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
            return project(scene.x, 1, camera, f_W + d / scene.point.inverse_depth);
          },
          z.H_f);
      CHECK((z.residual + project(scene.x, 1, camera, f_W)).norm() < 1e-9);
    }
  }
}

TEST_CASE("feature: the summed information is the null-space projection") {
  std::mt19937_64 rng{62};
  const Scene scene = random_scene(rng, 5);
  Eigen::MatrixXd H_x, H_f;
  Eigen::VectorXd r;
  stack(scene, H_x, H_f, r);
  project_out(H_x, H_f, r);
  FeatureInformation information(5, 4);
  information.start(scene.x.error_size());
  Covariance P = some_covariance(rng, scene.x);
  REQUIRE(information.add(scene.observations, kSigma, 1e9, P.matrix(), kOpen));
  information.compress();
  const Eigen::MatrixXd H = information.H();
  const Eigen::MatrixXd expected = (H_x.transpose() * H_x).bottomRightCorner(H.cols(), H.cols());
  CHECK((H.transpose() * H - expected).norm() < 1e-8 * expected.norm());
  const Eigen::VectorXd expected_b = (H_x.transpose() * r).tail(H.cols());
  CHECK((H.transpose() * information.residual() - expected_b).norm() < 1e-8 * expected_b.norm());
}

TEST_CASE("feature: rounding makes up no rows and no residual") {
  std::mt19937_64 rng{67};
  for (int trial = 0; trial < 300; ++trial) {
    CAPTURE(trial);
    const Scene scene = slow_scene(rng, 12);
    Eigen::MatrixXd H_x, H_f;
    Eigen::VectorXd r;
    stack(scene, H_x, H_f, r);
    project_out(H_x, H_f, r);
    FeatureInformation information(12, 4);
    information.start(scene.x.error_size());
    const Covariance P = some_covariance(rng, scene.x);
    REQUIRE(information.add(scene.observations, kSigma, 1e9, P.matrix(), kOpen));
    information.compress();
    CHECK(information.H().rows() <= r.size() + 3);  // the point is projected out but for a prior of no weight
    CHECK(information.residual().norm() <= (1.0 + 1e-6) * r.norm());
    const Eigen::MatrixXd expected =
        (H_x.transpose() * H_x).bottomRightCorner(information.H().cols(), information.H().cols());
    CHECK((information.H().transpose() * information.H() - expected).norm() < 1e-7 * expected.norm());
  }
}

TEST_CASE("feature: rows left out as negligible take no more than their share, and add nothing") {
  std::mt19937_64 rng{68};
  constexpr double kShare = 1e-3;
  const Scene scene = slow_scene(rng, 12);
  const Covariance P = some_covariance(rng, scene.x);
  FeatureInformation information(12, 4);
  const auto rows = [&](double negligible) -> Eigen::MatrixXd {
    information.start(scene.x.error_size());
    REQUIRE(information.add(scene.observations, kSigma, 1e9, P.matrix(), kOpen));
    information.compress(negligible);
    return information.H();
  };
  const Eigen::MatrixXd all = rows(FeatureInformation::kRounding);
  const Eigen::MatrixXd most = rows(kShare);
  CHECK(most.rows() < all.rows());
  CHECK(most.rows() > all.rows() / 4);
  const Eigen::MatrixXd missing = all.transpose() * all - most.transpose() * most;
  Eigen::VectorXd known = Eigen::VectorXd::Zero(missing.rows());  // what the features tell, were they known
  for (const LinearizedObservation& z : scene.observations) {
    known.head<err::poses_size>() += z.H_poses.cwiseAbs2().colwise().sum().transpose() / (kSigma * kSigma);
    known.segment<err::lens_size>(err::lens(z.camera) - err::camera) +=
        z.H_lens.cwiseAbs2().colwise().sum().transpose() / (kSigma * kSigma);
    known.segment<6>(err::clone(z.clone) - err::camera) +=
        z.H_clone.cwiseAbs2().colwise().sum().transpose() / (kSigma * kSigma);
  }
  CHECK((missing.diagonal().array() <= kShare * known.array() + 1e-9 * known.maxCoeff()).all());
  CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(missing).eigenvalues()(0) > -1e-9 * known.maxCoeff());
}

TEST_CASE("feature: an update by two features is that of their stacked rows") {
  std::mt19937_64 rng{63};
  Scene one = random_scene(rng, 4);
  Covariance P = some_covariance(rng, one.x);
  Covariance reference = P;
  FeatureInformation information(4, 4);
  information.start(one.x.error_size());
  Eigen::MatrixXd H_all(0, one.x.error_size());
  Eigen::VectorXd r_all(0);
  for (int feature = 0; feature < 2; ++feature) {
    Scene scene = one;
    for (auto& z : scene.observations) z.residual += kSigma * random_vector(rng, 1.0).head<2>();
    Eigen::MatrixXd H_x, H_f;
    Eigen::VectorXd r;
    stack(scene, H_x, H_f, r);
    project_out(H_x, H_f, r);
    H_all = (Eigen::MatrixXd(H_all.rows() + H_x.rows(), H_x.cols()) << H_all, H_x).finished();
    r_all = (Eigen::VectorXd(r_all.size() + r.size()) << r_all, r).finished();
    REQUIRE(information.add(scene.observations, kSigma, 1e9, P.matrix(), kOpen));
  }
  information.compress();
  // The textbook Kalman update in information form.
  const Eigen::MatrixXd P0 = P.matrix();
  const Eigen::MatrixXd S = H_all * P0 * H_all.transpose() + Eigen::MatrixXd::Identity(H_all.rows(), H_all.rows());
  const Eigen::VectorXd expected = P0 * H_all.transpose() * S.ldlt().solve(r_all);
  const Eigen::VectorXd correction = P.update(information.H(), err::camera, information.residual());
  CHECK((correction - expected).norm() < 1e-6 * expected.norm());
  CHECK((P.matrix() - (P0 - P0 * H_all.transpose() * S.ldlt().solve(H_all * P0))).norm() < 1e-6 * P0.norm());
  // Of a state that is not corrected yet the residuals are those and the correction's.
  const Eigen::VectorXd r = information.residual();
  information.take_back(correction.tail(correction.size() - err::camera));
  CHECK((information.residual() - r - information.H() * correction.tail(information.H().cols())).norm() < 1e-9);
}

TEST_CASE("feature: the gate is the chi-square of the projected innovation") {
  std::mt19937_64 rng{64};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const Scene scene = random_scene(rng, 4, 0.002 * trial);
    const Covariance P = some_covariance(rng, scene.x);
    Eigen::MatrixXd H_x, H_f;
    Eigen::VectorXd r;
    stack(scene, H_x, H_f, r);
    project_out(H_x, H_f, r);
    const Eigen::MatrixXd S = H_x * P.matrix() * H_x.transpose() + Eigen::MatrixXd::Identity(r.size(), r.size());
    const double statistic = r.dot(S.ldlt().solve(r));
    FeatureInformation information(4, 4);
    const auto passes = [&](double threshold) {
      std::vector<double> thresholds(static_cast<std::size_t>(r.size()) + 3, -1.0);  // of any other dof: nothing passes
      thresholds[static_cast<std::size_t>(r.size()) - 1] = threshold;
      information.start(scene.x.error_size());
      return information.add(scene.observations, kSigma, 1e9, P.matrix(), Gate(thresholds));
    };
    CHECK(passes(1.001 * statistic + 1e-6));
    CHECK_FALSE(passes(0.999 * statistic - 1e-6));
  }
}

TEST_CASE("feature: a camera in doubt counts as little as its weight says, and is gated by the noise of its images") {
  std::mt19937_64 rng{67};
  const Gate gate(0.98, 20);
  Scene scene = random_scene(rng, 4);
  const Eigen::MatrixXd known = Eigen::MatrixXd::Zero(scene.x.error_size(), scene.x.error_size());
  FeatureInformation information(4, 4);
  const auto information_of = [&](const Scene& seen) {
    information.start(seen.x.error_size());
    REQUIRE(information.add(seen.observations, kSigma, 1e9, known, gate));
    information.compress();
    return Eigen::MatrixXd(information.H().transpose() * information.H());
  };
  const Eigen::MatrixXd trusted = information_of(scene);
  for (LinearizedObservation& z : scene.observations) z.weight = 0.1;
  CHECK((information_of(scene) - 0.01 * trusted).norm() < 1e-6 * trusted.norm());

  Scene moved = random_scene(rng, 4, 20.0 * kSigma);  // by its weight that is two standard deviations
  for (LinearizedObservation& z : moved.observations) z.weight = 0.1;
  information.start(moved.x.error_size());
  CHECK_FALSE(information.add(moved.observations, kSigma, 1e9, known, gate));
}

TEST_CASE("feature: a common turn about gravity and a common shift cannot be seen") {
  std::mt19937_64 rng{65};
  const Scene scene = random_scene(rng, 4);
  FeatureInformation information(4, 4);
  information.start(scene.x.error_size());
  const Covariance P = some_covariance(rng, scene.x);
  REQUIRE(information.add(scene.observations, kSigma, 1e9, P.matrix(), kOpen));
  information.compress();
  const Eigen::MatrixXd N = unobservable(scene.x).bottomRows(information.H().cols());
  CHECK((information.H() * N).norm() < 1e-5 * information.H().norm());
}

TEST_CASE("feature: an outlier weighs less with Huber") {
  std::mt19937_64 rng{66};
  const Scene scene = random_scene(rng, 5, 0.01);
  const Covariance P = some_covariance(rng, scene.x);
  const auto correction_norm = [&](double huber) {
    FeatureInformation information(5, 4);
    information.start(scene.x.error_size());
    REQUIRE(information.add(scene.observations, kSigma, huber, P.matrix(), kOpen));
    information.compress();
    Covariance updated = P;
    return updated.update(information.H(), err::camera, information.residual()).norm();
  };
  CHECK(correction_norm(2.0) < 0.7 * correction_norm(1e9));
}
