#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "tests/evaluation/support.h"
#include "tests/support/about.h"
#include "tools/evaluation/evaluate.h"
#include "tools/evaluation/read.h"

namespace ear::evaluation {
namespace {

using test::about;

constexpr double kRate = 10.0;       // [Hz] of estimate and truth
constexpr double kDuration = 100.0;  // [s]

/// A straight drive along x at 1 m/s; its world is turned and moved against the estimates'.
Trajectory drive() {
  Trajectory poses;
  for (int i = 0; i <= static_cast<int>(kDuration * kRate); ++i)
    poses.push_back({kStart + std::llround(i / kRate * 1e9), Eigen::Quaterniond::Identity(), {i / kRate, 0, 0}});
  return poses;
}

/// The drive with its position off to the side by `offset` [m] from one time to another [s], and sure of it.
Estimate off_to_the_side(double offset, double from, double to) {
  Estimate estimate;
  estimate.poses = drive();
  for (Pose& pose : estimate.poses) {
    const double t = seconds_between(kStart, pose.t_ns);
    if (t > from - 1e-6 && t < to + 1e-6) pose.p_WB.y() += offset;
  }
  estimate.covariance.assign(estimate.poses.size(), 1e-6 * PoseCovariance::Identity());
  estimate.health.assign(estimate.poses.size(), "tracking");
  return estimate;
}

Estimate with_sigma(Estimate estimate, double sigma) {
  estimate.covariance.assign(estimate.poses.size(), sigma * sigma * PoseCovariance::Identity());
  return estimate;
}

FalseTracking judged(Estimate estimate, const Truth& truth = {drive()}) {
  estimate.poses = moved(isometry({0, 0, 2.0}, {3, 4, 5}), estimate.poses);
  return evaluate(estimate, truth, AlignmentKind::yaw).false_tracking.value();
}

TEST_CASE("false tracking: an error beyond five sigma while tracking is counted") {
  const FalseTracking result = judged(off_to_the_side(1.0, 50.0, 60.0));
  CHECK(result.share == doctest::Approx(0.10));
  CHECK(result.far_off == doctest::Approx(0.10));
  REQUIRE(result.stretches.size() == 1);
  const FarOff& off = result.stretches.front();
  CHECK(seconds_between(kStart, off.from_ns) == doctest::Approx(50.0));
  CHECK(seconds_between(kStart, off.to_ns) == doctest::Approx(60.0));
  CHECK(off.tracking == doctest::Approx(10.0));
  CHECK(off.largest_error == doctest::Approx(1.0));
  CHECK(off.most_sigmas > 5.0);
}

TEST_CASE("false tracking: an error that grows is counted from where it is beyond the limit") {
  Estimate estimate = with_sigma(off_to_the_side(0.0, 0.0, 0.0), 100.0);  // five sigma are never reached
  for (Pose& pose : estimate.poses) {
    const double t = seconds_between(kStart, pose.t_ns);
    pose.p_WB.y() += 0.2 * std::max(0.0, t - 30.0);  // 5 % of the path at 40 s
  }
  CHECK(judged(estimate).share == about(0.6, 0.01));
  CHECK(judged(estimate).stretches.front().travelled == doctest::Approx(100.0));
}

TEST_CASE("false tracking: degraded or lost is honest, and what comes after the word does not count") {
  Estimate estimate = off_to_the_side(1.0, 50.0, 60.0);
  for (const std::string said : {"degraded: without wheel_left; carried by cameras", "lost", "initialising"}) {
    std::fill(estimate.health.begin() + 500, estimate.health.begin() + 601, said);
    CHECK(judged(estimate).share == 0.0);
    CHECK(judged(estimate).far_off == doctest::Approx(0.10));
  }
  std::fill(estimate.health.begin() + 500, estimate.health.begin() + 550, "tracking; load step 2");
  CHECK(judged(estimate).share == doctest::Approx(0.05));
  estimate.health.clear();
  CHECK_FALSE(evaluate(estimate, drive(), AlignmentKind::yaw).false_tracking);
}

TEST_CASE("false tracking: no rows while lost are no tracking") {
  Estimate estimate = off_to_the_side(1.0, 50.0, 60.0);
  const auto cut = [](auto& list) { list.erase(list.begin() + 500, list.begin() + 601); };
  cut(estimate.poses);
  cut(estimate.covariance);
  cut(estimate.health);
  CHECK(judged(estimate).far_off == 0.0);
}

TEST_CASE("false tracking: shorter than a second is not counted, nor two short ones with a gap between") {
  CHECK(judged(off_to_the_side(1.0, 50.0, 50.9)).stretches.empty());
  CHECK(judged(off_to_the_side(1.0, 50.0, 51.0)).stretches.size() == 1);

  Estimate estimate = off_to_the_side(1.0, 50.0, 52.0);
  const auto cut = [](auto& list) { list.erase(list.begin() + 506, list.begin() + 515); };
  cut(estimate.poses);
  cut(estimate.covariance);
  cut(estimate.health);
  CHECK(judged(estimate).stretches.empty());
}

TEST_CASE("false tracking: an honest covariance, and errors that may be the truth's, are not counted") {
  const Estimate estimate = off_to_the_side(1.0, 50.0, 60.0);  // 2 % of the path
  CHECK(judged(with_sigma(estimate, 0.3)).stretches.empty());
  CHECK(judged(with_sigma(estimate, 0.15)).stretches.size() == 1);
  CHECK(judged(estimate, {drive(), true, 1.1}).stretches.empty());
  CHECK(judged(estimate, {drive(), true, 0.9}).stretches.size() == 1);
  CHECK(judged(off_to_the_side(0.09, 2.5, 60.0)).stretches.empty());  // the first metres: no more than 0.1 m
}

TEST_CASE("false tracking: one direction of which it is sure cannot hide behind another") {
  Estimate estimate = off_to_the_side(1.0, 50.0, 60.0);
  for (Pose& pose : estimate.poses) pose.p_WB.z() += pose.p_WB.y();
  for (PoseCovariance& P : estimate.covariance) P(2, 2) = 4.0;  // along the error it would be 0.7 sigma
  CHECK(judged(estimate).share == doctest::Approx(0.10));
}

TEST_CASE("false tracking: an error at the end does not move the start, and the worlds may differ") {
  const FalseTracking result = judged(off_to_the_side(20.0, 90.0, 100.0));
  REQUIRE(result.stretches.size() == 1);  // aligned over all poses, the sound ones would be off by 2 m
  CHECK(result.far_off == doctest::Approx(0.10));
}

TEST_CASE("false tracking: what the truth's attitude leaves open of the yaw is no error") {
  Truth truth{drive()};
  std::mt19937_64 rng{51};
  for (std::size_t i = 0; i < 21; ++i)
    truth.poses[i].q_WB = exp_rotation({0, 0, 0.02 * gaussian(rng, 1.0).x()}) * truth.poses[i].q_WB;
  const Estimate estimate = off_to_the_side(0.0, 0.0, 0.0);
  CHECK(judged(estimate, truth).stretches.empty());
}

TEST_CASE("false tracking: a truth of positions alone") {
  Truth truth{drive()};
  truth.has_attitude = false;
  std::mt19937_64 rng{52};
  for (Pose& pose : truth.poses) {
    pose.q_WB = exp_rotation(gaussian(rng, 1.0));  // says nothing
    pose.p_WB += gaussian(rng, 0.1);
  }
  truth.error = 0.8;
  const Evaluation sound = evaluate(off_to_the_side(0.0, 0.0, 0.0), truth, AlignmentKind::yaw);
  CHECK(sound.length == about(100.0, 0.05));
  CHECK(sound.position_rmse < 0.2);
  CHECK(sound.relative.empty());
  CHECK_FALSE(sound.rotation_from_attitude);
  CHECK(sound.nees->position.mean > 3.0);
  CHECK(sound.false_tracking->stretches.empty());
  CHECK(judged(off_to_the_side(3.0, 50.0, 60.0), truth).share == about(0.10, 0.05));
}

TEST_CASE("positions alone are read from a csv with fewer than eight columns") {
  const TemporaryFolder folder("positions");
  const auto file =
      folder.write("p.csv", "#timestamp [ns],x,y,z [m],quality   (fixed, anchors known)\n1,2,3,4,99\n2,2,3,5,98\n");
  const Truth truth = read_truth_or_positions(file);
  CHECK_FALSE(truth.has_attitude);
  REQUIRE(truth.poses.size() == 2);
  CHECK(truth.poses[1].p_WB.z() == 5.0);
  CHECK_THROWS_AS((void)read_truth(file), std::runtime_error);
  const auto torn = folder.write("torn.csv", "#timestamp [ns],x,y,z [m]\n1,2,3,4\n2,2,3\n");
  CHECK_THROWS_WITH((void)read_truth_or_positions(torn),
                    doctest::Contains("torn.csv:3: 3 fields where 4 are expected"));
}

}  // namespace
}  // namespace ear::evaluation
