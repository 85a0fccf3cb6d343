#include "tools/simulator/sequence.h"

#include <cmath>
#include <stdexcept>

#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

constexpr double kDrivingSwing = 3.0 * kDegree;  // the body is never quite still while the wheels roll
constexpr double kLandingSpeed = 0.4;            // [m/s] at the touchdown

Leg stand(double seconds) {
  Leg leg;
  leg.duration = seconds;
  return leg;
}

Leg drive(double length, double speed) {
  Leg leg;
  leg.duration = length / speed;
  leg.forward = length;
  leg.swing = kDrivingSwing;
  return leg;
}

Leg turn(double radius, double angle_deg, double speed) {
  Leg leg = drive(radius * std::abs(angle_deg) * kDegree, speed);
  leg.turn = angle_deg * kDegree;
  return leg;
}

Leg spin(double angle_deg, double rate) {
  Leg leg;
  leg.duration = std::abs(angle_deg) * kDegree / rate;
  leg.turn = angle_deg * kDegree;
  return leg;
}

Leg sway(double seconds, double amplitude_deg) {
  Leg leg = stand(seconds);
  leg.swing = amplitude_deg * kDegree;
  return leg;
}

Leg take_off(double height, double seconds) {
  Leg leg = stand(seconds);
  leg.climb = height;
  return leg;
}

Leg land(double height) {
  Leg leg = stand(height / kLandingSpeed);
  leg.climb = -height;
  return leg;
}

Leg in_air(Leg leg) {
  leg.swing = 0.0;
  return leg;
}

Leg drift(Leg leg, double to_the_left) {
  leg.lateral = to_the_left;
  return leg;
}

// Paths keep 0.3 m away from the furniture of room.cpp; tests check it.
std::vector<Sequence> all_sequences() {
  return {
      {"static", "stands for 60 s, propellers idling", Terrain(), {6.0, 2.5}, 90.0 * kDegree, {stand(60.0)}},

      {"flat1",
       "46 m on the flat floor of a room: loops both ways, stops, a turn on the spot",
       Terrain(),
       {1.8, 1.1},
       0.0,
       {stand(2.5),          drive(3.0, 0.6),      drive(3.0, 1.0), turn(1.7, 90, 0.9),  drive(1.8, 0.9),
        turn(1.5, 130, 0.7), drive(1.6, 0.6),      stand(1.5),      drive(2.0, 0.8),     turn(1.5, -85, 0.7),
        drive(0.8, 0.8),     turn(1.7, -135, 0.8), drive(2.4, 1.0), turn(1.5, -90, 0.7), stand(1.0),
        spin(-50, 0.6),      stand(0.5),           spin(50, 0.8),   drive(0.7, 0.6),     turn(1.6, 165, 0.7),
        drive(1.9, 1.0),     turn(1.4, 105, 0.8),  drive(3.0, 0.9), turn(1.4, 80, 0.7),  drive(1.7, 0.6),
        stand(3.0)}},

      {"fly1",
       "34 m: drives, flies across the room, lands with a strike, drives, hops once more",
       Terrain(),
       {1.8, 1.3},
       0.0,
       {stand(2.5),
        drive(3.2, 0.7),
        stand(1.0),
        take_off(1.2, 2.4),
        in_air(drift(drive(3.2, 1.2), 0.3)),
        in_air(turn(1.8, 90, 0.9)),
        in_air(drive(1.5, 1.0)),
        in_air(turn(1.7, 90, 0.9)),
        in_air(drift(drive(2.2, 1.2), -0.3)),
        stand(0.8),
        land(1.2),
        stand(1.2),
        drive(1.6, 0.8),
        turn(1.3, 110, 0.7),
        drive(1.5, 0.7),
        stand(1.0),
        take_off(0.8, 2.0),
        in_air(drive(1.2, 1.0)),
        in_air(turn(1.5, 70, 0.9)),
        in_air(drive(2.4, 1.0)),
        in_air(turn(1.5, 90, 0.9)),
        stand(0.6),
        land(0.8),
        stand(1.2),
        drive(1.4, 0.7),
        stand(3.0)}},

      {"sway1",
       "stands while the body swings about the axle for 30 s",
       Terrain(),
       {6.0, 2.5},
       90.0 * kDegree,
       {stand(3.0), sway(30.0, 12.0), stand(3.0)}},

      {"wave1",
       "40 m over waves of up to 12 degrees",
       Terrain({{0.035, {4.4, 1.2}, 0.3}, {0.012, {-1.5, 3.3}, 1.1}}),
       {1.8, 1.1},
       0.0,
       {stand(2.5),          drive(3.0, 0.5),      drive(3.0, 0.7), turn(1.7, 90, 0.6),  drive(1.8, 0.6),
        turn(1.5, 130, 0.6), drive(1.6, 0.5),      stand(1.5),      drive(2.0, 0.6),     turn(1.5, -85, 0.5),
        drive(0.8, 0.6),     turn(1.7, -135, 0.6), drive(2.4, 0.7), turn(1.5, -90, 0.5), stand(1.5),
        drive(0.7, 0.5),     turn(1.6, 165, 0.6),  drive(1.9, 0.7), turn(1.4, 105, 0.6), drive(2.0, 0.6),
        stand(3.0)}},
  };
}

}  // namespace

std::vector<std::string> sequence_names() {
  std::vector<std::string> names;
  for (const Sequence& sequence : all_sequences()) names.push_back(sequence.name);
  return names;
}

Sequence find_sequence(const std::string& name) {
  std::string known;
  for (Sequence& sequence : all_sequences()) {
    if (sequence.name == name) return std::move(sequence);
    known += ' ' + sequence.name;
  }
  throw std::invalid_argument("there is no sequence '" + name + "'; there are:" + known);
}

Sequence vary(Sequence sequence, Rng& rng) {
  sequence.start += Eigen::Vector2d(uniform(rng, -0.08, 0.08), uniform(rng, -0.08, 0.08));
  sequence.heading += uniform(rng, -0.5, 0.5) * kDegree;
  for (Leg& leg : sequence.legs) {
    leg.forward *= uniform(rng, 0.99, 1.01);
    leg.turn *= uniform(rng, 0.995, 1.005);
    leg.swing *= uniform(rng, 0.7, 1.3);
    // A landing may be softer or harder: 0.32 to 0.5 m/s.
    leg.duration *= leg.climb < 0.0 ? uniform(rng, 0.8, 1.25) : uniform(rng, 0.93, 1.07);
  }
  return sequence;
}

}  // namespace ear::simulator
