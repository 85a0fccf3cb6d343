#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "frontend/flow_check.h"
#include "frontend/motion_of_flows.h"

namespace ear {
namespace {

constexpr double kPixel = 1.0 / 400.0;  // of a usual camera, in normalized coordinates

struct Example {
  std::vector<Flow> flows;
  std::vector<bool> moves;  // by itself
  Transfer motion;
};

// 100 points 1 to 6 m away with half a pixel of noise. Every fourth moves by itself, together, as a person would.
Example make_example(bool with_depth, double angle, const Eigen::Vector3d& p_10, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.2 * kPixel);
  Example example;
  example.motion.R_10 = Eigen::AngleAxisd(angle, Eigen::Vector3d(0.2, 0.9, 0.4).normalized()).toRotationMatrix();
  example.motion.p_10 = p_10;
  for (int i = 0; i < 100; ++i) {
    Flow flow;
    flow.x0 = 0.6 * Eigen::Vector2d(uniform(random), uniform(random));
    flow.inverse_depth0 = 1.0 / (3.5 + 2.5 * uniform(random));
    Eigen::Vector3d point = example.motion.scaled_point(flow.x0, flow.inverse_depth0);
    const bool moves = i % 4 == 0;
    if (moves) point += flow.inverse_depth0 * Eigen::Vector3d(0.05, 0.15, 0.0);
    flow.x1 = point.hnormalized() + Eigen::Vector2d(noise(random), noise(random));
    flow.has_depth = with_depth;
    flow.inverse_depth_sigma = 0.02;
    if (!with_depth) flow.inverse_depth0 = 0.0;
    example.flows.push_back(flow);
    example.moves.push_back(moves);
  }
  return example;
}

struct Score {
  int kept_static = 0;
  int kept_moving = 0;
};

Score score(const Example& example, const std::vector<std::uint8_t>& inliers) {
  REQUIRE(inliers.size() == example.flows.size());
  Score s;
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    if (inliers[i]) ++(example.moves[i] ? s.kept_moving : s.kept_static);
  }
  return s;
}

}  // namespace

TEST_CASE("flow check: with depth, what moves by itself is found, whatever is known of the motion") {
  const Example example = make_example(true, 0.1, {0.1, -0.02, 0.15}, 1);
  FlowCheck check(2.0 * kPixel);
  SUBCASE("all known") {
    const Score s = score(example, check.find(example.flows, {example.motion, true, true}).inliers);
    CHECK(s.kept_static == 75);
    CHECK(s.kept_moving == 0);
  }
  SUBCASE("rotation known") {
    const Consensus c = check.find(example.flows, {{example.motion.R_10, Eigen::Vector3d::Zero()}, true, false});
    const Score s = score(example, c.inliers);
    CHECK(s.kept_static == 75);
    CHECK(s.kept_moving == 0);
    REQUIRE(c.metric);
    CHECK((c.motion.p_10 - example.motion.p_10).norm() < 0.003);
  }
  SUBCASE("rotation known, but a gyroscope whose bias has jumped: off by a dozen pixels") {
    for (int axis = 0; axis < 3; ++axis) {
      CAPTURE(axis);
      const Eigen::AngleAxisd off(12.0 * kPixel, Eigen::Vector3d::Unit(axis));
      const Eigen::Matrix3d R_10 = example.motion.R_10 * off.toRotationMatrix();
      const Consensus c = check.find(example.flows, {{R_10, Eigen::Vector3d::Zero()}, true, false});
      const Score s = score(example, c.inliers);
      CHECK(s.kept_static == 75);
      CHECK(s.kept_moving == 0);
      REQUIRE(c.metric);
      CHECK((c.motion.R_10 - example.motion.R_10).norm() < 0.003);
    }
  }
  SUBCASE("nothing known") {
    const Consensus c = check.find(example.flows, {});
    const Score s = score(example, c.inliers);
    CHECK(s.kept_static == 75);
    CHECK(s.kept_moving == 0);
    CHECK((c.motion.R_10 - example.motion.R_10).norm() < 0.003);
  }
  SUBCASE("the prediction is wrong") {
    const Transfer wrong{Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX()) * example.motion.R_10, {0.0, 0.2, 0.0}};
    const Score s = score(example, check.find(example.flows, {wrong, true, true}).inliers);
    CHECK(s.kept_static >= 74);
    CHECK(s.kept_moving == 0);
  }
}

TEST_CASE("flow check: without depth, what leaves its epipolar plane is found") {
  const Example example = make_example(false, 0.1, {0.3, 0.0, 0.05}, 2);
  FlowCheck check(2.0 * kPixel);
  const Transfer rotation{example.motion.R_10, Eigen::Vector3d::Zero()};
  const Consensus turned = check.find(example.flows, {rotation, true, false});
  CHECK_FALSE(turned.metric);
  const Score known = score(example, turned.inliers);
  CHECK(known.kept_static >= 73);
  CHECK(known.kept_moving <= 2);
  const Score unknown = score(example, check.find(example.flows, {}).inliers);
  CHECK(unknown.kept_static >= 70);
  CHECK(unknown.kept_moving <= 5);
}

TEST_CASE("flow check: without depth, a gyroscope that is off by two pixels costs few features") {
  const Example example = make_example(false, 0.1, {0.3, 0.0, 0.05}, 2);
  FlowCheck check(2.0 * kPixel);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::AngleAxisd off(2.0 * kPixel, Eigen::Vector3d::Unit(axis));
    const Eigen::Matrix3d R_10 = example.motion.R_10 * off.toRotationMatrix();
    const Score s = score(example, check.find(example.flows, {{R_10, Eigen::Vector3d::Zero()}, true, false}).inliers);
    CHECK(s.kept_static >= 73);
    CHECK(s.kept_moving <= 5);
  }
}

TEST_CASE("flow check: turn and direction of flows without depth, from a guess on, to the last digit") {
  for (const unsigned seed : {5U, 6U, 7U}) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const Eigen::Vector3d axis = Eigen::Vector3d(uniform(random), uniform(random), uniform(random)).normalized();
    const Transfer motion{Eigen::AngleAxisd(0.2, axis).toRotationMatrix(),
                          Eigen::Vector3d(uniform(random), uniform(random), uniform(random)).normalized()};
    std::vector<Flow> flows(20);
    for (Flow& flow : flows) {
      flow.x0 = 0.6 * Eigen::Vector2d(uniform(random), uniform(random));
      flow.x1 = motion.scaled_point(flow.x0, 0.15 + 0.05 * uniform(random)).hnormalized();
    }
    const Transfer guess{Eigen::AngleAxisd(0.15, axis).toRotationMatrix(), Eigen::Vector3d::Zero()};
    const auto found = refine_turn(flows, std::vector<std::uint8_t>(flows.size(), 1), guess, 6);
    REQUIRE(found);
    CHECK((found->R_10 - motion.R_10).norm() < 1e-7);
    CHECK(found->p_10.cross(motion.p_10).norm() < 1e-6);
    CHECK(found->p_10.norm() == doctest::Approx(1.0));
  }
}

TEST_CASE("flow check: a camera that stands or only turns keeps all of a static scene") {
  for (const double angle : {0.0, 0.2}) {
    for (const bool with_depth : {false, true}) {
      for (const bool rotation_known : {false, true}) {
        CAPTURE(angle);
        CAPTURE(with_depth);
        CAPTURE(rotation_known);
        Example example = make_example(with_depth, angle, Eigen::Vector3d::Zero(), 3);
        for (std::size_t i = 0; i < example.flows.size(); ++i) {
          if (example.moves[i])
            example.flows[i].x1 = (example.motion.R_10 * example.flows[i].x0.homogeneous()).hnormalized();
        }
        FlowCheck check(2.0 * kPixel);
        const Transfer guess = rotation_known ? example.motion : Transfer{};
        const auto inliers = check.find(example.flows, {guess, rotation_known, false}).inliers;
        int kept = 0;
        for (const auto flag : inliers) kept += flag;
        CHECK(kept >= 97);
      }
    }
  }
}

TEST_CASE("flow check: too few flows say nothing") {
  Example example = make_example(true, 0.0, {0.1, 0.0, 0.0}, 4);
  example.flows.resize(5);
  const Consensus unknown = FlowCheck(kPixel).find(example.flows, {});
  CHECK(unknown.inliers == std::vector<std::uint8_t>(5, 0));
  CHECK_FALSE(unknown.metric);
  CHECK(FlowCheck(kPixel).find(example.flows, {{}, true, false}).inliers == std::vector<std::uint8_t>(5, 1));
  CHECK(FlowCheck(kPixel).find({}, {}).inliers.empty());
}

TEST_CASE("flow check: what stands still in the image of a camera that turns is not of the scene") {
  const Eigen::Matrix3d R_10 = Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY()).toRotationMatrix();  // 12 px
  for (const int number : {5, 40}) {
    CAPTURE(number);
    std::vector<Flow> flows;
    for (int i = 0; i < number; ++i) {
      Flow flow;
      flow.x0 = Eigen::Vector2d(0.1 * (i % 8) - 0.3, 0.1 + 0.05 * std::floor(i / 8.0));
      flow.x1 = flow.x0 + Eigen::Vector2d(0.1 * kPixel, 0.0);
      flows.push_back(flow);
    }
    const auto kept = [&](const Transfer& motion, bool translation_known) {
      const auto inliers = FlowCheck(kPixel).find(flows, {motion, true, translation_known}).inliers;
      return static_cast<int>(std::count(inliers.begin(), inliers.end(), 1));
    };
    CHECK(kept({R_10, {0.0, 0.001, 0.0}}, true) == 0);
    CHECK(kept({Eigen::Matrix3d::Identity(), {0.0, 0.0, -0.02}}, true) == number);  // may be far away
    CHECK(kept({R_10, {-0.02, 0.0, 0.0}}, true) >= number * 4 / 5);         // the translation makes up for the turn
    CHECK(kept({R_10, Eigen::Vector3d::Zero()}, false) >= number * 4 / 5);  // or may do so
  }
}

TEST_CASE("flow check: pure noise does not pass as a motion") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  std::vector<Flow> flows(100);
  for (Flow& flow : flows) {
    flow.x0 = {uniform(random), uniform(random)};
    flow.x1 = {uniform(random), uniform(random)};
    flow.inverse_depth0 = 0.3;
    flow.inverse_depth_sigma = 0.02;
    flow.has_depth = true;
  }
  const Consensus c = FlowCheck(2.0 * kPixel).find(flows, {{}, true, false});
  CHECK_FALSE(c.metric);
  int kept = 0;
  for (const auto flag : c.inliers) kept += flag;
  CHECK(kept < 20);
}

}  // namespace ear
