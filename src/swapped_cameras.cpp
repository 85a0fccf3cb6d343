#include "src/swapped_cameras.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/lens.h"
#include "frontend/stereo_geometry.h"

namespace ear {
namespace {

constexpr int kDecided = 10;          // more matches on one side: odds of a million
constexpr int kMostOfAPair = 4;       // of these
constexpr double kSignificant = 3.0;  // [px] from infinity
constexpr int kCorners = 60;
constexpr int kHalfPatch = 8;            // [px]
constexpr double kOffLine = 2.0;         // [px] from the epipolar line, for calibrations that are not exact
constexpr double kMostDisparity = 96.0;  // [px] that is searched
constexpr double kAlike = 0.85;          // correlation of a match, at least
constexpr double kDistinct = 0.05;       // by so much it is better than all that are not its neighbours

cv::Mat mat_of(const ImageView& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),  // NOLINT: only read
          static_cast<std::size_t>(image.stride)};
}

/// Two images, and the cameras that are supposed to have taken them.
struct Pair {
  Pair(const CameraCalibration& from, const CameraCalibration& to, cv::Mat from_image, cv::Mat to_image)
      : left_lens(from), right_lens(to), left(std::move(from_image)), right(std::move(to_image)) {
    const Eigen::Isometry3d T_10 = to.T_BC.inverse() * from.T_BC;
    right_from_left = {T_10.linear(), T_10.translation()};
    per_pixel = 1.0 / (right_lens.focal_px() * T_10.translation().norm());
  }

  Lens left_lens, right_lens;
  Transfer right_from_left;
  double per_pixel;  ///< [1/m] inverse depth
  cv::Mat left, right;
};

/// Where the right image is searched for a ray: around the half of its epipolar line that is in front of the cameras.
cv::Rect search_area(const Pair& pair, const Eigen::Vector2d& ray) {
  cv::Rect2d area;
  for (const double pixels : {0.0, 0.5 * kMostDisparity, kMostDisparity}) {
    const Eigen::Vector3d point = pair.right_from_left.scaled_point(ray, pixels * pair.per_pixel);
    if (!(point.z() > 0.0)) continue;
    const auto at = pair.right_lens.to_pixel(point.hnormalized());
    if (at) area |= cv::Rect2d(at->x() - kOffLine, at->y() - kOffLine, 2.0 * kOffLine, 2.0 * kOffLine);
  }
  const cv::Rect with_patch(static_cast<int>(area.x) - kHalfPatch, static_cast<int>(area.y) - kHalfPatch,
                            static_cast<int>(area.width) + 2 * kHalfPatch + 1,
                            static_cast<int>(area.height) + 2 * kHalfPatch + 1);
  return with_patch & cv::Rect(0, 0, pair.right.cols, pair.right.rows);
}

/// The pixel of the right image that looks like the left one's at `corner`, and no other there does.
std::optional<Eigen::Vector2d> match(const Pair& pair, const cv::Point& corner, const Eigen::Vector2d& ray) {
  constexpr int kSize = 2 * kHalfPatch + 1;
  const cv::Rect patch(corner.x - kHalfPatch, corner.y - kHalfPatch, kSize, kSize);
  const cv::Rect area = search_area(pair, ray);
  if ((patch & cv::Rect(0, 0, pair.left.cols, pair.left.rows)) != patch) return std::nullopt;
  if (area.width <= kSize || area.height <= kSize) return std::nullopt;
  cv::Mat likeness;
  cv::matchTemplate(pair.right(area), pair.left(patch), likeness, cv::TM_CCOEFF_NORMED);
  double best = 0.0, second = 0.0;
  cv::Point at;
  cv::minMaxLoc(likeness, nullptr, &best, nullptr, &at);
  if (!(best > kAlike)) return std::nullopt;
  cv::rectangle(likeness, at - cv::Point(3, 3), at + cv::Point(3, 3), cv::Scalar(-1.0), cv::FILLED);
  cv::minMaxLoc(likeness, nullptr, &second);
  if (second > best - kDistinct) return std::nullopt;
  return Eigen::Vector2d(area.x + at.x + kHalfPatch, area.y + at.y + kHalfPatch);
}

/// Is what is at a corner seen in front of these cameras, and near enough to show the difference?
bool is_in_front(const Pair& pair, const cv::Point& corner) {
  const auto left = pair.left_lens.to_normalized({corner.x, corner.y});
  const auto pixel = left ? match(pair, corner, *left) : std::nullopt;
  const auto right = pixel ? pair.right_lens.to_normalized(*pixel) : std::nullopt;
  const auto point = right ? intersect(pair.right_from_left, *left, *right) : std::nullopt;
  return point && point->epipolar_distance * pair.right_lens.focal_px() <= kOffLine &&
         point->inverse_depth > kSignificant * pair.per_pixel;
}

}  // namespace

void SwappedCameras::add(const ImageView& left, const ImageView& right) {
  if (verdict_ != Verdict::open || left.empty() || right.empty()) return;
  const Pair stated(left_, right_, mat_of(left), mat_of(right));
  const Pair swapped(right_, left_, stated.left, stated.right);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(stated.left, corners, kCorners, 0.02, 20.0);
  int difference = 0;
  for (const cv::Point2f& corner : corners) {
    const cv::Point at(cvRound(corner.x), cvRound(corner.y));
    const bool fits = is_in_front(stated, at), fits_exchanged = is_in_front(swapped, at);
    if (fits == fits_exchanged) continue;
    ++(fits ? as_stated_ : exchanged_);
    difference += fits ? 1 : -1;
  }
  balance_ += std::clamp(difference, -kMostOfAPair, kMostOfAPair);
  if (balance_ >= kDecided) verdict_ = Verdict::right;
  if (balance_ <= -kDecided) verdict_ = Verdict::swapped;
}

}  // namespace ear
