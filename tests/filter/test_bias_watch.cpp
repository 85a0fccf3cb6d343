#include "filter/health/bias_watch.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace ear;
using Vector6 = BiasChanges::Vector6;

namespace {

constexpr double kDt = 1.0 / 30.0;
constexpr TimeNs kStep = 33'333'333;

BiasChanges changes_by(const Vector6& correction, const Vector6& lowered) {
  BiasChanges changes;
  changes.add(correction, lowered);
  return changes;
}

/// A scalar filter for each bias, as simple as can be: the bias is measured in every frame, with noise; it walks.
class Tracker {
 public:
  Tracker(double walk, double noise) : walk_(walk), noise_(noise) {}

  BiasJump step(const Vector6& truth, std::mt19937_64& rng) {
    std::normal_distribution<double> normal;
    Vector6 correction, lowered;
    for (int i = 0; i < 6; ++i) {
      variance_(i) += walk_ * walk_ * kDt;
      const double gain = variance_(i) / (variance_(i) + noise_ * noise_);
      correction(i) = gain * (truth(i) + noise_ * normal(rng) - bias_(i));
      lowered(i) = gain * variance_(i);
      bias_(i) += correction(i);
      variance_(i) -= lowered(i);
    }
    t_ns_ += kStep;
    const BiasJump jump = watch_.judge(changes_by(correction, lowered), t_ns_);
    variance_.head<3>().array() += jump.gyro * jump.gyro;
    variance_.tail<3>().array() += jump.accel * jump.accel;
    return jump;
  }

 private:
  double walk_, noise_;
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
    for (int k = 0; k < 6; ++k) truth(k) += 1e-3 * std::sqrt(kDt) * normal(rng);
    jumps += tracker.step(truth, rng).any() ? 1 : 0;
  }
  CHECK(jumps == 0);
}

TEST_CASE("bias_watch: a jump of either sensor is found within half a second, and whose is reported") {
  std::mt19937_64 rng{62};
  for (const bool accel : {false, true}) {
    CAPTURE(accel);
    Tracker tracker(1e-3, 0.1);
    Vector6 truth = Vector6::Zero();
    for (int i = 0; i < 300; ++i) (void)tracker.step(truth, rng);
    truth(accel ? 4 : 1) = 0.5;
    int frames = 0;
    BiasJump found;
    while (!found.fault.any() && frames < 300) {
      found = tracker.step(truth, rng);
      ++frames;
    }
    CHECK(frames * kDt < 0.5);
    CHECK(found.fault.accel == accel);
    CHECK(found.fault.gyro != accel);
    CHECK((accel ? found.accel : found.gyro) < 0.6);  // no more than there is
  }
}

TEST_CASE("bias_watch: what was found is not found again") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 1.0;
  CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), kStep).gyro == doctest::Approx(1.0));
  CHECK_FALSE(watch.judge(BiasChanges{}, 2 * kStep).any());
}

TEST_CASE("bias_watch: what another source misled does not count") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 0.03;  // three standard deviations
  CHECK_FALSE(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), kStep).any());
  BiasChanges restarted;
  restarted.restarted = true;
  CHECK_FALSE(watch.judge(restarted, 2 * kStep).any());
  correction(0) = 0.06 * 1.05;  // just over six, alone; with the first part it would be as much too
  CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), 3 * kStep).any());
}

TEST_CASE("bias_watch: stamps may be negative") {
  constexpr TimeNs start_ns = -10'000'000'000;
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 0.03;  // three standard deviations
  CHECK_FALSE(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), start_ns).any());
  correction(0) = 0.06 * 1.05;
  CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4)), start_ns + kStep).any());
}

TEST_CASE("bias_watch: small jumps widen the covariance, and report no fault") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction << 1e-3, 0.0, 0.0, 0.0, 0.05, 0.0;
  const BiasJump small = watch.judge(changes_by(correction, Vector6::Constant(1e-12)), kStep);
  CHECK(small.any());
  CHECK_FALSE(small.fault.any());
  const BiasJump large = watch.judge(changes_by(20.0 * correction, Vector6::Constant(1e-12)), 2 * kStep);
  CHECK(large.fault.gyro);
  CHECK(large.fault.accel);
}
