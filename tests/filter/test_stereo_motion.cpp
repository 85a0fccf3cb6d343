// Motion between two frames from stereo features, and whether frames agree with a motion.
#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "filter/ekf/so3.h"
#include "filter/sources/cameras/frame_check.h"
#include "filter/sources/cameras/stereo_motion.h"

using namespace ear;

namespace {

constexpr double kSigma = 0.5 / 385.0;
const Gate kGate(0.997, 2);

CameraState cameras() {
  CameraState c;
  c.T_BC0.R << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // z forward
  c.T_BC0.p = {0.1, 0.05, 0.02};
  c.T_C0C1.R = exp_so3({0.002, -0.001, 0.003});
  c.T_C0C1.p = {0.1, 0.001, -0.002};
  return c;
}

struct Pair {
  FeatureFrame from, to;
};

/// Points 1.5 to 8 m ahead, seen before and after a motion; `sigma`: noise of every observation.
Pair look(const Eigen::Matrix3d& R_B0B1, const Eigen::Vector3d& p_B0B1, double sigma, unsigned seed) {
  std::mt19937_64 rng{seed};
  std::uniform_real_distribution<double> side(-0.5, 0.5), depth(1.5, 8.0);
  std::normal_distribution<double> noise(0.0, sigma);
  const CameraState c = cameras();
  Pair pair;
  for (std::uint64_t id = 1; id <= 100; ++id) {
    const double z = depth(rng);
    const Eigen::Vector3d p_C0(side(rng) * z, side(rng) * z, z);
    const Eigen::Vector3d p_B0 = c.T_BC0.R * p_C0 + c.T_BC0.p;
    const auto see = [&](const Eigen::Vector3d& p_B) {
      const Eigen::Vector3d left = c.T_BC0.R.transpose() * (p_B - c.T_BC0.p);
      const Eigen::Vector3d right = c.T_C0C1.R.transpose() * (left - c.T_C0C1.p);
      const auto noisy = [&](const Eigen::Vector3d& p) {
        const double du = sigma > 0.0 ? noise(rng) : 0.0;
        const double dv = sigma > 0.0 ? noise(rng) : 0.0;
        return Eigen::Vector2d(p.hnormalized() + Eigen::Vector2d(du, dv));
      };
      FeatureObservation o;
      o.id = id;
      o.left = noisy(left);
      o.right = noisy(right);
      o.has_right = true;
      return o;
    };
    pair.from.features.push_back(see(p_B0));
    pair.to.features.push_back(see(R_B0B1.transpose() * (p_B0 - p_B0B1)));
  }
  return pair;
}

std::vector<StereoMatch> matched(const Pair& pair) { return StereoMatches().find(pair.from, pair.to, cameras()); }

const Eigen::Vector3d kTurn(0.02, -0.01, 0.05);
const Eigen::Vector3d kWay(0.15, -0.02, 0.03);

}  // namespace

TEST_CASE("stereo motion: without noise it is exact, from a start that knows nothing") {
  const Pair pair = look(exp_so3(kTurn), kWay, 0.0, 1);
  const auto motion = stereo_motion(matched(pair), cameras(), Pose{}, kSigma);
  REQUIRE(motion);
  CHECK((motion->T_B0B1.p - kWay).norm() < 1e-9);
  CHECK(log_so3(motion->T_B0B1.R.transpose() * exp_so3(kTurn)).norm() < 1e-9);
  CHECK(motion->fitting == 100);
}

TEST_CASE("stereo motion: what is known of the lenses' errors is taken out of the coordinates") {
  // By hand: a focal length of 1 % more puts (0.5, -0.2) at (0.505, -0.202), a principal point 0.01 further right at
  // 0.515.
  const LensError longer{0.01, {0.01, 0.0}};
  CHECK((longer.measured({0.5, -0.2}) - Eigen::Vector2d(0.515, -0.202)).norm() < 1e-12);
  CHECK((longer.corrected({0.515, -0.202}) - Eigen::Vector2d(0.5, -0.2)).norm() < 1e-12);

  const std::array<LensError, 2> lenses = {longer, {-0.004, {0.0, -0.006}}};
  Pair pair = look(exp_so3(kTurn), kWay, 0.0, 1);
  for (FeatureFrame* const frame : {&pair.from, &pair.to}) {
    for (FeatureObservation& feature : frame->features) {
      feature.left = lenses[0].measured(feature.left);
      feature.right = lenses[1].measured(feature.right);
    }
  }
  StereoMatches matches;
  CameraState known = cameras();
  known.lens_error = lenses;
  const auto motion = stereo_motion(matches.find(pair.from, pair.to, known), cameras(), Pose{}, kSigma);
  REQUIRE(motion);
  CHECK((motion->T_B0B1.p - kWay).norm() < 1e-9);
}

TEST_CASE("stereo motion: a right camera that is not where the calibration says is no turn of a vehicle that stands") {
  Pair pair = look(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), 0.0, 5);
  for (FeatureFrame* const frame : {&pair.from, &pair.to}) {
    for (FeatureObservation& feature : frame->features) feature.right += Eigen::Vector2d(0.002, 0.003);
  }
  const auto motion = stereo_motion(matched(pair), cameras(), Pose{}, kSigma);
  REQUIRE(motion);
  CHECK(motion->T_B0B1.p.norm() < 1e-9);
  CHECK(log_so3(motion->T_B0B1.R).norm() < 1e-9);
}

TEST_CASE("stereo motion: with noise the error is about what the covariance says") {
  double sum = 0.0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Pair pair = look(exp_so3(kTurn), 0.2 * kWay, kSigma, seed);
    const auto motion = stereo_motion(matched(pair), cameras(), Pose{}, kSigma);
    REQUIRE(motion);
    const Eigen::Vector3d e = motion->T_B0B1.p - 0.2 * kWay;
    sum += e.dot(motion->p_covariance().ldlt().solve(e)) / 100.0;
  }
  CHECK(sum > 1.5);
  CHECK(sum < 7.0);  // 3, and what the depths share that the sums take as independent
}

TEST_CASE("stereo motion: from a start that is metres off it is the same as from the truth") {
  const Eigen::Vector3d turn(-0.05, 0.08, 0.1), way(1.2, 0.1, -0.05);
  for (unsigned seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 rng{seed};
    std::normal_distribution<double> normal;
    const auto off = [&](double size) {
      const double a = normal(rng), b = normal(rng), c = normal(rng);
      return Eigen::Vector3d(size * Eigen::Vector3d(a, b, c).normalized());
    };
    const Pose start{exp_so3(turn) * exp_so3(off(0.6)), way + off(2.5)};
    const std::vector<StereoMatch> matches = matched(look(exp_so3(turn), way, kSigma, seed));
    const auto motion = stereo_motion(matches, cameras(), start, kSigma);
    const auto from_truth = stereo_motion(matches, cameras(), {exp_so3(turn), way}, kSigma);
    REQUIRE(from_truth);
    REQUIRE(motion);
    CHECK((motion->T_B0B1.p - from_truth->T_B0B1.p).norm() < 1e-3);
    CHECK(log_so3(motion->T_B0B1.R.transpose() * from_truth->T_B0B1.R).norm() < 1e-3);
  }
}

TEST_CASE("stereo motion: a third of the features on something that moves does not lead it astray") {
  Pair pair = look(exp_so3(kTurn), kWay, kSigma, 3);
  for (std::size_t i = 0; i < 30; ++i) {
    pair.to.features[i].left.x() += 0.05;
    pair.to.features[i].right.x() += 0.05;
  }
  const auto motion = stereo_motion(matched(pair), cameras(), Pose{}, kSigma);
  REQUIRE(motion);
  CHECK((motion->T_B0B1.p - kWay).norm() < 0.03);
}

TEST_CASE("stereo motion: images the wrong way round tell nothing") {
  Pair pair = look(exp_so3(kTurn), kWay, kSigma, 4);
  for (FeatureFrame* frame : {&pair.from, &pair.to}) {
    for (FeatureObservation& o : frame->features) std::swap(o.left, o.right);
  }
  CHECK_FALSE(stereo_motion(matched(pair), cameras(), Pose{}, kSigma));
}

TEST_CASE("frame check: the right motion fits, a wrong one does not") {
  const Pair pair = look(exp_so3(kTurn), kWay, kSigma, 5);
  const FrameCheck check(kSigma, 1.0);
  const FrameAgreement right = check.compare(matched(pair), {exp_so3(kTurn), kWay}, 0.0, cameras(), kGate);
  CHECK(right.matches == 100);
  CHECK(right.left < 0.05);
  CHECK(right.right < 0.05);
  const FrameAgreement wrong = check.compare(matched(pair), Pose{}, 0.0, cameras(), kGate);
  CHECK(wrong.left > 0.9);
}

namespace {

/// An excess in many draws: its mean, and the mean square of its error over what it states.
struct Draws {
  static constexpr unsigned kCount = 50;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double squares = 0.0;

  void add(const Excess& found, const Eigen::Vector3d& truth) {
    mean += found.value / kCount;
    const Eigen::Vector3d e = found.value - truth;
    squares += e.dot(found.covariance.ldlt().solve(e)) / kCount;
  }
};

}  // namespace

TEST_CASE("frame check: what turns a little more than predicted shows in the turn, not in the share") {
  const Eigen::Vector3d more(0.0005, -0.0003, 0.0007);
  const FrameCheck check(kSigma, 1.0);
  const Eigen::Matrix3d p_is_known = Eigen::Matrix3d::Identity() * 1e-10;
  Draws draws;
  for (unsigned seed = 0; seed < Draws::kCount; ++seed) {
    const Pair pair = look(exp_so3(kTurn) * exp_so3(more), 0.2 * kWay, kSigma, seed);
    CHECK(check.compare(matched(pair), {exp_so3(kTurn), 0.2 * kWay}, 0.0, cameras(), kGate).left < 0.1);
    const auto motion = stereo_motion(matched(pair), cameras(), Pose{}, kSigma);
    REQUIRE(motion);
    const Excess turn = turn_beyond(*motion, {exp_so3(kTurn), 0.2 * kWay}, p_is_known);
    CHECK(turn.covariance.trace() < motion->covariance.topLeftCorner<3, 3>().trace());
    draws.add(turn, more);
  }
  CHECK((draws.mean - more).norm() < 2e-4);
  CHECK(draws.squares > 1.5);
  CHECK(draws.squares < 9.0);  // 3 times what ImuScore multiplies the covariance by
}

TEST_CASE("frame check: what moves a little more than predicted shows in the way, the better the turn is known") {
  const Eigen::Vector3d more(0.02, -0.01, 0.015);
  Draws draws;
  for (unsigned seed = 0; seed < Draws::kCount; ++seed) {
    const Pair pair = look(exp_so3(kTurn), 0.2 * kWay + more, kSigma, seed);
    const auto motion = stereo_motion(matched(pair), cameras(), Pose{}, kSigma);
    REQUIRE(motion);
    const Excess way = way_beyond(*motion, {exp_so3(kTurn), 0.2 * kWay}, 1e-12);
    CHECK(way.covariance.trace() < motion->p_covariance().trace());
    CHECK(way_beyond(*motion, {exp_so3(kTurn), 0.2 * kWay}, 1.0).covariance.isApprox(motion->p_covariance(), 0.1));
    draws.add(way, more);
  }
  CHECK((draws.mean - more).norm() < 2e-3);
  CHECK(draws.squares > 1.5);
  CHECK(draws.squares < 9.0);  // 3 times what ImuScore multiplies the covariance by
}

TEST_CASE("frame check: a displacement that is predicted wrongly shows as a turn, as often as is stated") {
  const Pair pair = look(exp_so3(kTurn), 0.2 * kWay, kSigma, 1);
  const auto motion = stereo_motion(matched(pair), cameras(), Pose{}, kSigma);
  REQUIRE(motion);
  constexpr double kOff = 0.02;  // [m] standard deviation, each axis
  const Eigen::Matrix3d known = Eigen::Matrix3d::Identity() * kOff * kOff;
  const Excess right = turn_beyond(*motion, {exp_so3(kTurn), 0.2 * kWay}, known);
  std::mt19937_64 rng{2};
  std::normal_distribution<double> normal(0.0, kOff);
  constexpr int kDraws = 4000;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector3d off = Eigen::Vector3d::NullaryExpr([&] { return normal(rng); });
    const Excess wrong = turn_beyond(*motion, {exp_so3(kTurn), 0.2 * kWay + off}, known);
    scatter += (wrong.value - right.value) * (wrong.value - right.value).transpose() / kDraws;
  }
  CHECK((scatter - right.by_prediction).norm() < 0.1 * scatter.norm());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> rest(right.covariance - right.by_prediction);
  CHECK(rest.eigenvalues().minCoeff() > 0.0);
}

TEST_CASE("frame check: swapped images are seen at once") {
  Pair pair = look(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), kSigma, 6);
  const FrameCheck check(kSigma, 1.0);
  CHECK(check.share_behind(pair.to, cameras()) == 0.0);
  for (FeatureObservation& o : pair.to.features) std::swap(o.left, o.right);
  CHECK(check.share_behind(pair.to, cameras()) > 0.9);
}
