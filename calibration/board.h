// Lenses and stereo pose from a board with known corners that is held before the cameras in many ways.
// docs/calibration.md.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/findings.h"
#include "calibration/residuals.h"
#include "ear/calibration.h"
#include "filter/ekf/state.h"

namespace ear::calibration {

/// A chessboard's inner corners, numbered along its rows.
struct BoardShape {
  int columns = 10;      ///< squares
  int rows = 7;          ///< squares
  double square = 0.04;  ///< [m]

  [[nodiscard]] int corners() const { return (columns - 1) * (rows - 1); }
  /// On the board [m].
  [[nodiscard]] Eigen::Vector2d at(int corner) const {
    const int across = corner % (columns - 1), down = corner / (columns - 1);
    return {square * (1 + across), square * (1 + down)};
  }
};

struct SeenCorner {
  int corner = 0;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< [px]
};

/// The board at one time.
struct BoardView {
  TimeNs t_ns = 0;
  std::array<std::vector<SeenCorner>, 2> seen;  ///< by each camera
  Pose T_C0P;                                   ///< the board in the left camera, about
};

/// How the views lie, for words about what they cannot show.
struct BoardCoverage {
  double largest_tilt = 0.0;                     ///< between board and image plane [rad]
  double nearest = 0.0, farthest = 0.0;          ///< of the board's middle [m]
  std::array<double, 2> covered{};               ///< share of 8 x 6 cells of each image that saw a corner
  std::array<std::array<bool, 4>, 2> corners{};  ///< of each image, upper left, upper right, lower left, lower right
};

struct BoardResult {
  Calibration calibration;          ///< the cameras, with the standard deviations stated
  std::vector<Finding> findings;    ///< two lenses, and the right camera in the left
  Eigen::MatrixXd covariance;       ///< of them, in pixels, rad and m
  std::vector<Residual> residuals;  ///< of kind pixel
  std::size_t views = 0;            ///< that were used
  double sigma_px = 0.0;            ///< of a corner's coordinate, by the residuals
  BoardCoverage coverage;
  std::vector<std::string> advice;  ///< what the motion did not show, in words; may be empty
};

/// Fewer views than these are refused.
inline constexpr std::size_t kFewestViews = 8;

/// `start`: one or two cameras, with lenses good enough to begin with (focal length to a third), and the right one in
/// the left one; what is not shown stays as they say. Throws std::invalid_argument, in words for people, where views
/// are too few, where they do not fit a board, or where they do not show the focal length.
[[nodiscard]] BoardResult calibrate_cameras(const Calibration& start, const BoardShape& board,
                                            const std::vector<BoardView>& views);

}  // namespace ear::calibration
