#include "tests/smoother/support.h"

#include <Eigen/Cholesky>
#include <array>
#include <memory>
#include <vector>

#include "smoother/normal_equations.h"
#include "smoother/prior_factor.h"

using namespace ear;
using namespace ear::smoother;
using namespace ear::smoother::test;
using ear::test::random_pose;
using ear::test::random_vector;

namespace {

/// Two frames, a camera and an offset, with a random prior on all of them.
struct Blocks {
  std::array<PoseBlock, 2> pose;
  std::array<MotionBlock, 2> motion;
  PoseBlock camera;
  std::array<double, 1> offset{1e-3};

  explicit Blocks(std::mt19937_64& rng) {
    for (int i = 0; i < 2; ++i) {
      const auto k = static_cast<std::size_t>(i);
      pose[k] = to_block(random_pose(rng, 0.5, 5.0));
      Eigen::Map<Eigen::VectorXd>(motion[k].data(), 9) = random_values(rng, 9, 0.5);
    }
    camera = to_block(random_pose(rng, 0.5, 0.1));
  }

  [[nodiscard]] std::vector<PriorBlock> all() {
    std::vector<PriorBlock> blocks;
    const auto add = [&](BlockKind kind, double* block, int size, double* body_pose = nullptr) {
      blocks.push_back({kind, block, size, body_pose, Eigen::Map<Eigen::VectorXd>(block, size)});
    };
    for (std::size_t i = 0; i < 2; ++i) {
      add(BlockKind::body_pose, pose[i].data(), 7);
      add(BlockKind::motion, motion[i].data(), 9, pose[i].data());
    }
    add(BlockKind::sensor_pose, camera.data(), 7);
    add(BlockKind::additive, offset.data(), 1);
    return blocks;
  }
};

std::vector<Eigen::VectorXd> values_of(const std::vector<PriorBlock>& blocks) {
  std::vector<Eigen::VectorXd> values;
  for (const PriorBlock& block : blocks) values.push_back(block.value);
  return values;
}

constexpr int kSize = 6 + 9 + 6 + 9 + 6 + 1;

/// Yaw and position of all, as invariant errors.
Eigen::MatrixXd unobservable() {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(kSize, 4);
  for (const int at : {0, 15}) {
    N.block<3, 1>(at, 0) = Eigen::Vector3d::UnitZ();
    N.block<3, 3>(at + 3, 1).setIdentity();
  }
  return N;
}

Eigen::MatrixXd random_rows(std::mt19937_64& rng, int rows) {
  Eigen::MatrixXd J(rows, kSize);
  for (double& entry : J.reshaped()) entry = random_vector(rng, 1.0).x();
  return J;
}

}  // namespace

TEST_CASE("prior: derivatives, also away from where it was linearized") {
  std::mt19937_64 rng{21};
  Blocks blocks(rng);
  const std::vector<PriorBlock> list = blocks.all();
  const Eigen::MatrixXd J = random_rows(rng, 20);
  const PriorFactor prior(list, J, random_values(rng, 20, 1.0));
  std::vector<Eigen::VectorXd> values = values_of(list);
  for (Eigen::VectorXd& value : values)
    value = stepped(value, random_values(rng, value.size() == 7 ? 6 : static_cast<int>(value.size()), 0.1));
  check_factor(prior, values);
}

TEST_CASE("prior: one that does not know yaw and position does not know them after any motion of the whole") {
  std::mt19937_64 rng{22};
  Blocks blocks(rng);
  const std::vector<PriorBlock> list = blocks.all();
  Eigen::MatrixXd J = random_rows(rng, 20);
  const Eigen::MatrixXd N = unobservable();
  J -= J * N * (N.transpose() * N).inverse() * N.transpose();
  const PriorFactor prior(list, J, random_values(rng, 20, 1.0));
  std::vector<Eigen::VectorXd> values = values_of(list);
  const Eigen::VectorXd before = residual(prior, values);
  const Eigen::Matrix3d turn = exp_so3({0.0, 0.0, 0.7});
  const Eigen::Vector3d shift(3.0, -2.0, 1.0);
  for (const std::size_t i : {0U, 2U}) {
    const Pose pose = to_pose(values[i].data());
    values[i] = block({turn * pose.R, turn * pose.p + shift});
    values[i + 1].head<3>() = turn * values[i + 1].head<3>();
  }
  CHECK((residual(prior, values) - before).norm() < 1e-9);
}

TEST_CASE("prior: what is left after marginalizing says the same of the rest as all factors did") {
  std::mt19937_64 rng{23};
  Blocks blocks(rng);
  std::vector<PriorBlock> list = blocks.all();
  const Eigen::MatrixXd J = random_rows(rng, 60);
  Factor factor;
  factor.cost = std::make_unique<PriorFactor>(list, J, random_values(rng, 60, 1.0));
  for (const PriorBlock& b : list) factor.blocks.push_back(b.block);

  const std::vector<PriorBlock> removed(list.begin(), list.begin() + 2);
  const std::vector<PriorBlock> kept(list.begin() + 2, list.end());
  NormalEquations all(list);
  all.add(factor);
  std::unique_ptr<PriorFactor> prior = marginalize({&factor}, {}, removed, kept);
  REQUIRE(prior);
  Factor left;
  for (const PriorBlock& b : prior->blocks()) left.blocks.push_back(b.block);
  left.cost = std::move(prior);
  NormalEquations rest(kept);
  rest.add(left);

  const int m = 15;
  const Eigen::VectorXd step = all.H().ldlt().solve(-all.b());
  CHECK((rest.H().ldlt().solve(-rest.b()) - step.tail(kSize - m)).norm() < 1e-9);
  const Eigen::MatrixXd P = all.H().inverse();
  CHECK(rest.H().inverse().isApprox(P.bottomRightCorner(kSize - m, kSize - m), 1e-8));
}
