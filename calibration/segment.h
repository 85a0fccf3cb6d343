// One drive as unknowns: keyframes, what lies between them, and the features that they see.
#pragma once

#include <array>
#include <deque>
#include <vector>

#include "calibration/drive.h"
#include "calibration/first_guess.h"
#include "calibration/inertial_path.h"
#include "calibration/models.h"
#include "calibration/pixel_factor.h"
#include "calibration/wheel_angles.h"
#include "smoother/blocks.h"

namespace ear::calibration {

struct Keyframe {
  TimeNs t_ns = 0;    ///< IMU time
  double late = 0.0;  ///< [s] of its image: stamp and given time offset, less t_ns
  smoother::PoseBlock pose{};
  smoother::MotionBlock motion{};
  std::array<double, 3> ground{};
  GroundCentre centre;
  bool on_ground = true;                             ///< the wheels carry the vehicle, here and on the way to the next
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< bias removed [rad/s]
  std::vector<InertialPiece> since;                  ///< from here to the next keyframe; of the last one empty
  std::vector<PathNode> path;                        ///< the same, by the present state
};

/// An observation by one keyframe.
struct Seen {
  std::size_t keyframe = 0;
  Eigen::Vector2d left_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d right_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< normalized, by the calibration given
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  bool has_right = false;
};

struct Point {
  std::vector<Seen> seen;
  InverseDepthPoint anchor;
  smoother::PointBlock block{};
  bool used = false;
};

struct Segment {
  const Drive* drive = nullptr;
  std::deque<Keyframe> keyframes;  ///< blocks do not move
  std::deque<Point> points;
  std::array<double, 4> reference{};  ///< the world of the reference
};

/// How long features last, and how many are used.
struct PointChoice {
  std::size_t shortest = 3;       ///< keyframes that see it
  std::size_t per_keyframe = 40;  ///< wanted; longest first
};

/// Keyframes from the states guessed, features that last; where the wheels are on the ground (grounded.h) is not known
/// yet. Throws std::invalid_argument, naming the drive, where inertial samples are missing.
[[nodiscard]] Segment make_segment(const Drive& drive, const FirstGuess& guess, const Calibration& given,
                                   const PointChoice& choice);

/// The state of a keyframe's blocks.
[[nodiscard]] NavState state_of(const Keyframe& keyframe);

/// Paths and rates by the present blocks and errors; `gyro_noise`: density [rad/s/sqrt(Hz)], below which a rate is
/// none.
void renew_paths(Segment& segment, const GyroErrors& errors, double gyro_noise);

/// Where the points lie by the present poses. Those that cannot be found are not used.
void place_points(Segment& segment, const CameraState& cameras);

}  // namespace ear::calibration
