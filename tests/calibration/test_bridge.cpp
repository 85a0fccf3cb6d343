#include "calibration/bridge.h"

#include <doctest/doctest.h>

#include <cmath>

#include "filter/ekf/so3.h"
#include "tests/support/about.h"

using namespace ear;
using namespace ear::calibration;
using ear::test::about;

namespace {

constexpr double kHop = 4.0;     // [s]
constexpr double kSpin = 0.5;    // [rad/s] while it hops
constexpr double kBefore = 3.0;  // [s] at rest before
const Eigen::Vector3d kStart(1.0, 2.0, 0.1);

TimeNs stamp(double t) { return std::llround(1e9 * t); }

/// Stands, hops up and forward and comes back while it turns, stands.
std::vector<ImuSample> hop(double accel_bias) {
  std::vector<ImuSample> imu;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.005 * i - kBefore;
    ImuSample sample{stamp(0.005 * i), Eigen::Vector3d::Zero(), {accel_bias, 0.0, 9.81 + accel_bias}};
    if (t > 0.0 && t < kHop) {
      sample.gyro_B.z() = kSpin;
      const double push = 2.0 * std::cos(2.0 * 3.14159265358979 * t / kHop);  // speed and way are zero at the end
      sample.accel_B += exp_so3({0.0, 0.0, -kSpin * t}) * Eigen::Vector3d(push, 0.0, push);
    }
    imu.push_back(sample);
  }
  return imu;
}

GuessedState resting(double t, const Eigen::Vector3d& p) {
  GuessedState state;
  state.state.t_ns = state.stamp_ns = stamp(t);
  state.state.p_WB = p;
  return state;
}

/// Lost from 3 s on, and wrong before; from 8 s on in a world that begins anew.
std::vector<GuessedState> with_gap() {
  std::vector<GuessedState> states;
  for (int i = 0; i <= 15; ++i) {
    const double t = 0.2 * i;
    states.push_back(resting(t, t < 2.1 ? kStart : Eigen::Vector3d(kStart + Eigen::Vector3d::Constant(5.0))));
  }
  for (int i = 0; i < 5; ++i) states.push_back(resting(8.0 + 0.2 * i, Eigen::Vector3d::Zero()));
  return states;
}

}  // namespace

TEST_CASE("bridge: inertial samples carry the states over a hop, and the next piece goes on from there") {
  for (const double bias : {0.0, 0.05}) {
    CAPTURE(bias);
    const std::vector<GuessedState> bridged = bridge_gaps(with_gap(), hop(bias), 0.2, 1.0, 12.0);
    REQUIRE(bridged.size() > 40);
    double highest = 0.0;
    for (std::size_t i = 1; i < bridged.size(); ++i) {
      const double since = seconds_between(bridged[i - 1].state.t_ns, bridged[i].state.t_ns);
      CHECK(since > 0.09);
      CHECK(since < 0.31);
      CHECK((bridged[i].state.p_WB - bridged[i - 1].state.p_WB).norm() < 0.45);
      highest = std::max(highest, bridged[i].state.p_WB.z());
    }
    CHECK(highest - kStart.z() == about(2.0 * 2.0 * std::pow(kHop / 6.2832, 2), 0.1));
    const NavState& last = bridged.back().state;
    CHECK(last.p_WB.z() == about(kStart.z(), 1e-3));
    CHECK((last.p_WB - kStart).norm() < 0.01 + 20.0 * bias);  // 5 s of a wrong force
    CHECK(last.v_W.norm() < 1e-9);
    const Eigen::Vector3d turned = log_so3(last.q_WB.toRotationMatrix());
    CHECK((turned - Eigen::Vector3d(0.0, 0.0, kHop * kSpin)).norm() < 0.01);
  }
}

TEST_CASE("bridge: a gap that is too long stays") {
  const std::vector<GuessedState> bridged = bridge_gaps(with_gap(), hop(0.0), 0.2, 1.0, 4.0);
  double longest = 0.0;
  for (std::size_t i = 1; i < bridged.size(); ++i) {
    longest = std::max(longest, seconds_between(bridged[i - 1].state.t_ns, bridged[i].state.t_ns));
  }
  CHECK(longest > 4.9);
  CHECK(bridged.back().state.p_WB.norm() == 0.0);
}
