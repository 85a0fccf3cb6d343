#include <doctest/doctest.h>

#include "tests/evaluation/support.h"
#include "tools/evaluation/alignment.h"

namespace ear::evaluation {
namespace {

const Eigen::Isometry3d kMotion = isometry({0.3, -0.5, 1.2}, {5.0, -3.0, 2.0});
const Eigen::Isometry3d kYawMotion = isometry({0.0, 0.0, 2.5}, {5.0, -3.0, 2.0});

double difference(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

TEST_CASE("alignment: finds the motion between two worlds again") {
  const Trajectory estimate = walk(20.0, 10.0);
  const Alignment full = align(AlignmentKind::se3, estimate, moved(kMotion, estimate));
  CHECK(difference(full.T_TE, kMotion) < 1e-12);
  CHECK_FALSE(full.rotation_from_attitude);
  const Alignment yaw = align(AlignmentKind::yaw, estimate, moved(kYawMotion, estimate));
  CHECK(difference(yaw.T_TE, kYawMotion) < 1e-12);
  CHECK(difference(align(AlignmentKind::none, estimate, moved(kMotion, estimate)).T_TE,
                   Eigen::Isometry3d::Identity()) == 0.0);
}

TEST_CASE("alignment: no yaw is better than the one found") {
  std::mt19937_64 rng{11};
  const Trajectory truth = walk(20.0, 10.0);
  Trajectory estimate = moved(kMotion, truth);
  for (Pose& pose : estimate) pose.p_WB += gaussian(rng, 0.2);
  const Eigen::Isometry3d found = align(AlignmentKind::yaw, estimate, truth).T_TE;
  const auto cost = [&](const Eigen::Isometry3d& T) {
    double sum = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) sum += (truth[i].p_WB - T * estimate[i].p_WB).squaredNorm();
    return sum;
  };
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Pose& pose : truth) centre += pose.p_WB / static_cast<double>(truth.size());
  for (const double turn : {-1e-3, 1e-3}) {
    const Eigen::Isometry3d turned =
        Eigen::Translation3d(centre) * exp_rotation({0, 0, turn}) * Eigen::Translation3d(-centre) * found;
    CHECK(cost(found) < cost(turned));
  }
}

TEST_CASE("alignment: standing still, noise does not become a rotation") {
  std::mt19937_64 rng{12};
  for (const AlignmentKind kind : {AlignmentKind::yaw, AlignmentKind::se3}) {
    Trajectory truth;
    for (int i = 0; i < 100; ++i) truth.push_back({kStart + i, exp_rotation({0.1, 0.0, 1.0}), gaussian(rng, 1e-3)});
    const Trajectory estimate = moved(kYawMotion.inverse(), truth);
    const Alignment found = align(kind, estimate, truth);
    CHECK(found.rotation_from_attitude);
    CHECK(difference(found.T_TE, kYawMotion) < 1e-9);
  }
}

TEST_CASE("alignment: a straight line tells yaw but not the turn about itself") {
  Trajectory truth;
  for (int i = 0; i < 100; ++i) truth.push_back({kStart + i, exp_rotation({0, 0, 0.5}), {0.1 * i, 0, 0}});
  const Trajectory estimate = moved(kYawMotion.inverse(), truth);
  CHECK_FALSE(align(AlignmentKind::yaw, estimate, truth).rotation_from_attitude);
  const Alignment full = align(AlignmentKind::se3, estimate, truth);
  CHECK(full.rotation_from_attitude);
  CHECK(difference(full.T_TE, kYawMotion) < 1e-9);
}

TEST_CASE("alignment of one pose: its position, and the yaw that leaves no rotation error about the vertical") {
  const Pose truth = moved(kMotion, {pose_at(3.0)}).front();
  const Pose estimate = pose_at(3.0);
  CHECK(difference(align_pose(AlignmentKind::se3, estimate, truth), kMotion) < 1e-12);

  const Eigen::Isometry3d T = align_pose(AlignmentKind::yaw, estimate, truth);
  CHECK((T * estimate.p_WB - truth.p_WB).norm() < 1e-12);
  CHECK((T.linear() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  const Eigen::AngleAxisd rest(truth.q_WB * estimate.q_WB.conjugate() * Eigen::Quaterniond(T.linear()).conjugate());
  CHECK(std::abs(rest.angle() * rest.axis().z()) < 1e-12);
}

}  // namespace
}  // namespace ear::evaluation
