// A ChArUco board that somebody holds before the cameras and moves, as for the calibration of cameras.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "ear/calibration.h"
#include "tools/simulator/random.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/texture.h"
#include "tools/simulator/trajectory.h"

namespace ear::simulator {

/// The board of 10 x 7 squares on a sheet of 432 x 304 mm; markers of OpenCV's DICT_4X4_50.
inline constexpr int kBoardColumns = 10;
inline constexpr int kBoardRows = 7;
inline constexpr double kBoardSquare = 0.04;  ///< [m]
inline constexpr double kBoardMarker = 0.03;  ///< [m]

/// It goes from place to place in the left camera's view, near and far, turned and tilted to all sides, rests there for
/// half a second, and trembles as hands do.
class HeldBoard {
 public:
  /// Before the camera where it is in the middle of that time; `rng` draws places and tremor.
  HeldBoard(const BoardShow& show, const Trajectory& trajectory, const CameraCalibration& camera, Rng& rng);

  /// Whether it is held there at time t of the motion [s].
  [[nodiscard]] bool held(double t) const { return show_.begin <= t && t < show_.end; }
  /// Where it is.
  [[nodiscard]] Panel panel(double t) const;

 private:
  /// The middle of the board in the camera's frame [m], and its turn from facing the camera upright [rad].
  using Place = Eigen::Matrix<double, 6, 1>;
  struct Tremble {
    double frequency;  ///< [Hz]
    Place amplitude, phase;
  };

  BoardShow show_;
  Eigen::Isometry3d T_WC_;
  std::vector<Place> places_;
  std::vector<Tremble> tremor_;
};

/// What is printed on it, with two hands that hold it. Throws std::runtime_error in a program without OpenCV's aruco.
[[nodiscard]] Texture paint_board();

}  // namespace ear::simulator
