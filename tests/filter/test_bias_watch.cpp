#include "filter/health/bias_watch.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace ear;
using Vector6 = BiasChange::Vector6;

namespace {

constexpr double kDt = 1.0 / 30.0;
constexpr TimeNs kStep = 33'333'333;

BiasChanges changes_by(const Vector6& correction, const Vector6& lowered, bool by_images) {
  BiasChanges changes;
  changes.all.add(correction, lowered);
  if (by_images) changes.by_images = changes.all;
  return changes;
}

/// A scalar filter for each bias, as simple as can be: the bias is measured in every frame, with noise; it walks.
class Tracker {
 public:
  Tracker(double walk, double noise) : walk_(walk), noise_(noise) {}

  ImuFault step(const Vector6& truth, std::mt19937_64& rng) {
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
    return watch_.judge(changes_by(correction, lowered, true), t_ns_, true);
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
    const ImuFault verdict = tracker.step(truth, rng);
    jumps += verdict.gyro || verdict.accel ? 1 : 0;
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
    ImuFault verdict;
    while (!verdict.gyro && !verdict.accel && frames < 300) {
      verdict = tracker.step(truth, rng);
      ++frames;
    }
    CHECK(frames * kDt < 0.5);
    CHECK(verdict.accel == accel);
    CHECK(verdict.gyro != accel);
  }
}

TEST_CASE("bias_watch: what was reported is not reported again") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 1.0;
  CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4), false), kStep, true).gyro);
  CHECK_FALSE(watch.judge(BiasChanges{}, 2 * kStep, true).gyro);
}

TEST_CASE("bias_watch: what another source misled does not count") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 0.03;  // three standard deviations
  const BiasChanges little = changes_by(correction, Vector6::Constant(1e-4), false);
  CHECK_FALSE(watch.judge(little, kStep, true).gyro);
  BiasChanges restarted;
  restarted.restarted = true;
  CHECK_FALSE(watch.judge(restarted, 2 * kStep, true).gyro);
  correction(0) = 0.06 * 1.05;  // just over six, alone; with the first part it would be as much too
  CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4), false), 3 * kStep, true).gyro);
}

TEST_CASE("bias_watch: without an image it takes twice as much") {
  for (const bool image : {true, false}) {
    BiasWatch watch;
    Vector6 correction = Vector6::Zero();
    correction(0) = 0.1;  // ten standard deviations
    CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4), false), kStep, image).gyro == image);
    correction(0) = 0.13;
    CHECK(watch.judge(changes_by(correction, Vector6::Constant(1e-4), false), 100 * kStep, image).gyro);
  }
}
