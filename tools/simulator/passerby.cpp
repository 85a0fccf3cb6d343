#include "tools/simulator/passerby.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/simulator/constants.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/materials.h"

namespace ear::simulator {
namespace {

constexpr double kWidth = 1.0;     // [m] two people side by side
constexpr double kHeight = 1.8;    // [m]
constexpr double kNearest = 0.6;   // [m] nobody comes nearer
constexpr double kCrossing = 5.0;  // [s] from one side to the other
constexpr double kHalfView = 0.9;  // tangent of half the angle that a camera sees, and some more

// The sub-pictures of a picture: when in the exposure [-1/2, 1/2], and where in the pixel.
struct Instant {
  double late, right, down;
};
constexpr std::array<Instant, 5> kInstants{
    {{-0.4, 0.2, -0.4}, {-0.2, -0.4, 0.0}, {0.0, 0.0, 0.4}, {0.2, 0.4, -0.2}, {0.4, -0.2, 0.2}}};

Eigen::Isometry3d pose_of(const Trajectory& trajectory, double t, const CameraCalibration& camera) {
  const Kinematics motion = trajectory.at(t);
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  T_WB.linear() = motion.R_WB;
  T_WB.translation() = motion.p_WB;
  return T_WB * camera.T_BC;
}

Eigen::Vector3d heading_of(const Kinematics& motion) {
  const Eigen::Vector3d left_W = motion.R_WO.col(1);
  return left_W.cross(Eigen::Vector3d::UnitZ()).normalized();
}

// The least room ahead, at the height of the vehicle, over the whole time.
double room_ahead(const Fault& fault, const Trajectory& trajectory, const Scene& scene, double wanted) {
  double room = wanted;
  for (double t = fault.start; t < fault.end(); t += 0.1) {
    const Kinematics motion = trajectory.at(t);
    for (const double angle : {-35.0, -20.0, 0.0, 20.0, 35.0}) {
      const Eigen::Vector3d direction_W =
          Eigen::AngleAxisd(angle * kDegree, Eigen::Vector3d::UnitZ()) * heading_of(motion);
      const Eigen::Vector3d eye_W = motion.p_WB + Eigen::Vector3d(0.0, 0.0, 0.2);
      const auto hit = scene.cast(eye_W, direction_W);
      if (hit && hit->panel != kGround) room = std::min(room, hit->range * std::cos(angle * kDegree));
    }
  }
  return room;
}

// The passer-by at one instant as a camera sees it: the ray d = (x, y, 1) meets it at inverse depth m . d.
struct View {
  Eigen::Vector3d m, u, v;
  double a0, b0;
};

View view_of(const Panel& panel, const Eigen::Isometry3d& T_WC) {
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

Passerby::Passerby(const Fault& fault, const Trajectory& trajectory, const Scene& scene)
    : fault_(fault),
      trajectory_(trajectory),
      terrain_(scene.terrain),
      distance_(std::max(kNearest, 0.9 * room_ahead(fault, trajectory, scene, fault.parameter / 0.9))) {}

Panel Passerby::panel(double t) const {
  const Kinematics motion = trajectory_.at(t);
  const Eigen::Vector3d ahead_W = heading_of(motion);
  const Eigen::Vector3d left_W = Eigen::Vector3d::UnitZ().cross(ahead_W);
  const double crossings = std::max(1.0, std::round(fault_.duration / kCrossing));
  const double outside = kHalfView * distance_ + 0.5 * kWidth;
  const double aside = outside * std::cos(kPi * crossings * (t - fault_.start) / fault_.duration);
  Eigen::Vector3d foot_W = motion.p_WB + distance_ * ahead_W + aside * left_W;
  foot_W.z() = terrain_.height(foot_W.x(), foot_W.y());
  return {foot_W + 0.5 * kWidth * left_W, -left_W, Eigen::Vector3d::UnitZ(), kWidth, kHeight, Material::poster};
}

bool hides(const Panel& passerby, const Eigen::Vector3d& eye_W, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d ray_W = p_W - eye_W;
  const double approach = passerby.normal_W.dot(ray_W);
  if (approach >= 0.0) return false;
  const double range = (passerby.offset - passerby.normal_W.dot(eye_W)) / approach;
  return range > 0.0 && passerby.contains(eye_W + range * ray_W);
}

Texture paint_passerby(const Passerby& passerby, std::uint64_t seed) {
  Rng rng = fault_rng(passerby.fault(), seed);
  return paint_panel(passerby.panel(passerby.fault().start), rng);
}

void draw_passerby(const Passerby& passerby, const Texture& texture, const CameraCalibration& camera,
                   const Trajectory& trajectory, double t, const Exposure& exposure, const cv::Mat& brightness,
                   cv::Mat& grey) {
  std::array<View, kInstants.size()> views;
  for (std::size_t i = 0; i < kInstants.size(); ++i) {
    const double instant = t + kInstants[i].late * exposure.seconds;
    views[i] = view_of(passerby.panel(instant), pose_of(trajectory, instant, camera));
  }
  const Panel middle = passerby.panel(t);
  const cv::Rect area = bounds(middle, pose_of(trajectory, t, camera), camera);
  for (int row = area.y; row < area.y + area.height; ++row) {
    for (int column = area.x; column < area.x + area.width; ++column) {
      const Eigen::Vector2d ray = to_ray(camera, Eigen::Vector2d(column, row));
      double sum = 0.0;
      double share = 0.0;
      for (std::size_t i = 0; i < views.size(); ++i) {
        const View& view = views[i];
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
