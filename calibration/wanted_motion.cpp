#include "calibration/wanted_motion.h"

#include <array>

namespace ear::calibration {
namespace {

struct Wish {
  const char* entry;  ///< a part of its name; the first that fits counts
  const char* motion;
};

constexpr const char* kHop =
    "take off and hover 0.5 m over the floor for 20 s, moving to all sides so that the body tilts";
constexpr const char* kTurn = "turn on the spot both ways for 10 s";
constexpr const char* kSwing = "swing the body about the axle by 10 degrees while the wheels stand";
constexpr const char* kEight = "drive figures of eight with bends of 1 m radius, and speed up and brake hard";

constexpr std::array kWishes{
    Wish{"gyroscope, scale z", kTurn},
    Wish{"gyroscope", kHop},
    Wish{"wheel radius, mean", "drive 10 m and more straight on, with textured things 1 to 4 m away, and hop"},
    Wish{"wheel radius, left", "drive straight on and turn, both ways, 10 m and more"},
    Wish{"wheel separation", kTurn},
    Wish{"position of the axle z", kSwing},
    Wish{"position of the axle", kTurn},
    Wish{"axle turned about x", "turn on the spot both ways, and swing the body while it turns"},
    Wish{"axle turned about z", "drive straight on, forwards and backwards, 10 m and more"},
    Wish{"origin z", "hop: the beams at several heights over a flat floor"},
    Wish{"origin", kHop},
    Wish{"direction", kHop},
    Wish{"rotation in the body", kEight},
    Wish{"position in the body", kTurn},
    Wish{"rotation in cam0", "drive past textured things at 1 to 10 m"},
    Wish{"position in cam0", "speed up and brake hard, or hop: the scale comes from the IMU"},
    Wish{"focal length", "turn on the spot both ways, with texture over the whole image"},
    Wish{"principal point", "turn on the spot both ways, roll in the air, with texture over the whole image"},
    Wish{"distortion", "turn on the spot both ways, with texture up to the corners of the image"},
    Wish{"laser0: time", kSwing},
    Wish{"time offset", kEight},
};

}  // namespace

std::string motion_that_shows(const std::string& entry) {
  for (const Wish& wish : kWishes) {
    if (entry.find(wish.entry) != std::string::npos) return wish.motion;
  }
  return kEight;
}

std::string recommended_drive() {
  return "On a flat hard floor, in a room with texture 1 to 6 m away, in good light; less than three minutes.\n"
         " 1. Stand for 3 s.                                              biases, tilt\n"
         " 2. Swing the body about the axle by 10 degrees for 10 s.       axle's direction and height, beams, laser "
         "clock\n"
         " 3. Turn on the spot, two turns to the left, two to the right.  wheel separation, axle's position, lens\n"
         " 4. Drive a figure of eight with bends of 1 m radius, twice.    cameras in the body, time offsets, wheels\n"
         " 5. Drive 4 m straight on, brake hard, and back the same way.   wheel radii, axle's direction\n"
         " 6. Take off to 0.6 m and move 1.2 m left and right, a second each way, twelve times, forwards and "
         "backwards\n"
         "    six times; land, swing as in 2 for 6 s.\n"
         "    Then at 2 m: left and right five times, forwards and backwards eight times, turn left by 90 degrees, "
         "left\n"
         "    and right five times; turn back and land.                   beams: origins and directions; scale\n"
         " 7. Stand for 3 s.\n"
         "Without a camera: hops of 5 s in place of step 6, with the body tilted to all sides by 20 to 30 degrees, and "
         "2 s\n"
         "at rest after each.\n"
         "What cannot fly: for step 6 drive over a ramp or a step of a few centimetres, along it and at an angle. "
         "Without\n"
         "it the lateral parts of the beams stay as they were given, and say so.\n";
}

}  // namespace ear::calibration
