#include "tools/simulator/sequence.h"

#include <algorithm>
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

// The wheels slip by this much over the ground [m/s], left and right; negative when they drag.
Leg slipping(Leg leg, double left, double right) {
  leg.slip_left = left;
  leg.slip_right = right;
  return leg;
}

Leg reverse(double length, double speed) {
  Leg leg = drive(length, speed);
  leg.forward = -length;
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

// Paths in the room keep 0.3 m away from the furniture of room.cpp; tests check it.
Sequence standing() {
  return {"static", "stands for 60 s, propellers idling", Terrain(), {6.0, 2.5}, 90.0 * kDegree, {stand(60.0)}};
}

Sequence flat1() {
  return {"flat1",
          "46 m on the flat floor of a room: loops both ways, stops, a turn on the spot",
          Terrain(),
          {1.8, 1.1},
          0.0,
          {stand(2.5),          drive(3.0, 0.6),      drive(3.0, 1.0), turn(1.7, 90, 0.9),  drive(1.8, 0.9),
           turn(1.5, 130, 0.7), drive(1.6, 0.6),      stand(1.5),      drive(2.0, 0.8),     turn(1.5, -85, 0.7),
           drive(0.8, 0.8),     turn(1.7, -135, 0.8), drive(2.4, 1.0), turn(1.5, -90, 0.7), stand(1.0),
           spin(-50, 0.6),      stand(0.5),           spin(50, 0.8),   drive(0.7, 0.6),     turn(1.6, 165, 0.7),
           drive(1.9, 1.0),     turn(1.4, 105, 0.8),  drive(3.0, 0.9), turn(1.4, 80, 0.7),  drive(1.7, 0.6),
           stand(3.0)}};
}

Sequence flat2() {
  return {"flat2",
          "46 m on the flat floor: a clockwise lap, then through the middle of the room",
          Terrain(),
          {2.5, 7.6},
          0.0,
          {stand(2.5),      drive(7.0, 0.8),     turn(1.5, -90, 0.7), drive(3.4, 0.9),    turn(1.5, -90, 0.8),
           stand(1.2),      drive(7.0, 1.0),     turn(1.5, -90, 0.7), drive(3.4, 0.6),    turn(1.5, -90, 0.8),
           drive(1.2, 0.7), turn(1.3, -90, 0.7), drive(2.4, 0.8),     turn(1.3, 90, 0.6), stand(1.0),
           spin(40, 0.7),   stand(0.4),          spin(-40, 0.6),      drive(1.5, 0.7),    turn(1.3, 90, 0.7),
           drive(1.8, 0.8), turn(1.4, 45, 0.7),  drive(1.2, 0.6),     stand(3.0)}};
}

Sequence flat3() {
  return {"flat3",
          "45 m on the flat floor: weaving, reversing, turns on the spot, up to 1.1 m/s",
          Terrain(),
          {1.9, 1.6},
          0.0,
          {stand(2.5),          turn(1.3, 30, 0.8), turn(1.3, -60, 0.8), turn(1.3, 60, 0.8), turn(1.3, -60, 0.9),
           turn(1.3, 30, 0.8),  drive(2.0, 1.1),    turn(1.5, 90, 0.7),  drive(3.0, 1.0),    turn(1.5, 90, 0.8),
           stand(1.0),          reverse(1.0, 0.4),  stand(0.6),          drive(2.0, 0.8),    turn(1.3, 30, 0.8),
           turn(1.3, -60, 0.8), turn(1.3, 60, 0.8), turn(1.3, -30, 0.9), stand(0.5),         spin(-90, 0.8),
           spin(90, 0.9),       stand(0.5),         drive(1.3, 1.1),     turn(1.5, 90, 0.7), drive(2.8, 1.0),
           turn(1.5, 90, 0.8),  drive(6.0, 1.1),    turn(1.5, 90, 0.8),  drive(3.0, 0.9),    turn(1.4, 90, 0.7),
           drive(0.8, 0.6),     stand(3.0)}};
}

Sequence fly1() {
  return {"fly1",
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
           stand(3.0)}};
}

Sequence fly2() {
  Sequence fly2{"fly2",
                "59 m: three flights with drives before, between and after them",
                Terrain(),
                {2.65, 1.3},
                0.0,
                {stand(2.5),
                 drive(3.4, 0.8),
                 stand(1.0),
                 take_off(1.2, 2.4),
                 in_air(drive(3.2, 1.2)),
                 in_air(turn(1.5, 90, 0.9)),
                 in_air(drift(drive(3.4, 1.2), 0.2)),
                 stand(1.0),
                 land(1.2),
                 stand(1.2),
                 turn(1.5, 90, 0.7),
                 drive(2.0, 0.8),
                 stand(1.0),
                 take_off(0.8, 2.0),
                 in_air(drift(drive(4.6, 1.2), -0.2)),
                 in_air(turn(1.5, 90, 0.9)),
                 in_air(drive(1.0, 1.0)),
                 stand(1.0),
                 land(0.8),
                 stand(1.2),
                 drive(2.4, 0.7),
                 turn(1.5, 90, 0.7),
                 drive(2.2, 0.9),
                 stand(1.0),
                 take_off(1.2, 2.4),
                 in_air(drive(4.4, 1.3)),
                 in_air(turn(1.6, 90, 1.0)),
                 in_air(drive(3.2, 1.2)),
                 in_air(turn(1.6, 90, 1.0)),
                 in_air(drive(2.2, 1.1)),
                 stand(1.0),
                 land(1.2),
                 stand(1.2),
                 drive(4.3, 0.8),
                 turn(1.5, 90, 0.7),
                 stand(3.0)}};
  fly2.laser_faults = {0.01, 0.005, 0.0};
  return fly2;
}

Sequence wave1() {
  return {"wave1",
          "41 m over waves of 10 degrees",
          Terrain({{0.035, {4.4, 1.2}, 0.3}, {0.012, {-1.5, 3.3}, 1.1}}),
          {1.8, 1.1},
          0.0,
          {stand(2.5),          drive(3.0, 0.5),      drive(3.0, 0.7), turn(1.7, 90, 0.6),  drive(1.8, 0.6),
           turn(1.5, 130, 0.6), drive(1.6, 0.5),      stand(1.5),      drive(2.0, 0.6),     turn(1.5, -85, 0.5),
           drive(0.8, 0.6),     turn(1.7, -135, 0.6), drive(2.4, 0.7), turn(1.5, -90, 0.5), stand(1.5),
           drive(0.7, 0.5),     turn(1.6, 165, 0.6),  drive(1.9, 0.7), turn(1.4, 105, 0.6), drive(2.0, 0.6),
           stand(3.0)}};
}

Sequence wave2() {
  return {"wave2",
          "31 m over waves of 10 degrees, where the wheels slip now and then",
          Terrain({{0.050, {3.3, 0.8}, 1.3}, {0.010, {-2.2, 4.1}, 0.4}}),
          {2.5, 1.4},
          0.0,
          {stand(2.5), drive(4.6, 0.6), slipping(drive(0.5, 0.6), 0.15, 0.05), drive(1.5, 0.6), turn(1.5, 90, 0.5),
           drive(3.2, 0.7), turn(1.5, 90, 0.6), stand(1.2), drive(3.0, 0.6), slipping(drive(0.6, 0.6), -0.10, -0.20),
           drive(3.0, 0.6), turn(1.5, 90, 0.5), drive(1.6, 0.6), slipping(drive(0.4, 0.5), 0.25, 0.25), drive(1.2, 0.6),
           turn(1.5, 90, 0.5), drive(2.2, 0.7), stand(3.0)}};
}

Sequence wave3() {
  Sequence wave3{"wave3",
                 "28 m over short waves of 10 degrees; slip, and a few lost and wrong laser readings",
                 Terrain({{0.028, {5.2, 2.1}, 0.0}, {0.015, {-1.8, 4.6}, 2.1}}),
                 {9.4, 1.3},
                 90.0 * kDegree,
                 {stand(2.5), drive(3.2, 0.5), slipping(drive(0.4, 0.5), 0.20, 0.0), drive(1.2, 0.5),
                  turn(1.5, 90, 0.5), drive(5.6, 0.7), turn(1.4, 90, 0.5), drive(1.6, 0.6),
                  slipping(drive(0.8, 0.6), -0.15, -0.10), drive(0.8, 0.6), stand(1.2), turn(1.4, 90, 0.5),
                  drive(5.0, 0.6), slipping(drive(0.5, 0.5), 0.20, 0.30), drive(2.3, 0.6), stand(3.0)}};
  wave3.laser_faults = {0.01, 0.005, 0.02};
  return wave3;
}

// A ridge along y: from the valley near x = -1 to the crest near x = 12, of even steepness between (the third harmonic
// makes the flanks straight), with small bumps.
Sequence slope() {
  const double along = 2.0 * kPi / 26.0;  // [rad/m]
  const double phase = -5.5 * along;
  Sequence slope{"slope",
                 "52 m outdoors, up and down a steep hillside of 20 to 25 degrees",
                 Terrain({{1.95, {along, 0.0}, phase},
                          {-1.95 / 27.0, {3.0 * along, 0.0}, 3.0 * phase},
                          {0.006, {3.1, 2.3}, 0.0},
                          {0.004, {-2.7, 5.2}, 1.0}}),
                 {0.0, 2.0},
                 0.0,
                 {stand(2.5), drive(13.0, 0.7), turn(1.6, 180, 0.6), stand(1.0), drive(11.0, 0.8), turn(1.6, -165, 0.6),
                  drive(7.5, 0.6), turn(1.8, 110, 0.6), drive(5.0, 0.6), stand(3.0)}};
  slope.place = Place::hillside;
  slope.laser_faults = {0.02, 0.005, 0.02};
  return slope;
}

Sequence lawn() {
  Sequence lawn{
      "lawn",
      "64 m outdoors on rough ground; grass meets the lasers and passes before the lenses",
      Terrain({{0.030, {0.9, 0.5}, 0.0},
               {0.012, {2.9, -1.7}, 0.5},
               {0.008, {1.3, 4.9}, 1.1},
               {0.006, {-6.6, 4.2}, 1.9},
               {0.004, {8.3, 7.1}, 0.2},
               {0.003, {-4.5, 12.3}, 2.7}}),
      {3.0, 3.0},
      0.0,
      {stand(2.5), drive(9.0, 0.7), turn(2.0, 90, 0.6), drive(5.0, 0.8), turn(2.0, 90, 0.6), drive(4.0, 0.7),
       stand(1.2), turn(1.6, 120, 0.6), drive(4.5, 0.7), turn(1.6, -150, 0.6), drive(6.0, 0.8), turn(1.8, -100, 0.6),
       drive(3.0, 0.7), stand(1.0), drive(3.0, 0.6), turn(1.8, 200, 0.6), drive(6.2, 0.8), stand(3.0)}};
  lawn.place = Place::garden;
  lawn.laser_faults = {0.03, 0.03, 0.05};
  lawn.hindrance.tufts = 0.25;
  return lawn;
}

constexpr double kCoveredAfter = 2.2;  // [s] still standing

Sequence occlusion1() {
  Sequence sequence = flat1();
  sequence.name = "occlusion1";
  sequence.summary = "flat1 with the cameras covered from shortly before the vehicle moves to the end";
  sequence.hindrance.covered_after = kCoveredAfter;
  return sequence;
}

Sequence occlusion2() {
  Sequence sequence = wave2();
  sequence.name = "occlusion2";
  sequence.summary = "wave2 with the cameras covered from shortly before the vehicle moves to the end";
  sequence.hindrance.covered_after = kCoveredAfter;
  return sequence;
}

Sequence sway1() {
  return {"sway1",        "stands while the body swings about the axle for 30 s",
          Terrain(),      {6.0, 2.5},
          90.0 * kDegree, {stand(3.0), sway(30.0, 12.0), stand(3.0)}};
}

Sequence sway2() {
  return {"sway2",
          "stands for 30 s while the body swings about the axle, weakly and strongly, with rests between",
          Terrain(),
          {3.6, 3.0},
          20.0 * kDegree,
          {stand(3.0), sway(7.0, 6.0), stand(2.5), sway(8.0, 15.0), stand(1.5), sway(11.0, 10.0), stand(3.0)}};
}

Sequence sway3() {
  return {"sway3",
          "stands for 30 s while the body swings about the axle; twice the wheels spin idly",
          Terrain(),
          {8.6, 6.4},
          200.0 * kDegree,
          {stand(3.0), sway(8.0, 12.0), slipping(sway(4.0, 10.0), 0.30, 0.25), sway(7.0, 12.0),
           slipping(sway(3.0, 8.0), -0.20, -0.30), sway(6.0, 12.0), stand(3.0)}};
}

// What shows every part of the calibration: `ear calibrate --plan`.
Sequence calibrate() {
  // From side to side in a second: the body tilts by 20 to 25 degrees, and its acceleration is well above the noise.
  const auto aside = [](double left) { return in_air(drift(stand(1.0), left)); };
  const auto ahead = [](double forward) {
    Leg leg = in_air(stand(1.0));
    leg.forward = forward;
    return leg;
  };
  std::vector<Leg> legs;
  const auto add = [&legs](std::initializer_list<Leg> more) { legs.insert(legs.end(), more); };
  const auto shake = [&](int sideways, int lengthways) {
    for (int i = 0; i < sideways; ++i) add({aside(1.2), aside(-1.2)});
    for (int i = 0; i < lengthways; ++i) add({ahead(1.2), ahead(-1.2)});
  };
  add({stand(3.0), sway(10.0, 10.0), spin(400, 1.0), stand(0.5), spin(-400, 1.0), stand(0.5)});
  add({turn(0.9, 360, 0.8), turn(0.9, -360, 0.8), turn(0.9, 360, 0.9), turn(0.9, -360, 0.9), stand(1.0)});
  add({drive(4.0, 1.0), stand(0.6), reverse(4.0, 1.0), stand(1.0)});
  add({take_off(0.6, 1.5)});  // low and high: a beam's origin is told from its direction
  shake(12, 6);
  add({stand(0.8), land(0.6), stand(1.5), sway(6.0, 10.0)});
  add({take_off(2.2, 3.0)});
  shake(5, 8);
  add({in_air(spin(90, 0.9))});
  shake(5, 0);
  add({in_air(spin(-90, 0.9)), stand(0.8), land(2.2), stand(1.5)});
  add({spin(90, 0.9), drive(2.0, 1.0), stand(0.6), reverse(2.0, 0.8), stand(3.0)});
  return {
      "calibrate", "the drive that shows the calibration: swings, turns on the spot, figures of eight, hops with tilts",
      Terrain(),   {4.0, 4.4},
      0.0,         legs};
}

// What does not show the calibration.
Sequence straight() {
  return {"straight", "stands, drives 7 m straight on, stands", Terrain(), {2.5, 7.6},
          0.0,        {stand(3.0), drive(7.0, 0.8), stand(3.0)}};
}

Sequence circle() {
  return {"circle",  "stands, drives one circle of 1 m radius to the left, stands",
          Terrain(), {4.0, 4.4},
          0.0,       {stand(3.0), turn(1.0, 360, 0.7), stand(3.0)}};
}

// The board is shown while the vehicle hangs in the air: near the floor half of the board would be below it.
Sequence board() {
  Sequence sequence{
      "board",        "hovers at a height of 1 m while somebody moves a ChArUco board before its cameras for 60 s",
      Terrain(),      {6.0, 2.5},
      90.0 * kDegree, {stand(2.0), take_off(1.0, 2.0), in_air(stand(63.0)), land(1.0), stand(1.0)}};
  sequence.board = BoardShow{5.5, 65.5};
  return sequence;
}

std::vector<Sequence> all_sequences() {
  return {standing(),   flat1(),      flat2(),     flat3(),    wave1(),  wave2(), wave3(),
          slope(),      lawn(),       fly1(),      fly2(),     sway1(),  sway2(), sway3(),
          occlusion1(), occlusion2(), calibrate(), straight(), circle(), board()};
}

}  // namespace

std::vector<std::string> all_sequence_names() {
  std::vector<std::string> names;
  for (const Sequence& sequence : all_sequences()) names.push_back(sequence.name);
  return names;
}

std::vector<std::string> sequence_names() {
  std::vector<std::string> names = all_sequence_names();
  for (const char* name : {"calibrate", "straight", "circle", "board"}) {
    names.erase(std::remove(names.begin(), names.end(), name), names.end());
  }
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
    if (leg.slip_left != 0.0 || leg.slip_right != 0.0) {
      const double grip = uniform(rng, 0.7, 1.3);
      leg.slip_left *= grip;
      leg.slip_right *= grip;
    }
    // A landing may be softer or harder: 0.32 to 0.5 m/s.
    leg.duration *= leg.climb < 0.0 ? uniform(rng, 0.8, 1.25) : uniform(rng, 0.93, 1.07);
  }
  return sequence;
}

}  // namespace ear::simulator
