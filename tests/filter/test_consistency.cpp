#include "filter/health/consistency.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <random>

#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr std::size_t kImu = index_of(MotionSensor::imu);
constexpr std::size_t kOdometer = index_of(MotionSensor::odometer);
constexpr std::size_t kCamera = index_of(MotionSensor::camera);

Displacement at(double x, double y, double z, double sigma = 1e-3) {
  return {true, false, {x, y, z}, sigma * sigma * Eigen::Matrix3d::Identity()};
}

AnomalyConfig with(AnomalyScore score, AnomalyWeight weight = AnomalyWeight::symmetric) {
  AnomalyConfig config;
  config.score = score;
  config.weight = weight;
  config.distance = 0.01;
  config.false_alarm = 1e-3;
  config.min_weight = 0.05;
  return config;
}

double between(const Displacement& a, const Displacement& b) { return (a.p_BiBj - b.p_BiBj).norm(); }

/// (13), (14) written out, in the paper's notation.
void check_equations(const Displacements& d, const Consistency& result) {
  const Eigen::Vector3d pi = d[kImu].p_BiBj, po = d[kOdometer].p_BiBj, pc = d[kCamera].p_BiBj;
  const Eigen::Vector3d mu = (pi + po + pc) / 3.0;
  CHECK(result.variance ==
        doctest::Approx(((pi - mu).squaredNorm() + (po - mu).squaredNorm() + (pc - mu).squaredNorm()) / 3.0));
  CHECK(result.coefficient[kImu] == doctest::Approx((pi - po).norm() + (pi - pc).norm()));
  CHECK(result.coefficient[kOdometer] == doctest::Approx((pi - po).norm() + (pc - po).norm()));
  CHECK(result.coefficient[kCamera] == doctest::Approx((pc - po).norm() + (pi - pc).norm()));
}

}  // namespace

TEST_CASE("consistency: each sensor that lies is found, whichever score is used") {
  for (const AnomalyScore score : {AnomalyScore::distance, AnomalyScore::mahalanobis}) {
    const ConsistencyCheck check(with(score));
    for (std::size_t liar = 0; liar < kMotionSensors; ++liar) {
      CAPTURE(liar);
      Displacements d{at(0.100, 0.001, 0.0), at(0.101, 0.0, 0.001), at(0.099, 0.0, 0.0)};
      CHECK_FALSE(check(d).disagree());
      CHECK(check(d).weight == std::array<double, 3>{1.0, 1.0, 1.0});
      d[liar].p_BiBj.x() += 0.05;
      const Consistency result = check(d);
      REQUIRE(result.anomalous);
      CHECK(index_of(*result.anomalous) == liar);
      for (std::size_t i = 0; i < kMotionSensors; ++i) CHECK((result.weight[i] < 1.0) == (i == liar));
      CHECK(result.weight[liar] < 0.1);
    }
  }
}

TEST_CASE("consistency: (13) to (15) as they stand in the paper") {
  std::mt19937_64 rng{61};
  const ConsistencyCheck symmetric(with(AnomalyScore::distance));
  const ConsistencyCheck printed(with(AnomalyScore::distance, AnomalyWeight::printed));
  for (int trial = 0; trial < 100; ++trial) {
    CAPTURE(trial);
    Displacements d{};
    for (Displacement& one : d) {
      const Eigen::Vector3d p = random_vector(rng, 0.1);
      one = at(p.x(), p.y(), p.z());
    }
    const Consistency result = symmetric(d);
    check_equations(d, result);
    if (!result.anomalous) continue;
    const double Io = between(d[kImu], d[kOdometer]), Ic = between(d[kImu], d[kCamera]),
                 co = between(d[kCamera], d[kOdometer]);
    const std::size_t X = index_of(*result.anomalous);
    const double expected_symmetric = X == kImu        ? co / (2 * Io) + co / (2 * Ic)
                                      : X == kOdometer ? Ic / (2 * Io) + Ic / (2 * co)
                                                       : Io / (2 * Ic) + Io / (2 * co);
    const double expected_printed = X == kImu        ? co / (2 * Io) + Ic / (2 * Ic)
                                    : X == kOdometer ? Ic / (2 * Io) + Io / (2 * co)
                                                     : co / (2 * Ic) + Io / (2 * Ic);
    CHECK(result.weight[X] == doctest::Approx(std::clamp(expected_symmetric, 0.05, 1.0)));
    CHECK(printed(d).weight[X] == doctest::Approx(std::clamp(expected_printed, 0.05, 1.0)));
  }
}

TEST_CASE("consistency: of two that disagree, nobody knows who is wrong; who says nothing weighs nothing") {
  for (const AnomalyScore score : {AnomalyScore::distance, AnomalyScore::mahalanobis}) {
    const ConsistencyCheck check(with(score));
    const Displacements blind{at(0.1, 0, 0), at(0.2, 0, 0), Displacement{}};
    const Consistency result = check(blind);
    CHECK(result.disagree());
    CHECK_FALSE(result.anomalous);
    CHECK(result.weight == std::array<double, 3>{1.0, 1.0, 0.0});
    CHECK(result.variance == doctest::Approx(0.0025));

    const Consistency alone = check({at(0.1, 0, 0), Displacement{}, Displacement{}});
    CHECK_FALSE(alone.disagree());
    CHECK(alone.weight == std::array<double, 3>{1.0, 0.0, 0.0});
  }
}

TEST_CASE("consistency: a sensor that contradicts itself is at fault, whatever the others say") {
  Displacement torn;
  torn.contradictory = true;
  const Consistency result = ConsistencyCheck(with(AnomalyScore::distance))({at(0.1, 0, 0), at(0.1, 0, 0), torn});
  CHECK(result.anomalous == MotionSensor::camera);
  CHECK_FALSE(result.disagree());
  CHECK(result.weight == std::array<double, 3>{1.0, 1.0, 0.0});
}

TEST_CASE("consistency: two that are equal leave the third its least weight") {
  const ConsistencyCheck check(with(AnomalyScore::distance));
  const Consistency result = check({at(0.1, 0, 0), at(0.1, 0, 0), at(0.2, 0, 0)});
  CHECK(result.anomalous == MotionSensor::camera);
  CHECK(result.weight[kCamera] == 0.05);
  CHECK_FALSE(check({at(0.1, 0, 0), at(0.1, 0, 0), at(0.1, 0, 0)}).disagree());
}

TEST_CASE("consistency: what is far for a precise sensor is near for another") {
  const ConsistencyCheck check(with(AnomalyScore::mahalanobis));
  CHECK_FALSE(check({at(0.1, 0, 0), at(0.1, 0, 0), at(0.12, 0, 0, 0.02)}).disagree());
  CHECK(check({at(0.1, 0, 0), at(0.1, 0, 0), at(0.12, 0, 0, 0.002)}).anomalous == MotionSensor::camera);
}

TEST_CASE("consistency: sensors that are right are suspected as often as the false-alarm probability says") {
  AnomalyConfig config = with(AnomalyScore::mahalanobis);
  config.false_alarm = 0.02;
  const ConsistencyCheck check(config);
  std::mt19937_64 rng{62};
  const std::array<double, 3> pairs = {0.001, 0.004, 0.0005};
  constexpr int kDraws = 20000;
  int alarms_of_three = 0, alarms_of_two = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Displacements d{};
    for (std::size_t i = 0; i < kMotionSensors; ++i) {
      const Eigen::Vector3d sigma(pairs[i], 3.0 * pairs[i], 0.5 * pairs[i]);
      d[i].available = true;
      d[i].p_BiBj = Eigen::Vector3d(0.1, 0.2, 0.3) + sigma.cwiseProduct(random_vector(rng, 1.0));
      d[i].covariance = sigma.cwiseAbs2().asDiagonal();
    }
    alarms_of_three += check(d).disagree() ? 1 : 0;
    d[static_cast<std::size_t>(draw % 3)].available = false;
    alarms_of_two += check(d).disagree() ? 1 : 0;
  }
  const double spread = 4.0 * std::sqrt(kDraws * config.false_alarm);
  CHECK(std::abs(alarms_of_three - kDraws * config.false_alarm) < spread);
  CHECK(std::abs(alarms_of_two - kDraws * config.false_alarm) < spread);
}
