#include "tools/simulator/motion_plan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tools/simulator/constants.h"
#include "tools/simulator/wheel_contact.h"

namespace ear::simulator {
namespace {

// Half the IMU's: its intervals, centred on multiples of 5 ms, cover whole pieces of the spline.
constexpr double kPeriod = 0.0025;  // [s]
// Commands pass five moving averages: four continuous derivatives, and a step takes about 0.6 s (1.5 s from end to
// end).
constexpr int kSmoothings = 5;
constexpr double kSmoothing = 0.3;  // [s] each

// Body on the ground. A quadrotor that pushes itself along on wheels leans forward to accelerate and to climb.
constexpr double kLeanPerAcceleration = 6.0 * kDegree;  // [rad/(m/s^2)]
constexpr double kLeanPerSlope = 0.4;                   // [rad/rad]

// A wheel that loses its grip is light: it takes no longer than this to slip, and to grip again.
constexpr double kSlipOnset = 0.1;  // [s]

// Flight.
constexpr double kDragTilt = 1.0 * kDegree;  // [rad/(m/s)]
constexpr double kBobbing = 0.03;            // [m]
constexpr double kLevelBelow = 0.05;         // [m] below this height the axle is parallel to the ground
constexpr double kFreeAbove = 0.50;          // [m] from here on the attitude is the flight's

// Touchdown: the tyres are a damped spring that stops the fall within about 12 ms and throws the vehicle back a little.
constexpr double kStrikeFrequency = 115.0;  // [rad/s]
constexpr double kStrikeDamping = 0.35;
constexpr double kStrikePeak = 0.83;  // largest acceleration, in units of speed times frequency, at this damping
constexpr double kSettled = 0.15;     // [s] after which the bounce is below 0.02 mm
constexpr double kKick = 3.0 * kDegree;
constexpr double kKickFrequency = 1.6;  // [Hz] the body swings after the strike
constexpr double kKickDecay = 0.35;     // [s]

// The commands of a sequence, one value per period.
struct Commands {
  std::vector<double> forward, lateral, yaw_rate, climb, swing;
};

std::vector<double> moving_average(const std::vector<double>& values, int half) {
  const auto n = static_cast<int>(values.size());
  std::vector<double> sums(values.size() + 1, 0.0);
  for (int i = 0; i < n; ++i)
    sums[static_cast<std::size_t>(i + 1)] = sums[static_cast<std::size_t>(i)] + values[static_cast<std::size_t>(i)];
  std::vector<double> means(values.size());
  for (int i = 0; i < n; ++i) {
    const auto end = static_cast<std::size_t>(std::min(n, i + half + 1));
    const auto begin = static_cast<std::size_t>(std::max(0, i - half));
    means[static_cast<std::size_t>(i)] = (sums[end] - sums[begin]) / (2 * half + 1);
  }
  return means;
}

std::vector<double> smooth(std::vector<double> values) {
  const int half = static_cast<int>(std::lround(0.5 * kSmoothing / kPeriod));
  for (int i = 0; i < kSmoothings; ++i) values = moving_average(values, half);
  return values;
}

std::size_t periods_of(const Leg& leg) {
  return static_cast<std::size_t>(std::max(1L, std::lround(leg.duration / kPeriod)));
}

Commands smooth_commands(const std::vector<Leg>& legs) {
  Commands commands;
  double falling = 0.0;  // climb rate of a landing, kept up beyond its leg: the ground ends the fall, not the plan
  int keep_falling = 0;
  for (const Leg& leg : legs) {
    const std::size_t periods = periods_of(leg);
    const double duration = static_cast<double>(periods) * kPeriod;
    const double climb = leg.climb / duration;
    for (std::size_t i = 0; i < periods; ++i) {
      commands.forward.push_back(leg.forward / duration);
      commands.lateral.push_back(leg.lateral / duration);
      commands.yaw_rate.push_back(leg.turn / duration);
      commands.swing.push_back(leg.swing);
      commands.climb.push_back(keep_falling > 0 ? falling : climb);
      keep_falling = std::max(0, keep_falling - 1);
    }
    if (leg.climb < 0.0) {
      falling = climb;
      keep_falling = static_cast<int>(std::lround(kSmoothings * kSmoothing / kPeriod));
    }
  }
  return {smooth(commands.forward), smooth(commands.lateral), smooth(commands.yaw_rate), smooth(commands.climb),
          smooth(commands.swing)};
}

std::vector<std::array<double, 2>> smooth_slip(const std::vector<Leg>& legs) {
  const auto slips = [](const Leg& leg) { return leg.slip_left != 0.0 || leg.slip_right != 0.0; };
  if (std::none_of(legs.begin(), legs.end(), slips)) return {};
  std::vector<double> left;
  std::vector<double> right;
  for (const Leg& leg : legs) {
    left.insert(left.end(), periods_of(leg), leg.slip_left);
    right.insert(right.end(), periods_of(leg), leg.slip_right);
  }
  const int half = static_cast<int>(std::lround(0.5 * kSlipOnset / kPeriod));
  left = moving_average(moving_average(left, half), half);
  right = moving_average(moving_average(right, half), half);
  std::vector<std::array<double, 2>> slip;
  slip.reserve(left.size());
  for (std::size_t i = 0; i < left.size(); ++i) slip.push_back({left[i], right[i]});
  return slip;
}

// Height of the wheels above the ground, and when they touch down.
struct Heights {
  std::vector<double> height;
  std::vector<Mode> mode;
  std::vector<double> touchdowns;
};

double strike(double speed, double frequency, double tau) {
  const double damped = frequency * std::sqrt(1.0 - kStrikeDamping * kStrikeDamping);
  return -speed / damped * std::exp(-kStrikeDamping * frequency * tau) * std::sin(damped * tau);
}

// Of the tyres [rad/s] at this touchdown.
double strike_frequency(const std::vector<HardLanding>& hard_landings, double touchdown, double speed) {
  for (const HardLanding& landing : hard_landings) {
    if (landing.begin <= touchdown && touchdown < landing.end) {
      return (landing.peak - 1.0) * kGravity / (kStrikePeak * speed);
    }
  }
  return kStrikeFrequency;
}

Heights integrate_heights(const std::vector<double>& climb, const std::vector<HardLanding>& hard_landings) {
  Heights result;
  Mode mode = Mode::ground;
  double height = 0.0;
  double impact_speed = 0.0;
  double frequency = kStrikeFrequency;
  bool settling = false;
  for (std::size_t i = 0; i < climb.size(); ++i) {
    const double t = kPeriod * static_cast<double>(i);
    if (mode == Mode::ground && climb[i] > 0.0) mode = Mode::air;
    if (mode == Mode::air && !settling) {
      if (height <= 0.0 && climb[i] < 0.0) {
        impact_speed = -climb[i];
        result.touchdowns.push_back(t - height / climb[i]);
        frequency = strike_frequency(hard_landings, result.touchdowns.back(), impact_speed);
        settling = true;
      }
    }
    double now = height;
    if (settling) {
      const double tau = t - result.touchdowns.back();
      now = strike(impact_speed, frequency, tau);
      if (tau > kSettled * std::max(1.0, kStrikeFrequency / frequency)) {
        settling = false;
        mode = Mode::ground;
        height = now = 0.0;
      }
    }
    result.height.push_back(now);
    result.mode.push_back(mode);
    if (mode == Mode::air && !settling) height += kPeriod * climb[i];
  }
  return result;
}

// 0 below `low`, 1 above `high`, three continuous derivatives.
double smooth_step(double value, double low, double high) {
  const double x = std::clamp((value - low) / (high - low), 0.0, 1.0);
  return x * x * x * x * (35.0 - 84.0 * x + 70.0 * x * x - 20.0 * x * x * x);
}

struct Oscillation {
  double frequency, phase;
  [[nodiscard]] double at(double t) const { return std::sin(2.0 * kPi * frequency * t + phase); }
};

Oscillation draw_oscillation(Rng& rng, double lowest_hz, double highest_hz) {
  const double frequency = uniform(rng, lowest_hz, highest_hz);
  return {frequency, uniform(rng, -kPi, kPi)};
}

// The axle rolls on the ground: its middle moves along the heading, and sideways only as far as a rolling axle must so
// that its velocity has no component along the axle (wheels on both sides of a crossing slope lift one end).
class GroundPath {
 public:
  GroundPath(const Terrain& terrain, const AxleGeometry& axle) : terrain_(terrain), axle_(axle) {}

  [[nodiscard]] AxlePose rest(double x, double y, double yaw, const AxlePose& guess) const {
    if (terrain_.flat() && axle_.wheel_radius[0] == axle_.wheel_radius[1]) return {axle_.wheel_radius[0], 0.0};
    return rest_on_ground(terrain_, axle_, x, y, yaw, guess);
  }

  // Horizontal velocity of the axle's middle.
  [[nodiscard]] Eigen::Vector2d velocity(const Eigen::Vector2d& p, double yaw, double forward, double lateral,
                                         double yaw_rate, const AxlePose& pose) const {
    const Eigen::Vector2d ahead(std::cos(yaw), std::sin(yaw));
    const Eigen::Vector2d left(-ahead.y(), ahead.x());
    if (terrain_.flat()) return forward * ahead + lateral * left;
    constexpr double kStep = 1e-4;
    const Eigen::Vector2d moved = p + kStep * ahead;
    const Eigen::Vector2d aside = p + kStep * left;
    const double rise_ahead = (rest(moved.x(), moved.y(), yaw, pose).height - pose.height) / kStep;
    const double rise_left = (rest(aside.x(), aside.y(), yaw, pose).height - pose.height) / kStep;
    const double rise_turn = (rest(p.x(), p.y(), yaw + kStep, pose).height - pose.height) / kStep;
    // cos(roll) l + sin(roll) z' = 0 with z' = rise_ahead v + rise_left l + rise_turn yaw'
    const double rise = rise_ahead * forward + rise_turn * yaw_rate;
    const double sideways = -std::sin(pose.roll) * rise / (std::cos(pose.roll) + std::sin(pose.roll) * rise_left);
    return forward * ahead + (sideways + lateral) * left;
  }

 private:
  const Terrain& terrain_;
  AxleGeometry axle_;
};

}  // namespace

MotionPlan plan_motion(const Sequence& sequence, const EncoderCalibration& axle, Rng& rng,
                       const std::vector<HardLanding>& hard_landings) {
  const Commands commands = smooth_commands(sequence.legs);
  const Heights heights = integrate_heights(commands.climb, hard_landings);
  const auto n = static_cast<Eigen::Index>(commands.forward.size());
  const auto at = [](const std::vector<double>& values, Eigen::Index i) { return values[static_cast<std::size_t>(i)]; };

  const double resting_pitch = uniform(rng, -1.5, 1.5) * kDegree;
  const Oscillation slow_swing = draw_oscillation(rng, 0.5, 0.9);
  const Oscillation fast_swing = draw_oscillation(rng, 0.9, 1.5);
  const Oscillation bobbing = draw_oscillation(rng, 0.3, 0.6);

  // First the axle's place and its pose on the ground below.
  const GroundPath ground(sequence.terrain, {axle.wheel_radius, axle.track_width});
  Eigen::Matrix<double, 6, Eigen::Dynamic> states(6, n);
  Eigen::Vector2d p = sequence.start;
  double yaw = sequence.heading;
  AxlePose rest = ground.rest(p.x(), p.y(), yaw, {sequence.terrain.height(p.x(), p.y()) + axle.wheel_radius[0], 0.0});
  for (Eigen::Index i = 0; i < n; ++i) {
    rest = ground.rest(p.x(), p.y(), yaw, rest);
    const double height = at(heights.height, i);
    const double bob = kBobbing * smooth_step(height, 0.3, 0.8) * bobbing.at(kPeriod * static_cast<double>(i));
    states.col(i) << p.x(), p.y(), rest.height + height + bob, yaw, rest.roll, 0.0;
    if (i + 1 == n) break;

    // Midpoint rule.
    const double forward = 0.5 * (at(commands.forward, i) + at(commands.forward, i + 1));
    const double lateral = 0.5 * (at(commands.lateral, i) + at(commands.lateral, i + 1));
    const double yaw_rate = 0.5 * (at(commands.yaw_rate, i) + at(commands.yaw_rate, i + 1));
    const double middle_yaw = yaw + 0.5 * kPeriod * yaw_rate;
    const Eigen::Vector2d middle =
        p + 0.5 * kPeriod * forward * Eigen::Vector2d(std::cos(middle_yaw), std::sin(middle_yaw));
    p += kPeriod * ground.velocity(middle, middle_yaw, forward, lateral, yaw_rate,
                                   ground.rest(middle.x(), middle.y(), middle_yaw, rest));
    yaw += kPeriod * yaw_rate;
  }

  // Then the attitude: the body swings about the axle on the ground, and leans into its acceleration in the air.
  const Eigen::Matrix3Xd positions = states.topRows<3>();
  std::size_t touchdowns_passed = 0;
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double t = kPeriod * static_cast<double>(i);
    const double acceleration = (at(commands.forward, i + 1) - at(commands.forward, i - 1)) / (2.0 * kPeriod);
    const Eigen::Vector3d v_W = (positions.col(i + 1) - positions.col(i - 1)) / (2.0 * kPeriod);
    const Eigen::Vector3d a_W =
        (positions.col(i + 1) - 2.0 * positions.col(i) + positions.col(i - 1)) / (kPeriod * kPeriod);
    const Eigen::Matrix3d R_HW = Eigen::AngleAxisd(-states(3, i), Eigen::Vector3d::UnitZ()).toRotationMatrix();

    const double swing = at(commands.swing, i) * (0.65 * slow_swing.at(t) + 0.35 * fast_swing.at(t));
    const Eigen::Vector2d slope = sequence.terrain.gradient(positions(0, i), positions(1, i));
    const double uphill = slope.x() * std::cos(states(3, i)) + slope.y() * std::sin(states(3, i));
    double ground_pitch = resting_pitch + kLeanPerAcceleration * acceleration + kLeanPerSlope * uphill + swing;
    while (touchdowns_passed < heights.touchdowns.size() && heights.touchdowns[touchdowns_passed] <= t) {
      ++touchdowns_passed;
    }
    if (touchdowns_passed > 0) {
      const double tau = t - heights.touchdowns[touchdowns_passed - 1];
      if (tau < 20.0 * kKickDecay) {
        ground_pitch += kKick * std::exp(-tau / kKickDecay) * std::sin(2.0 * kPi * kKickFrequency * tau);
      }
    }

    const double free = smooth_step(at(heights.height, i), kLevelBelow, kFreeAbove);
    const Eigen::Vector3d v_H = R_HW * v_W;
    const Eigen::Vector3d thrust_H = (R_HW * (a_W + Eigen::Vector3d(0.0, 0.0, kGravity))).normalized();
    const double air_pitch = std::asin(thrust_H.x()) + kDragTilt * v_H.x();
    const double air_roll = std::atan2(-thrust_H.y(), thrust_H.z()) - kDragTilt * v_H.y();
    states(4, i) += free * (air_roll - states(4, i));
    states(5, i) = ground_pitch + free * (air_pitch - ground_pitch);
  }
  states.block<2, 1>(4, 0) = states.block<2, 1>(4, 1);
  states.block<2, 1>(4, n - 1) = states.block<2, 1>(4, n - 2);
  return {Trajectory(kPeriod, std::move(states), axle.T_BO), heights.mode, heights.touchdowns,
          smooth_slip(sequence.legs)};
}

}  // namespace ear::simulator
