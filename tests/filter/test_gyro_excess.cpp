#include "filter/sources/gyro_excess.h"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "tests/support/turning_rig.h"

using namespace ear;

namespace {

/// Of a state that knows its bias to 1 mrad/s, the cameras' mounting and the gyroscope's axes to 1 %.
Covariance known_bias(double sigma = 1e-3) {
  Eigen::VectorXd sigmas = Eigen::VectorXd::Zero(err::clones);
  sigmas.segment<3>(err::b_g).setConstant(sigma);
  sigmas.segment<3>(err::camera).setConstant(0.004);
  sigmas.segment<9>(err::gyro_matrix).setConstant(0.01);
  Covariance P(err::clones);
  P.reset(sigmas);
  return P;
}

/// The next two frames to a state with this bias [rad/s] and time offset [s].
GyroExcess::Frame next(TurningRig& rig, const Eigen::Vector3d& b_g = Eigen::Vector3d::Zero(), double offset = 0.0) {
  GyroExcess::Frame frame{rig.next(), 0.0, b_g, offset};
  frame.turn.rate_B -= b_g;
  frame.turn.beyond_B += b_g;
  return frame;
}

/// What is found in the first so many frames, and after how many; 0 if nothing is.
struct Found {
  double off = 0.0;
  int frames = 0;
};

Found find(GyroExcess& excess, TurningRig& rig, int frames) {
  const Covariance P = known_bias();
  for (int i = 1; i <= frames; ++i) {
    excess.add(next(rig), P);
    const double off = excess.take(P);
    if (off > 0.0) return {off, i};
  }
  return {};
}

}  // namespace

TEST_CASE("gyro excess: the bias is what the state's is too large by, to within its variance") {
  const Eigen::Vector3d bias(0.03, -0.02, 0.01);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double squares = 0.0;
  constexpr int kRuns = 400;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    TurningRig rig(seed);
    GyroExcess excess;
    // The gyroscope reads too much by what its axes add, and by a bias of which the state has too much.
    rig.axes = 0.02 * Eigen::Matrix3d::Random();
    for (int i = 0; i < 150; ++i) excess.add(next(rig, bias), known_bias(0.05));
    mean += excess.bias().value / kRuns;
    squares += (excess.bias().value - bias).squaredNorm() / (3.0 * excess.bias().variance) / kRuns;
  }
  CHECK((mean - bias).norm() < 2e-3);
  // The bias may walk, but does not here: the variance is stated too large by two to three.
  CHECK(squares > 0.25);
  CHECK(squares < 1.0);
}

TEST_CASE("gyro excess: a bias that jumps is found in a few frames, however the body turns and whatever the rate") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    for (const double dt : {1.0 / 30.0, 0.1}) {
      CAPTURE(dt);
      for (const double size : {0.0, 0.3}) {
        CAPTURE(size);
        TurningRig rig(seed);
        rig.dt = dt;
        rig.size = size;
        GyroExcess excess;
        REQUIRE(find(excess, rig, static_cast<int>(5.0 / dt)).frames == 0);
        rig.bias = {0.0, 0.15, 0.0};
        const Found found = find(excess, rig, 100);
        CHECK(found.frames > 0);
        CHECK(found.frames * dt < 0.5);
        CHECK(found.off < 0.2);
        for (int i = 0; i < static_cast<int>(2.0 / dt); ++i) excess.add(next(rig), known_bias());
        // Where nothing turns, a part of it may be how the gyroscope measures a rate.
        CHECK((excess.bias().value + rig.bias).norm() < (size > 0.0 ? 0.05 : 0.075));
      }
    }
  }
}

TEST_CASE("gyro excess: sound sensors, noise, scales, axes and a clock that is off are no bias") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    const auto finds = [](TurningRig rig) {
      GyroExcess excess;
      return find(excess, rig, 3000).frames > 0;
    };
    CHECK_FALSE(finds(TurningRig(seed)));
    TurningRig noisy(seed);
    noisy.noise = 2.5;  // more than four times what is stated is not believed
    CHECK_FALSE(finds(noisy));
    TurningRig mounted(seed);  // by two degrees about all axes, and 2 % of scale
    mounted.axes << 0.02, -0.035, 0.035, 0.035, 0.02, -0.035, -0.035, 0.035, 0.02;
    CHECK_FALSE(finds(mounted));
    TurningRig late(seed);
    late.late = 0.03;
    CHECK_FALSE(finds(late));
  }
}

TEST_CASE("gyro excess: what the state learns of bias and clock is no longer beyond it") {
  TurningRig rig(4);
  rig.late = 0.03;
  GyroExcess excess;
  const Covariance P = known_bias();
  for (int i = 0; i < 150; ++i) excess.add(next(rig), P);
  rig.bias = {0.2, 0.0, -0.1};
  for (int i = 0; i < 60; ++i) excess.add(next(rig), P);
  CHECK((excess.bias().value + rig.bias).norm() < 0.05);
  CHECK(excess.take(P) > 0.15);
  rig.late = 0.0;  // so are the images by what the state has now
  excess.add(next(rig, rig.bias, 0.03), P);
  CHECK(excess.bias().value.norm() < 0.03);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    excess.add(next(rig, rig.bias, 0.03), P);
    found += i > 30 && excess.take(P) > 0.0;
  }
  CHECK(found == 0);
}

TEST_CASE("gyro excess: what the state does not know of the bias may explain it, and what frames share") {
  TurningRig rig(5);
  GyroExcess excess;
  for (int i = 0; i < 150; ++i) excess.add(next(rig), known_bias());
  rig.bias = {0.2, 0.0, 0.0};
  GyroExcess shared = excess;
  TurningRig other = rig;
  for (int i = 0; i < 30; ++i) {
    excess.add(next(rig), known_bias());
    GyroExcess::Frame frame = next(other);
    frame.lasting = 0.1 * 0.1;
    shared.add(frame, known_bias());
  }
  CHECK(shared.take(known_bias()) == 0.0);
  GyroExcess unsure = excess;
  CHECK(unsure.take(known_bias(0.1)) == 0.0);
  CHECK(excess.take(known_bias()) > 0.1);
  CHECK(excess.take(known_bias()) == 0.0);  // it was asked already
}

TEST_CASE("gyro excess: after frames that show nothing one is not enough, and what is no number is left out") {
  TurningRig rig(6);
  GyroExcess excess;
  const Covariance P = known_bias();
  for (int i = 0; i < 300; ++i) excess.add(next(rig), P);
  for (int i = 0; i < 45; ++i) (void)next(rig);  // 1.5 s
  GyroExcess::Frame wrong = next(rig);
  excess.add(wrong, P);  // does not follow the last one
  wrong = next(rig);
  wrong.turn.beyond_B.z() += 0.15;
  excess.add(wrong, P);
  CHECK(excess.take(P) == 0.0);
  const Eigen::Vector3d before = excess.bias().value;
  wrong = next(rig);
  wrong.turn.beyond_B.y() = std::numeric_limits<double>::quiet_NaN();
  excess.add(wrong, P);
  wrong = next(rig);
  wrong.turn.variance = 0.0;
  excess.add(wrong, P);
  wrong = next(rig);
  wrong.turn.rate_B.x() = std::numeric_limits<double>::infinity();
  excess.add(wrong, P);
  CHECK(excess.bias().value == before);
}
