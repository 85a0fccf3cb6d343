#include <doctest/doctest.h>

#include "tests/evaluation/support.h"
#include "tools/evaluation/association.h"

namespace ear::evaluation {
namespace {

Pose pose(double t, double x, double yaw = 0.0) {
  return {std::llround(t * 1e9), exp_rotation({0, 0, yaw}), {x, 0, 0}};
}

/// One pose every `step` seconds from `from` to `to`, moving at 1 m/s.
Trajectory line(double from, double to, double step) {
  Trajectory poses;
  for (int i = 0; from + i * step <= to + 1e-9; ++i) poses.push_back(pose(from + i * step, from + i * step));
  return poses;
}

TEST_CASE("interpolation: position linear, rotation on the shorter arc") {
  Pose b = pose(1.0, 4.0, 0.8);
  b.q_WB.coeffs() *= -1.0;  // the same rotation
  const Pose middle = interpolate(pose(0.0, 2.0, 0.4), b, 250'000'000);
  CHECK(middle.t_ns == 250'000'000);
  CHECK(middle.p_WB.x() == doctest::Approx(2.5).epsilon(1e-12));
  CHECK(middle.q_WB.angularDistance(exp_rotation({0, 0, 0.5})) < 1e-12);
}

TEST_CASE("interpolation: nanoseconds far from zero are exact") {
  const Pose a{kStart, Eigen::Quaterniond::Identity(), {0, 0, 0}};
  const Pose b{kStart + 4, Eigen::Quaterniond::Identity(), {4, 0, 0}};
  CHECK(interpolate(a, b, kStart + 1).p_WB.x() == 1.0);
  CHECK(interpolate(a, b, kStart + 3).p_WB.x() == 3.0);
}

TEST_CASE("association: truth is not extrapolated, what lies outside is counted") {
  const Association result = associate(line(0.0, 5.0, 0.5), line(1.2, 4.0, 0.02));
  CHECK(result.outside == 5);  // 0, 0.5, 1.0 before, 4.5, 5.0 after
  CHECK(result.in_gaps == 0);
  REQUIRE(result.matches.size() == 6);
  CHECK(result.matches.front().index == 3);
  CHECK(result.matches.back().truth.p_WB.x() == doctest::Approx(4.0));
}

TEST_CASE("association: no truth across its gaps, but on their edges") {
  Trajectory truth = line(0.0, 2.0, 0.02);
  const Trajectory later = line(3.0, 5.0, 0.02);
  truth.insert(truth.end(), later.begin(), later.end());
  const Trajectory estimate = line(0.0, 5.0, 0.1);
  const Association result = associate(estimate, truth);
  CHECK(result.outside == 0);
  CHECK(result.in_gaps == 9);  // 2.1 to 2.9
  CHECK(result.matches.size() == 42);
  CHECK(result.matches.front().segment == 0);
  CHECK(result.matches.back().segment == 1);
  CHECK(coverage(estimate, truth) == doctest::Approx(1.0));
}

TEST_CASE("association: a gap is three median intervals, but at least 0.1 s") {
  CHECK(gap_limit(line(0.0, 2.0, 0.005)) == 100'000'000);
  CHECK(gap_limit(line(0.0, 9.0, 0.5)) == 1'500'000'000);
  CHECK(gap_limit({pose(0.0, 0.0)}) == 100'000'000);
}

TEST_CASE("association: poses a century apart lie within the largest gap that there is") {
  const Trajectory apart{pose(-4e9, 0.0), pose(4e9, 0.0)};  // seconds
  CHECK(gap_limit(apart) > 8'000'000'000'000'000'000);
  CHECK(associate({pose(0.0, 0.0)}, apart).matches.size() == 1);
}

TEST_CASE("coverage: the share of the truth's time in which the estimate runs") {
  const Trajectory truth = line(0.0, 10.0, 0.02);
  CHECK(coverage(line(2.5, 7.5, 0.1), truth) == doctest::Approx(0.5));

  Trajectory interrupted = line(0.0, 3.0, 0.1);
  const Trajectory later = line(5.0, 10.0, 0.1);
  interrupted.insert(interrupted.end(), later.begin(), later.end());
  CHECK(coverage(interrupted, truth) == doctest::Approx(0.8));
}

TEST_CASE("coverage: between two poses of an estimate a short piece of the truth counts, too") {
  Trajectory truth = line(0.0, 2.0, 0.01);
  for (const double from : {2.31, 2.62, 2.93}) {
    const Trajectory piece = line(from, from + 0.05, 0.01);
    truth.insert(truth.end(), piece.begin(), piece.end());
  }
  CHECK(coverage(line(0.0, 3.0, 0.1), truth) == doctest::Approx(1.0));
  CHECK(coverage(line(0.0, 2.6, 0.1), truth) == doctest::Approx(2.05 / 2.15));
  CHECK(coverage({}, truth) == 0.0);
}

}  // namespace
}  // namespace ear::evaluation
