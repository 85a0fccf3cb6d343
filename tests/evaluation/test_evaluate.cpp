#include <doctest/doctest.h>

#include <stdexcept>

#include "tests/evaluation/support.h"
#include "tests/support/about.h"
#include "tools/evaluation/evaluate.h"

namespace ear::evaluation {
namespace {

using test::about;

Estimate estimate_of(const Trajectory& poses) {
  Estimate estimate;
  estimate.name = "test";
  estimate.poses = poses;
  return estimate;
}

/// A straight drive along x at 1 m/s.
Trajectory drive(double duration, double rate) {
  Trajectory poses;
  for (int i = 0; i <= static_cast<int>(duration * rate); ++i)
    poses.push_back({kStart + std::llround(i / rate * 1e9), Eigen::Quaterniond::Identity(), {i / rate, 0, 0}});
  return poses;
}

const Eigen::Isometry3d kOffset = isometry({0, 0, 0}, {0.3, -0.4, 1.2});  // 1.3 m long
const Eigen::Isometry3d kYaw = isometry({0, 0, 0.7}, {0, 0, 0});

TEST_CASE("evaluate: a pure offset is an error only where nothing is aligned") {
  const Trajectory truth = walk(30.0, 50.0);
  const Estimate estimate = estimate_of(moved(kOffset, walk(30.0, 10.0)));
  const Evaluation none = evaluate(estimate, truth, AlignmentKind::none);
  CHECK(none.position_rmse == doctest::Approx(1.3).epsilon(1e-9));
  CHECK(none.position_max == doctest::Approx(1.3).epsilon(1e-9));
  CHECK(none.z_rmse == doctest::Approx(1.2).epsilon(1e-9));
  CHECK(*none.position_ratio == doctest::Approx(1.3 / none.length).epsilon(1e-9));
  CHECK(none.rotation_rmse < 1e-7);
  CHECK(none.start_to_end.error < 1e-9);  // the start pose is aligned whatever the alignment
  for (const RelativeError& relative : none.relative) CHECK(relative.translation < 1e-9);
  CHECK(evaluate(estimate, truth, AlignmentKind::yaw).position_rmse < 1e-9);
  CHECK(evaluate(estimate, truth, AlignmentKind::se3).position_rmse < 1e-9);
}

TEST_CASE("evaluate: a pure yaw is a rotation error only where nothing is aligned") {
  const Trajectory truth = walk(30.0, 50.0);
  const Estimate estimate = estimate_of(moved(kYaw, walk(30.0, 10.0)));
  CHECK(evaluate(estimate, truth, AlignmentKind::none).rotation_rmse == doctest::Approx(0.7).epsilon(1e-9));
  const Evaluation aligned = evaluate(estimate, truth, AlignmentKind::yaw);
  CHECK(aligned.rotation_rmse < 1e-7);
  CHECK(aligned.position_rmse < 1e-9);
  CHECK(aligned.start_to_end.error < 1e-9);
}

TEST_CASE("evaluate: a tilted world is an error for yaw alignment, none for se3") {
  const Trajectory truth = walk(30.0, 50.0);
  const Estimate estimate = estimate_of(moved(isometry({0.2, 0, 0}, {1, 2, 3}), walk(30.0, 10.0)));
  CHECK(evaluate(estimate, truth, AlignmentKind::yaw).rotation_rmse > 0.19);
  CHECK(evaluate(estimate, truth, AlignmentKind::se3).rotation_rmse < 1e-7);
  CHECK(evaluate(estimate, truth, AlignmentKind::se3).start_to_end.error < 1e-9);
}

TEST_CASE("evaluate: white noise of known size gives its size back") {
  std::mt19937_64 rng{21};
  Trajectory poses = walk(100.0, 50.0);
  for (Pose& pose : poses) {
    pose.p_WB += gaussian(rng, 0.05);
    pose.q_WB = exp_rotation(gaussian(rng, 0.02)) * pose.q_WB;
  }
  const Evaluation result = evaluate(estimate_of(poses), walk(100.0, 50.0), AlignmentKind::none);
  CHECK(result.position_rmse == about(0.05 * std::sqrt(3.0), 0.03));
  CHECK(result.z_rmse == about(0.05, 0.03));
  CHECK(result.rotation_rmse == about(0.02 * std::sqrt(3.0), 0.03));
}

TEST_CASE("evaluate: a scale error is the same share of every stretch, a turning world the same angle per metre") {
  Trajectory poses = drive(40.0, 10.0);
  for (Pose& pose : poses) {
    pose.q_WB = exp_rotation({0, 0, 0.001 * pose.p_WB.x()});
    pose.p_WB.x() *= 1.02;
  }
  const Evaluation result = evaluate(estimate_of(poses), drive(40.0, 50.0), AlignmentKind::none);
  REQUIRE(result.relative.size() == 4);
  CHECK(result.length == doctest::Approx(40.0));
  CHECK(result.duration == doctest::Approx(40.0));
  CHECK(result.relative[3].distance == 20.0);
  CHECK(result.relative[3].stretches == 201);
  for (const RelativeError& relative : result.relative)
    CHECK(relative.rotation == doctest::Approx(0.001).epsilon(1e-6));
  CHECK(result.start_to_end.error == doctest::Approx(0.8));
  CHECK(result.start_to_end.estimated == doctest::Approx(40.8));
  CHECK(result.start_to_end.truth == doctest::Approx(40.0));
  CHECK(result.start_to_end.difference == doctest::Approx(0.8));

  for (Pose& pose : poses) pose.q_WB.setIdentity();  // a turning body would turn the scale error with it
  for (const RelativeError& relative : evaluate(estimate_of(poses), drive(40.0, 50.0), AlignmentKind::none).relative)
    CHECK(relative.translation == doctest::Approx(0.02).epsilon(1e-6));
}

TEST_CASE("evaluate: stretches longer than the drive, or across a gap, do not count") {
  Trajectory poses = drive(7.0, 10.0);
  const Evaluation result = evaluate(estimate_of(poses), drive(7.0, 50.0), AlignmentKind::none);
  REQUIRE(result.relative.size() == 2);
  CHECK(result.relative[1].stretches == 21);

  poses.erase(poses.begin() + 30, poses.begin() + 60);  // 3 m without an estimate
  const Evaluation with_gaps = evaluate(estimate_of(poses), drive(7.0, 50.0), AlignmentKind::none);
  CHECK(with_gaps.relative[0].distance == 1.0);
  CHECK(with_gaps.relative[0].stretches == 21);
  CHECK(with_gaps.coverage == doctest::Approx(3.9 / 7.0));
}

TEST_CASE("length: neither noise nor the rate of the truth add to it") {
  CHECK(distance_travelled(drive(10.0, 1.0), drive(10.0, 1.0)).back() == doctest::Approx(10.0));
  CHECK(distance_travelled(drive(10.0, 500.0), drive(10.0, 5.0)).back() == doctest::Approx(10.0));

  std::mt19937_64 rng{22};
  Trajectory noisy = drive(10.0, 500.0);  // steps of 2 mm under noise of 5 mm: their sum would be 45 m
  for (Pose& pose : noisy) pose.p_WB += gaussian(rng, 0.005);
  CHECK(distance_travelled(noisy, noisy).back() == about(10.0, 0.02));

  Trajectory standing = drive(10.0, 500.0);
  for (Pose& pose : standing) pose.p_WB = gaussian(rng, 0.01);
  CHECK(distance_travelled(standing, standing).back() < 0.1);
}

TEST_CASE("evaluate: a vehicle that stands has no error in per cent") {
  Trajectory standing = drive(10.0, 50.0);
  for (Pose& pose : standing) pose.p_WB.setZero();
  const Evaluation result = evaluate(estimate_of(standing), standing, AlignmentKind::yaw);
  CHECK_FALSE(result.position_ratio);
  CHECK(result.relative.empty());
  CHECK(result.rotation_from_attitude);
  CHECK(result.position_rmse == 0.0);
}

TEST_CASE("evaluate: no overlap is an error that says so") {
  Trajectory later = drive(5.0, 10.0);
  for (Pose& pose : later) pose.t_ns += 100 * kSecond;
  CHECK_THROWS_WITH_AS((void)evaluate(estimate_of(later), drive(5.0, 10.0), AlignmentKind::yaw),
                       doctest::Contains("share 0 poses"), std::runtime_error);
}

/// Estimates whose errors are drawn from the covariance that they state, times `truthfulness` squared.
Estimate consistent_estimate(const Trajectory& truth, double truthfulness, unsigned seed) {
  std::mt19937_64 rng{seed};
  Eigen::Matrix3d L_p;
  L_p << 0.02, 0, 0, 0.01, 0.03, 0, -0.02, 0.01, 0.01;
  Eigen::Matrix3d L_r;
  L_r << 0.002, 0, 0, 0.001, 0.004, 0, 0.002, -0.001, 0.003;
  Estimate estimate = estimate_of(truth);
  for (std::size_t i = 1; i < truth.size(); ++i) {  // the first pose is the origin of its world
    Pose& pose = estimate.poses[i];
    pose.p_WB -= L_p * gaussian(rng, 1.0);
    pose.q_WB = exp_rotation(-L_r * gaussian(rng, 1.0)) * pose.q_WB;
  }
  PoseCovariance P = PoseCovariance::Zero();
  P.topLeftCorner<3, 3>() = truthfulness * truthfulness * L_p * L_p.transpose();
  P.bottomRightCorner<3, 3>() = truthfulness * truthfulness * L_r * L_r.transpose();
  estimate.covariance.assign(truth.size(), P);
  // The estimate lives in a world of its own, as does its covariance.
  const Eigen::Isometry3d T = isometry({0, 0, 2.0}, {3, 4, 5});
  estimate.poses = moved(T, estimate.poses);
  PoseCovariance turn = PoseCovariance::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = T.linear();
  for (PoseCovariance& covariance : estimate.covariance) covariance = (turn * covariance * turn.transpose()).eval();
  return estimate;
}

TEST_CASE("NEES: errors drawn from the stated covariance are chi-squared of 3 degrees of freedom") {
  const Trajectory truth = walk(400.0, 10.0);
  for (const AlignmentKind kind : {AlignmentKind::yaw, AlignmentKind::se3, AlignmentKind::none}) {
    const Evaluation result = evaluate(consistent_estimate(truth, 1.0, 31), truth, kind);
    REQUIRE(result.nees);
    CHECK(result.nees->frames == 4000);
    CHECK(result.nees->skipped == 0);
    const double three_sigma = 3.0 * std::sqrt(2.0 * 3.0 / 4000.0);
    CHECK(std::abs(result.nees->position.mean - 3.0) < three_sigma);
    CHECK(std::abs(result.nees->orientation.mean - 3.0) < three_sigma);
    CHECK(std::abs(result.nees->position.inside - 0.95) < 3.0 * std::sqrt(0.95 * 0.05 / 4000.0));
    CHECK(std::abs(result.nees->orientation.inside - 0.95) < 3.0 * std::sqrt(0.95 * 0.05 / 4000.0));
  }
}

TEST_CASE("NEES: believing half the error makes it four times as large") {
  const Trajectory truth = walk(400.0, 10.0);
  const Evaluation result = evaluate(consistent_estimate(truth, 0.5, 32), truth, AlignmentKind::yaw);
  CHECK(result.nees->position.mean == about(12.0, 0.05));
  CHECK(result.nees->orientation.mean == about(12.0, 0.05));
  CHECK(result.nees->position.inside < 0.7);
}

TEST_CASE("NEES: a covariance without inverse is skipped and counted") {
  const Trajectory truth = walk(10.0, 10.0);
  Estimate estimate = consistent_estimate(truth, 1.0, 33);
  estimate.covariance[7].setZero();
  const Evaluation result = evaluate(estimate, truth, AlignmentKind::yaw);
  CHECK(result.nees->frames == 99);
  CHECK(result.nees->skipped == 1);
  CHECK_FALSE(result.frames[7].nees_position);
  CHECK_FALSE(result.frames[0].nees_position);
}

}  // namespace
}  // namespace ear::evaluation
