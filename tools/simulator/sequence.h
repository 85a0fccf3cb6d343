// What the vehicle does and where: a table of legs per sequence. A new sequence is a new entry in sequence.cpp.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tools/simulator/random.h"
#include "tools/simulator/terrain.h"

namespace ear::simulator {

/// A piece of the plan with constant commands; the motion smooths the corners between legs (motion_plan.h).
struct Leg {
  double duration = 0.0;    ///< [s]
  double forward = 0.0;     ///< distance along the heading [m]
  double lateral = 0.0;     ///< distance to the left [m], in the air only
  double turn = 0.0;        ///< change of heading, left positive [rad]
  double climb = 0.0;       ///< change of height above the ground [m]; the leg that comes back to 0 ends with a strike
  double swing = 0.0;       ///< amplitude of the body's swing about the axle [rad]
  double slip_left = 0.0;   ///< speed of the left wheel's rim beyond that of rolling [m/s]; negative when it drags
  double slip_right = 0.0;  ///< of the right one
};

/// What surrounds the vehicle.
enum class Place { room, hillside, garden };

/// What goes wrong with the lasers, each beam for itself.
struct LaserFaults {
  double lost = 0.0;   ///< share of the readings without a return
  double wrong = 0.0;  ///< share of the readings that meet something else than the ground
  double fades = 0.0;  ///< times per second that a beam gives nothing for 0.2 to 1.0 s
};

/// What gets between the cameras and the scene.
struct Hindrance {
  std::optional<double> covered_after;  ///< the lenses are covered from here to the end [s]
  double tufts = 0.0;                   ///< tufts of grass per second that pass before the lenses
};

/// A board with markers that somebody moves before the cameras (held_board.h).
struct BoardShow {
  double begin = 0.0, end = 0.0;  ///< [s]
};

struct Sequence {
  std::string name;
  std::string summary;  ///< one line for people
  Terrain terrain;
  Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< middle of the axle [m]
  double heading = 0.0;                             ///< at the start [rad]
  std::vector<Leg> legs;
  Place place = Place::room;
  LaserFaults laser_faults = {};
  Hindrance hindrance = {};
  std::optional<BoardShow> board = {};
};

/// The names that `find_sequence` knows, but for `calibrate`, `straight`, `circle` and `board`, which are for the
/// calibration: /// those that estimators are compared on.
[[nodiscard]] std::vector<std::string> sequence_names();
/// All of them.
[[nodiscard]] std::vector<std::string> all_sequence_names();

/// Throws std::invalid_argument, naming those that exist, if there is none of that name.
[[nodiscard]] Sequence find_sequence(const std::string& name);

/// The same plan as another day would have it: start, speeds and lengths differ by a few per cent.
[[nodiscard]] Sequence vary(Sequence sequence, Rng& rng);

}  // namespace ear::simulator
