#include "tools/simulator/wheel_faults.h"

#include <algorithm>
#include <cmath>

#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

constexpr double kOnset = 0.1;        // [s] no wheel changes its speed at once
constexpr double kInterval = 0.0025;  // [s]

using Pair = std::array<double, 2>;  // left and right

// How much of the fault there is: 0 at both ends of its interval, 1 between.
double presence(const Fault& fault, double t) {
  const double onset = std::min(kOnset, fault.duration / 3.0);
  const double x = std::clamp(std::min(t - fault.start, fault.end() - t) / onset, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

// Rates relative to the body in the clean motion [rad/s].
Pair clean_rates(const WheelMotion& wheels, double t) {
  const Pair before = wheels.angles(t - kInterval);
  const Pair after = wheels.angles(t + kInterval);
  return {(after[0] - before[0]) / (2.0 * kInterval), (after[1] - before[1]) / (2.0 * kInterval)};
}

bool on_ground(const MotionPlan& plan, double t) {
  const auto knot = static_cast<std::size_t>(std::lround(std::max(0.0, t / plan.trajectory.period())));
  return plan.mode[std::min(knot, plan.mode.size() - 1)] == Mode::ground;
}

bool turns_wheels(FaultKind kind) {
  return kind == FaultKind::wheel_slipping || kind == FaultKind::wheel_idle_spin || kind == FaultKind::wheel_lifted;
}

// Rates that one fault adds to the clean ones at an instant [rad/s].
Pair excess_rates(const Fault& fault, const MotionPlan& plan, const WheelMotion& wheels, const EncoderCalibration& axle,
                  double t) {
  const Pair clean = clean_rates(wheels, t);
  const Pair at_start = clean_rates(wheels, fault.start);
  Pair excess{};
  for (std::size_t wheel = 0; wheel < 2; ++wheel) {
    if (!fault.hits(wheel)) continue;
    if (fault.kind == FaultKind::wheel_slipping && on_ground(plan, t)) {
      // The wheel rolls as fast as it turns in the world: relative to the body and with it.
      excess[wheel] = fault.parameter * (clean[wheel] + plan.trajectory.at(t).omega_O.y());
    } else if (fault.kind == FaultKind::wheel_idle_spin) {
      excess[wheel] = fault.parameter / axle.wheel_radius[wheel];
    } else if (fault.kind == FaultKind::wheel_lifted) {
      excess[wheel] = at_start[wheel] * std::exp(-(t - fault.start) / kCoasting) - clean[wheel];
    }
    excess[wheel] *= presence(fault, t);
  }
  return excess;
}

}  // namespace

WheelFaults::WheelFaults(const std::vector<Fault>& faults, const MotionPlan& plan, const WheelMotion& wheels,
                         const EncoderCalibration& axle) {
  for (const Fault& fault : faults) {
    if (!turns_wheels(fault.kind)) continue;
    const int intervals = std::max(1, static_cast<int>(std::ceil(fault.duration / kInterval)));
    Excess excess{fault, fault.duration / intervals, {}};
    Knot knot;
    Pair before{};
    for (int i = 0; i <= intervals; ++i) {
      const double t = fault.start + i * excess.period;
      const Pair rates = excess_rates(fault, plan, wheels, axle, t);
      for (std::size_t wheel = 0; wheel < 2 && i > 0; ++wheel) {
        knot.angle[wheel] += 0.5 * excess.period * (before[wheel] + rates[wheel]);
      }
      const bool slips = fault.kind != FaultKind::wheel_lifted && on_ground(plan, t);
      knot.slip = slips ? 0.5 * (axle.wheel_radius[0] * rates[0] + axle.wheel_radius[1] * rates[1]) : 0.0;
      excess.knots.push_back(knot);
      before = rates;
    }
    excesses_.push_back(std::move(excess));
  }
}

std::array<double, 2> WheelFaults::angles(double t) const {
  Pair sum{};
  for (const Excess& excess : excesses_) {
    const auto last = static_cast<double>(excess.knots.size() - 1);
    const double position = std::clamp((t - excess.fault.start) / excess.period, 0.0, last);
    const auto i = std::min(static_cast<std::size_t>(position), excess.knots.size() - 2);
    const double f = position - static_cast<double>(i);
    for (std::size_t wheel = 0; wheel < 2; ++wheel) {
      sum[wheel] += (1.0 - f) * excess.knots[i].angle[wheel] + f * excess.knots[i + 1].angle[wheel];
    }
  }
  return sum;
}

double WheelFaults::slip(double t) const {
  double sum = 0.0;
  for (const Excess& excess : excesses_) {
    if (!excess.fault.active(t)) continue;
    const auto knot = static_cast<std::size_t>(std::lround((t - excess.fault.start) / excess.period));
    sum += excess.knots[std::min(knot, excess.knots.size() - 1)].slip;
  }
  return sum;
}

}  // namespace ear::simulator
