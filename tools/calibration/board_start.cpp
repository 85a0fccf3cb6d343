#include "tools/calibration/board_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>

#include "frontend/lens.h"

namespace ear::calibration {
namespace {

constexpr std::size_t kTried = 25;  // views, for the focal length
constexpr double kShortest = 0.3;   // focal lengths, of the image's width
constexpr double kLongest = 2.5;
constexpr int kSteps = 16;

struct Placed {
  Pose T_CP;
  double error_px = 0.0;  ///< root mean square
};

/// By the lens as it is; nothing where that has no inverse, or the board would be behind the camera.
std::optional<Placed> placed(const CameraCalibration& camera, const BoardShape& board,
                             const std::vector<SeenCorner>& corners) {
  if (corners.size() < 6) return std::nullopt;
  const Lens lens(camera);
  std::vector<cv::Point3d> there;
  std::vector<cv::Point2d> rays;
  for (const SeenCorner& corner : corners) {
    const std::optional<Eigen::Vector2d> ray = lens.to_normalized(corner.px);
    if (!ray) continue;
    const Eigen::Vector2d at = board.at(corner.corner);
    there.emplace_back(at.x(), at.y(), 0.0);
    rays.emplace_back(ray->x(), ray->y());
  }
  if (rays.size() < 6) return std::nullopt;
  cv::Vec3d turn, p;
  const cv::Mat eye = cv::Mat::eye(3, 3, CV_64F);
  if (!cv::solvePnP(there, rays, eye, cv::noArray(), turn, p, false, cv::SOLVEPNP_IPPE) || !(p[2] > 0.0)) {
    return std::nullopt;
  }
  std::vector<cv::Point2d> predicted;
  cv::projectPoints(there, turn, p, eye, cv::noArray(), predicted);
  double sum = 0.0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const cv::Point2d off = predicted[i] - rays[i];
    sum += off.dot(off);
  }
  cv::Matx33d R;
  cv::Rodrigues(turn, R);
  Placed result;
  for (int i = 0; i < 3; ++i) {
    result.T_CP.p(i) = p[i];
    for (int j = 0; j < 3; ++j) result.T_CP.R(i, j) = R(i, j);
  }
  result.error_px = camera.fu * std::sqrt(sum / static_cast<double>(rays.size()));
  return result;
}

/// Median error over some views; infinite where there are none.
double misfit(const CameraCalibration& camera, const BoardShape& board, const std::vector<BoardView>& views,
              std::size_t index) {
  std::vector<double> errors;
  const std::size_t stride = views.size() / kTried + 1;
  for (std::size_t i = 0; i < views.size(); i += stride) {
    if (const auto found = placed(camera, board, views[i].seen[index])) errors.push_back(found->error_px);
  }
  if (errors.empty()) return std::numeric_limits<double>::infinity();
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  return errors[errors.size() / 2];
}

CameraCalibration guessed(CameraCalibration camera, const BoardShape& board, const std::vector<BoardView>& views,
                          std::size_t index) {
  camera.cu = 0.5 * (camera.width - 1);
  camera.cv = 0.5 * (camera.height - 1);
  double least = std::numeric_limits<double>::infinity();
  double best = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double f = camera.width * kShortest * std::pow(kLongest / kShortest, i / static_cast<double>(kSteps));
    camera.fu = camera.fv = f;
    const double error = misfit(camera, board, views, index);
    if (error < least) std::tie(least, best) = std::pair(error, f);
  }
  if (best == 0.0) throw std::invalid_argument("cam" + std::to_string(index) + ": no image shows the board");
  camera.fu = camera.fv = best;
  return camera;
}

Eigen::Isometry3d isometry(const Pose& pose) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = pose.R;
  T.translation() = pose.p;
  return T;
}

/// The right camera in the left one, by that view which the others agree with best.
Eigen::Isometry3d stereo_pose(const std::vector<Eigen::Isometry3d>& by_view) {
  if (by_view.empty()) throw std::invalid_argument("there is no view in which both cameras see the board");
  const Eigen::Isometry3d* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Isometry3d& candidate : by_view) {
    std::vector<double> off;
    for (const Eigen::Isometry3d& other : by_view) {
      const Eigen::AngleAxisd turn(candidate.linear().transpose() * other.linear());
      off.push_back(std::abs(turn.angle()) + (candidate.translation() - other.translation()).norm());
    }
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
    if (off[off.size() / 2] < least) {
      least = off[off.size() / 2];
      best = &candidate;
    }
  }
  return *best;
}

}  // namespace

Calibration board_start(const std::vector<CameraCalibration>& sizes, LensModel lens, const BoardShape& board,
                        std::vector<BoardView>& views) {
  Calibration start;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    CameraCalibration camera = sizes[i];
    camera.lens = lens;
    start.cameras.push_back(guessed(camera, board, views, i));
  }
  std::vector<Eigen::Isometry3d> by_view;
  std::vector<std::array<std::optional<Placed>, 2>> poses;
  for (const BoardView& view : views) {
    std::array<std::optional<Placed>, 2> pose;
    for (std::size_t i = 0; i < start.cameras.size(); ++i) pose[i] = placed(start.cameras[i], board, view.seen[i]);
    if (pose[0] && pose[1]) by_view.push_back(isometry(pose[0]->T_CP) * isometry(pose[1]->T_CP).inverse());
    poses.push_back(pose);
  }
  if (start.cameras.size() > 1) start.cameras[1].T_BC = stereo_pose(by_view);
  std::vector<BoardView> kept;
  for (std::size_t v = 0; v < views.size(); ++v) {
    BoardView view = views[v];
    if (poses[v][0]) {
      view.T_C0P = poses[v][0]->T_CP;
    } else if (poses[v][1]) {
      const Eigen::Isometry3d T_C0P =
          start.cameras[0].T_BC.inverse(Eigen::Isometry) * start.cameras[1].T_BC * isometry(poses[v][1]->T_CP);
      view.T_C0P = {T_C0P.linear(), T_C0P.translation()};
    } else {
      continue;
    }
    kept.push_back(std::move(view));
  }
  views = std::move(kept);
  return start;
}

}  // namespace ear::calibration
