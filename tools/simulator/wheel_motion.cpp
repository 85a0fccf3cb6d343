#include "tools/simulator/wheel_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

constexpr double kSpinUp = 0.02;  // [s]

}  // namespace

std::array<double, 2> rolling_rates(const Kinematics& motion, const Terrain& terrain, const EncoderCalibration& axle) {
  const Eigen::Vector3d axle_W = motion.R_WO.col(1);
  const Eigen::Vector3d omega_W = motion.R_WO * motion.omega_O;
  std::array<double, 2> rates{};
  for (std::size_t wheel = 0; wheel < 2; ++wheel) {
    const double side = (wheel == 0 ? 0.5 : -0.5) * axle.track_width;
    const double radius = axle.wheel_radius[wheel];
    const Eigen::Vector3d centre_W = motion.p_WO + side * axle_W;
    const Eigen::Vector3d v_W = motion.v_O_W + side * omega_W.cross(axle_W);
    // From the point of contact to the centre: the ground's normal there, without its part along the axle.
    Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();
    for (int i = 0; i < (terrain.flat() ? 1 : 3); ++i) {
      const Eigen::Vector3d contact_W = centre_W - radius * up_W;
      const Eigen::Vector3d n_W = terrain.normal(contact_W.x(), contact_W.y());
      up_W = (n_W - n_W.dot(axle_W) * axle_W).normalized();
    }
    // The material point at the contact stands still along the track: v . t = radius * spin, spin = rate + omega .
    // axle.
    const Eigen::Vector3d track_W = axle_W.cross(up_W);
    rates[wheel] = v_W.dot(track_W) / radius - omega_W.dot(axle_W);
  }
  return rates;
}

WheelMotion::WheelMotion(const MotionPlan& plan, const Terrain& terrain, const EncoderCalibration& axle)
    : period_(plan.trajectory.period()), knots_(plan.mode.size()) {
  const double mean_radius = 0.5 * (axle.wheel_radius[0] + axle.wheel_radius[1]);
  std::array<double, 2> excess{};  // rate above that of rolling, since the last touchdown
  double contact_since = -1.0;     // [s]
  std::size_t touchdown = 0;       // next one
  bool rolling = true;
  std::array<double, 2> coasting{};

  // Slip that the plan asks for, left and right [m/s].
  const auto planned_slip = [&plan, this](double t) {
    if (plan.slip.empty()) return std::array<double, 2>{};
    const double position = std::clamp(t / period_, 0.0, static_cast<double>(plan.slip.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(position), plan.slip.size() - 2);
    const double f = position - static_cast<double>(i);
    const std::array<double, 2>& a = plan.slip[i];
    const std::array<double, 2>& b = plan.slip[i + 1];
    return std::array<double, 2>{a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1])};
  };

  // Rates at one instant; `t` never decreases.
  const auto rates_at = [&](double t, bool in_air) {
    const std::array<double, 2> roll = rolling_rates(plan.trajectory.at(t), terrain, axle);
    if (touchdown < plan.touchdowns.size() && plan.touchdowns[touchdown] <= t && !rolling) {
      for (std::size_t i = 0; i < 2; ++i) excess[i] = coasting[i] - roll[i];
      contact_since = plan.touchdowns[touchdown++];
      rolling = true;
    } else if (rolling && in_air && (touchdown == 0 || t - plan.touchdowns[touchdown - 1] > 1.0)) {
      rolling = false;
      coasting = roll;
    }
    if (!rolling) return coasting;
    const double left = contact_since < 0.0 ? 0.0 : std::exp(-(t - contact_since) / kSpinUp);
    const std::array<double, 2> slip = planned_slip(t);
    return std::array<double, 2>{roll[0] + left * excess[0] + slip[0] / axle.wheel_radius[0],
                                 roll[1] + left * excess[1] + slip[1] / axle.wheel_radius[1]};
  };

  const double half = 0.5 * period_;
  const double decay = std::exp(-half / kCoasting);
  const auto coast = [&] {
    for (double& rate : coasting) rate *= decay;
  };
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    const double t = period_ * static_cast<double>(i);
    Knot& knot = knots_[i];
    const bool in_air = plan.mode[i] == Mode::air;
    knot.rate = rates_at(t, in_air);
    if (rolling && contact_since >= 0.0) {
      knot.slip = std::exp(-(t - contact_since) / kSpinUp) * mean_radius * 0.5 * (excess[0] + excess[1]);
    }
    if (rolling) {
      const std::array<double, 2> slip = planned_slip(t);
      knot.slip += 0.5 * (slip[0] + slip[1]);
    }
    if (i + 1 == knots_.size()) break;
    // Simpson's rule over the period; the next knot's rate is computed again above, from the same state.
    coast();
    const std::array<double, 2> middle = rates_at(t + half, in_air);
    coast();
    const std::array<double, 2> end = rates_at(t + period_, plan.mode[i + 1] == Mode::air);
    for (std::size_t wheel = 0; wheel < 2; ++wheel) {
      knots_[i + 1].angle[wheel] =
          knot.angle[wheel] + period_ / 6.0 * (knot.rate[wheel] + 4.0 * middle[wheel] + end[wheel]);
    }
  }
}

std::array<double, 2> WheelMotion::angles(double t) const {
  const double position = std::clamp(t / period_, 0.0, static_cast<double>(knots_.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(position), knots_.size() - 2);
  const double f = position - static_cast<double>(i);
  const Knot& a = knots_[i];
  const Knot& b = knots_[i + 1];
  std::array<double, 2> angle{};
  for (std::size_t wheel = 0; wheel < 2; ++wheel) {  // cubic Hermite
    const double step = b.angle[wheel] - a.angle[wheel];
    angle[wheel] = a.angle[wheel] + f * f * (3.0 - 2.0 * f) * step +
                   period_ * f * (1.0 - f) * ((1.0 - f) * a.rate[wheel] - f * b.rate[wheel]);
  }
  return angle;
}

double WheelMotion::slip(double t) const {
  const double position = std::clamp(t / period_, 0.0, static_cast<double>(knots_.size() - 1));
  return knots_[static_cast<std::size_t>(std::lround(position))].slip;
}

}  // namespace ear::simulator
