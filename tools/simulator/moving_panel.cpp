#include "tools/simulator/moving_panel.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "tools/simulator/camera_pose.h"
#include "tools/simulator/lens.h"

namespace ear::simulator {
namespace {

// The sub-pictures of a picture: when in the exposure [-1/2, 1/2], and where in the pixel.
struct Instant {
  double late, right, down;
};
constexpr std::array<Instant, 5> kInstants{
    {{-0.4, 0.2, -0.4}, {-0.2, -0.4, 0.0}, {0.0, 0.0, 0.4}, {0.2, 0.4, -0.2}, {0.4, -0.2, 0.2}}};

// The panel at one instant as a camera sees it: the ray d = (x, y, 1) meets it at inverse depth m . d.
struct SeenFrom {
  Eigen::Vector3d m, u, v;
  double a0, b0;
};

SeenFrom view_of(const Panel& panel, const Eigen::Isometry3d& T_WC) {
  const Eigen::Matrix3d R_CW = T_WC.linear().transpose();
  const Eigen::Vector3d eye_W = T_WC.translation();
  const double behind = panel.offset - panel.normal_W.dot(eye_W);  // negative in front of it
  return {R_CW * panel.normal_W / behind, R_CW * panel.u_W, R_CW * panel.v_W, panel.u_W.dot(eye_W - panel.corner_W),
          panel.v_W.dot(eye_W - panel.corner_W)};
}

// The part of the picture in which the panel may be seen; all of it, if a corner is hardly before the camera.
cv::Rect bounds(const Panel& panel, const Eigen::Isometry3d& T_WC, const CameraCalibration& camera) {
  const cv::Rect all(0, 0, camera.width, camera.height);
  constexpr double kMargin = 30.0;  // [px] a lens bends straight lines, and the panel moves during the exposure
  double left = camera.width, right = 0.0, top = camera.height, bottom = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double u = i % 2 == 0 ? 0.0 : panel.width;
    const double v = i < 2 ? 0.0 : panel.height;
    const Eigen::Vector3d corner_W = panel.corner_W + u * panel.u_W + v * panel.v_W;
    const Eigen::Vector3d p_C = T_WC.inverse() * corner_W;
    if (p_C.z() < 0.2) return all;
    // Clamped: beyond the picture, but where the lens's model still holds.
    const Eigen::Vector2d pixel = to_pixel(camera, p_C.hnormalized().cwiseMax(-1.0).cwiseMin(1.0));
    left = std::min(left, pixel.x() - kMargin);
    right = std::max(right, pixel.x() + kMargin);
    top = std::min(top, pixel.y() - kMargin);
    bottom = std::max(bottom, pixel.y() + kMargin);
  }
  return cv::Rect(cv::Point2d(left, top), cv::Point2d(right, bottom)) & all;
}

}  // namespace

void draw_moving_panel(const PanelMotion& panel_at, const Texture& texture, const CameraCalibration& camera,
                       const Trajectory& trajectory, double t, const Exposure& exposure, const cv::Mat& brightness,
                       cv::Mat& grey) {
  std::array<SeenFrom, kInstants.size()> views;
  for (std::size_t i = 0; i < kInstants.size(); ++i) {
    const double instant = t + kInstants[i].late * exposure.seconds;
    views[i] = view_of(panel_at(instant), camera_pose(trajectory.at(instant), camera.T_BC));
  }
  const Panel middle = panel_at(t);
  const cv::Rect area = bounds(middle, camera_pose(trajectory.at(t), camera.T_BC), camera);
  for (int row = area.y; row < area.y + area.height; ++row) {
    for (int column = area.x; column < area.x + area.width; ++column) {
      const Eigen::Vector2d ray = to_ray(camera, Eigen::Vector2d(column, row));
      double sum = 0.0;
      double share = 0.0;
      for (std::size_t i = 0; i < views.size(); ++i) {
        const SeenFrom& view = views[i];
        const Eigen::Vector3d d(ray.x() + kInstants[i].right / camera.fu, ray.y() + kInstants[i].down / camera.fv, 1.0);
        const double inverse_depth = view.m.dot(d);
        if (inverse_depth <= 0.0) continue;
        const double a = view.a0 + view.u.dot(d) / inverse_depth;
        const double b = view.b0 + view.v.dot(d) / inverse_depth;
        if (a < 0.0 || b < 0.0 || a > middle.width || b > middle.height) continue;
        const auto pixel_size = static_cast<float>(1.0 / (inverse_depth * camera.fu));
        sum += texture.at(static_cast<float>(a), static_cast<float>(b), texture.level_of(pixel_size));
        share += 1.0;
      }
      if (share == 0.0) continue;
      float& value = grey.at<float>(row, column);
      const double own = sum * brightness.at<float>(row, column) * exposure.gain;
      const auto count = static_cast<double>(views.size());
      value = static_cast<float>((own + (count - share) * value) / count);
    }
  }
}

}  // namespace ear::simulator
