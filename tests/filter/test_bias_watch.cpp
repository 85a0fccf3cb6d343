#include "filter/health/bias_watch.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace ear;
using Vector6 = BiasWatch::Vector6;

namespace {

constexpr double kDt = 1.0 / 30.0;

/// A scalar filter for each bias, as simple as can be: the bias is measured in every frame, with noise; it walks.
class Tracker {
 public:
  Tracker(double walk, double noise) : walk_(walk), noise_(noise) {}

  BiasWatch::Verdict step(const Vector6& truth, std::mt19937_64& rng) {
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
    watch_.add(correction, lowered, true);
    return watch_.judge(kDt);
  }

 private:
  double walk_, noise_;
  Vector6 bias_ = Vector6::Zero();
  Vector6 variance_ = Vector6::Constant(1.0);
  BiasWatch watch_;
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
    const BiasWatch::Verdict verdict = tracker.step(truth, rng);
    jumps += verdict.gyro || verdict.accel ? 1 : 0;
  }
  CHECK(jumps == 0);
}

TEST_CASE("bias_watch: a jump of either sensor is found within half a second, and it is said whose") {
  std::mt19937_64 rng{62};
  for (const bool accel : {false, true}) {
    CAPTURE(accel);
    Tracker tracker(1e-3, 0.1);
    Vector6 truth = Vector6::Zero();
    for (int i = 0; i < 300; ++i) (void)tracker.step(truth, rng);
    truth(accel ? 4 : 1) = 0.5;
    int frames = 0;
    BiasWatch::Verdict verdict;
    while (!verdict.gyro && !verdict.accel && frames < 300) {
      verdict = tracker.step(truth, rng);
      ++frames;
    }
    CHECK(frames * kDt < 0.5);
    CHECK(verdict.accel == accel);
    CHECK(verdict.gyro != accel);
  }
}

TEST_CASE("bias_watch: what was said is not said again") {
  BiasWatch watch;
  Vector6 correction = Vector6::Zero();
  correction(0) = 1.0;
  watch.add(correction, Vector6::Constant(1e-4), false);
  CHECK(watch.judge(kDt).gyro);
  CHECK_FALSE(watch.judge(kDt).gyro);
}
