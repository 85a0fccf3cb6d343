#include "filter/sources/ground/wheel_watch.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr double kMoment = 0.1;  // [s]
constexpr double kFaster = 0.5;  // [rad/s] 4 cm/s at the rim of a small wheel
constexpr double kNoise = 7.0;   // and so many standard deviations of a reading: five of a difference

}  // namespace

WheelWatch::Motion WheelWatch::add(const WheelIncrement& turn) {
  const double body_angle = body_angle_;
  body_angle_ = 0.0;
  Motion motion;
  motion.dt = turn.duration();
  const double noise = 2.0 * M_PI * axle_.noise_counts / static_cast<double>(axle_.resolution) / motion.dt;
  const double faster = kFaster + kNoise * noise;
  const double share = 1.0 - std::exp(-motion.dt / kMoment);
  for (int i = 0; i < 2; ++i) {
    const double angle = turn.angle(i) + body_angle;  // against the world
    Wheel& wheel = wheels_[static_cast<std::size_t>(i)];
    const Wheel now{turn.angle(i) / motion.dt, angle / motion.dt};
    motion.distance = std::max(motion.distance, std::abs(axle_.wheel_radius[static_cast<std::size_t>(i)] * angle));
    motion.driven = motion.driven || (motion.dt < kMoment && std::abs(now.rate) > std::abs(wheel.rate) + faster &&
                                      std::abs(now.spin) > std::abs(wheel.spin) + faster);
    wheel.rate += share * (now.rate - wheel.rate);
    wheel.spin += share * (now.spin - wheel.spin);
  }
  return motion;
}

}  // namespace ear
