#include "filter/health/bias_watch.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "tests/support/about.h"

using namespace ear;
using ear::test::about;
using Vector6 = BiasChanges::Vector6;

namespace {

constexpr double kDt = 1.0 / 30.0;
constexpr TimeNs kStep = 33'333'333;

/// An update of independent biases; `left`: their variances after it.
BiasChanges changes_by(const Vector6& correction, const Vector6& lowered, const Vector6& left = Vector6::Zero()) {
  BiasChanges changes;
  changes.add(correction, lowered.asDiagonal());
  changes.left = left.asDiagonal();
  return changes;
}

bool any(const BiasJump& jump) { return !jump.size.isZero(); }

/// A scalar filter for each bias, as simple as can be: the bias is measured in every frame, with noise; it walks.
/// Gyroscope: a tenth of both.
class Tracker {
 public:
  Tracker(double walk, double noise) : walk_(bias_sigma(0.1 * walk, walk)), noise_(bias_sigma(0.1 * noise, noise)) {}

  [[nodiscard]] const Vector6& bias() const { return bias_; }

  BiasJump step(const Vector6& truth, std::mt19937_64& rng) {
    std::normal_distribution<double> normal;
    Vector6 correction, lowered;
    for (int i = 0; i < 6; ++i) {
      variance_(i) += walk_(i) * walk_(i) * kDt;
      const double gain = variance_(i) / (variance_(i) + noise_(i) * noise_(i));
      correction(i) = gain * (truth(i) + noise_(i) * normal(rng) - bias_(i));
      lowered(i) = gain * variance_(i);
      bias_(i) += correction(i);
      variance_(i) -= lowered(i);
    }
    t_ns_ += kStep;
    const BiasJump jump = watch_.judge(changes_by(correction, lowered, variance_), t_ns_);
    variance_ += jump.size.cwiseAbs2();
    return jump;
  }

 private:
  Vector6 walk_, noise_;
  Vector6 bias_ = Vector6::Zero();
  Vector6 variance_ = Vector6::Constant(1.0);
  BiasWatch watch_;
  TimeNs t_ns_ = 0;
};

}  // namespace

TEST_CASE("bias_watch: biases that walk as expected do not jump, in an hour") {
  std::mt19937_64 rng{61};
  std::normal_distribution<double> normal;
  Tracker tracker(1e-3, 0.1);
  Vector6 truth = Vector6::Zero();
  int jumps = 0;
  for (int i = 0; i < 30 * 3600; ++i) {
    for (int k = 0; k < 6; ++k) truth(k) += (k < 3 ? 1e-4 : 1e-3) * std::sqrt(kDt) * normal(rng);
    jumps += any(tracker.step(truth, rng)) ? 1 : 0;
  }
  CHECK(jumps == 0);
}

TEST_CASE("bias_watch: half a second after a jump of either sensor the bias is found, and whose is reported") {
  std::mt19937_64 rng{62};
  for (const bool accel : {false, true}) {
    CAPTURE(accel);
    Tracker tracker(1e-3, 0.1);
    Vector6 truth = Vector6::Zero();
    for (int i = 0; i < 300; ++i) (void)tracker.step(truth, rng);
    const int axis = accel ? 4 : 1;
    truth(axis) = accel ? 0.5 : 0.05;
    ImuFault fault;
    for (double t = 0.0; t < 0.5; t += kDt) {
      const BiasJump now = tracker.step(truth, rng);
      fault = {fault.gyro || now.fault.gyro, fault.accel || now.fault.accel};
    }
    CHECK(fault.accel == accel);
    CHECK(fault.gyro != accel);
    CHECK(tracker.bias()(axis) == about(truth(axis), 0.25));
  }
}

// Updates by what is correlated: a jump of one bias corrects the other too.
TEST_CASE("bias_watch: the size of a jump is the one that would have made the corrections") {
  using Matrix6 = BiasChanges::Matrix6;
  Matrix6 A, H;
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) {
      A(i, k) = std::sin(3.0 + i + 2.7 * k);
      H(i, k) = 1e3 * std::cos(1.0 + 2.0 * i * k + k);
    }
  }
  const Matrix6 P = 1e-4 * (A * A.transpose() + 0.1 * Matrix6::Identity());
  const Matrix6 K = P * H.transpose() * (H * P * H.transpose() + Matrix6::Identity()).inverse();
  Vector6 jump;
  jump << 0.02, -0.01, 0.03, 0.2, 0.1, -0.15;
  BiasChanges changes;
  changes.add(K * H * jump, K * H * P);
  changes.left = P - K * H * P;
  const BiasJump found = BiasWatch().judge(changes, kStep);
  for (int i = 0; i < 6; ++i) {
    CAPTURE(i);
    CHECK(found.size(i) > 0.95 * std::abs(jump(i)));  // with how well it is known
    CHECK(found.size(i) < 1.3 * std::abs(jump(i)) + 0.01);
  }
}

TEST_CASE("bias_watch: what was found is not found again") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 0.1;
  CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), kStep).size(0) == about(0.1, 0.02));
  CHECK_FALSE(any(watch.judge(BiasChanges{}, 2 * kStep)));
}

TEST_CASE("bias_watch: what another source misled does not count") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 0.03;  // three standard deviations
  CHECK_FALSE(any(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), kStep)));
  CHECK_FALSE(any(watch.judge(BiasChanges::discarded(), 2 * kStep)));
  CHECK_FALSE(any(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), 3 * kStep)));
  CHECK(any(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), 4 * kStep)));  // twice is more than four
}

TEST_CASE("bias_watch: stamps may be negative") {
  constexpr TimeNs start_ns = -10'000'000'000;
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  CHECK_FALSE(any(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), start_ns)));
  correction(0) = 0.03;  // three standard deviations
  CHECK_FALSE(any(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), start_ns + kStep)));
  CHECK(any(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), start_ns + 2 * kStep)));
}

TEST_CASE("bias_watch: small jumps widen the covariance, and report no fault") {
  Vector6 correction = Vector6::Zero();
  correction << 1e-3, 0.0, 0.0, 0.0, 0.05, 0.0;
  const BiasJump small = BiasWatch().judge(changes_by(correction, Vector6::Constant(1e-12)), kStep);
  CHECK(any(small));
  CHECK_FALSE(small.fault.any());
  const BiasJump large = BiasWatch().judge(changes_by(20.0 * correction, Vector6::Constant(1e-12)), kStep);
  CHECK(large.fault.gyro);
  CHECK(large.fault.accel);
}

// A start in motion, whose guess was wrong.
TEST_CASE("bias_watch: a bias that was not known moves without a fault") {
  Vector6 correction = Vector6::Zero();
  correction(4) = 0.15;
  const BiasJump jump =
      BiasWatch().judge(changes_by(correction, Vector6::Constant(1e-3), Vector6::Constant(1e-3)), kStep);
  CHECK(any(jump));
  CHECK_FALSE(jump.fault.accel);
}
