#include "calibration/board_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "calibration/degree.h"

namespace ear::calibration {
namespace {

constexpr int kColumns = 8;  // cells of the image
constexpr int kRows = 6;
constexpr double kCorner = 0.15;     // of the image's width and height: what counts as its corner
constexpr double kLeastTilt = 20.0;  // [deg]
constexpr double kLeastCovered = 0.7;
constexpr std::size_t kFewViews = 20;
const char* const kTilt = "tilt the board by 30 to 45 degrees to all sides";
const char* const kCorners = "bring the board into all corners of the image";

/// What the corners of one image were seen in.
void cover(const CameraCalibration& camera, const std::vector<BoardView>& views, std::size_t index,
           BoardCoverage& coverage) {
  std::array<bool, static_cast<std::size_t>(kColumns * kRows)> cells{};
  for (const BoardView& view : views) {
    for (const SeenCorner& seen : view.seen[index]) {
      const double x = std::clamp((seen.px.x() + 0.5) / camera.width, 0.0, 0.999);
      const double y = std::clamp((seen.px.y() + 0.5) / camera.height, 0.0, 0.999);
      cells[static_cast<std::size_t>(static_cast<int>(y * kRows) * kColumns + static_cast<int>(x * kColumns))] = true;
      if (std::min(x, 1.0 - x) > kCorner || std::min(y, 1.0 - y) > kCorner) continue;
      coverage.corners[index][(y > 0.5 ? 2U : 0U) + (x > 0.5 ? 1U : 0U)] = true;
    }
  }
  coverage.covered[index] =
      static_cast<double>(std::count(cells.begin(), cells.end(), true)) / static_cast<double>(cells.size());
}

std::string missing_corners(const std::array<bool, 4>& seen) {
  constexpr std::array kNames{"upper left", "upper right", "lower left", "lower right"};
  std::string names;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) names += (names.empty() ? "" : ", ") + std::string(kNames[i]);
  }
  return names;
}

}  // namespace

BoardCoverage coverage_of(const std::vector<CameraCalibration>& cameras, const BoardShape& board,
                          const std::vector<BoardView>& views) {
  BoardCoverage coverage;
  coverage.nearest = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d middle(0.5 * board.columns * board.square, 0.5 * board.rows * board.square, 0.0);
  for (const BoardView& view : views) {
    const double away = (view.T_C0P.R * middle + view.T_C0P.p).norm();
    coverage.nearest = std::min(coverage.nearest, away);
    coverage.farthest = std::max(coverage.farthest, away);
    const double upright = std::min(1.0, std::abs(view.T_C0P.R(2, 2)));
    coverage.largest_tilt = std::max(coverage.largest_tilt, std::acos(upright));
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) cover(cameras[i], views, i, coverage);
  return coverage;
}

std::vector<std::string> advice_on(const BoardCoverage& coverage, std::size_t cameras, std::size_t views,
                                   const std::vector<Finding>& findings) {
  std::vector<std::string> advice;
  if (views < kFewViews) {
    advice.push_back("only " + std::to_string(views) + " views: move the board for half a minute, with rests");
  }
  if (coverage.largest_tilt < kLeastTilt * kDegree) {
    advice.push_back("the board was never tilted by more than " +
                     std::to_string(std::lround(coverage.largest_tilt / kDegree)) +
                     " degrees, so that focal length and distance look alike: " + kTilt);
  }
  for (std::size_t i = 0; i < cameras; ++i) {
    const std::string camera = "cam" + std::to_string(i);
    if (const std::string names = missing_corners(coverage.corners[i]); !names.empty()) {
      std::string words = camera;
      words.append(": never in the image's corner ")
          .append(names)
          .append(", where the lens bends most: ")
          .append(kCorners);
      advice.push_back(std::move(words));
    } else if (coverage.covered[i] < kLeastCovered) {
      advice.push_back(camera + ": only " + std::to_string(std::lround(100.0 * coverage.covered[i])) +
                       " % of the image saw the board: bring it everywhere");
    }
  }
  for (const Finding& finding : findings) {
    if (!finding.shown) advice.push_back(finding.name + " was not shown: " + finding.motion_wanted);
  }
  return advice;
}

std::string board_motion_that_shows(const std::string& entry) {
  if (entry.find("distortion") != std::string::npos) return kCorners;
  if (entry.find("in cam0") != std::string::npos) return "hold the board where both cameras see it, near and tilted";
  return kTilt;
}

}  // namespace ear::calibration
