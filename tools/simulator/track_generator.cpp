#include "tools/simulator/track_generator.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tools/simulator/camera_pose.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/sensors.h"

namespace ear::simulator {
namespace {

constexpr double kImageCell = 40.0;      // [px] one feature per cell is drawn before any cell gets its second
constexpr double kImageBorder = 3.0;     // [px] front ends keep away from the border
constexpr double kFarthestFeature = 30;  // [m]
constexpr double kMostVeiled = 0.3;      // what something before the lens dims more than this cannot be followed

struct Landmark {
  std::uint64_t id;
  Eigen::Vector3d p_W;
  Eigen::Vector2d pixel;  // in the left picture
};

// One camera at one instant.
struct CameraView {
  const Scene& scene;
  const CameraCalibration& camera;
  Eigen::Isometry3d T_WC;
  const Obstruction& obstruction;
  std::size_t index;  // of the camera
  double t;           // [s]
};

// Where a camera sees a point, if it does.
std::optional<Eigen::Vector2d> see(const CameraView& view, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d p_C = view.T_WC.linear().transpose() * (p_W - view.T_WC.translation());
  const auto pixel = project(view.camera, p_C, kImageBorder);
  if (!pixel || view.obstruction.veil(view.index, view.t, p_C.hnormalized()).opacity > kMostVeiled) {
    return std::nullopt;
  }
  return view.scene.sees(view.T_WC.translation(), p_W) ? pixel : std::nullopt;
}

Eigen::Vector2d measure(const CameraCalibration& camera, const Eigen::Vector2d& pixel, double sigma_px, Rng& rng) {
  const double du = normal(rng, sigma_px);
  const double dv = normal(rng, sigma_px);
  return to_ray(camera, pixel + Eigen::Vector2d(du, dv));
}

// Fills empty cells of the grid, in random order, with points on whatever the camera sees there.
void replenish(std::vector<Landmark>& landmarks, std::vector<Eigen::Vector3d>& points_W, const CameraView& view,
               int max_features, Rng& rng) {
  const CameraCalibration& camera = view.camera;
  const Eigen::Isometry3d& T_WC = view.T_WC;
  const int columns = static_cast<int>(std::ceil(camera.width / kImageCell));
  const int rows = static_cast<int>(std::ceil(camera.height / kImageCell));
  std::vector<char> taken(static_cast<std::size_t>(columns * rows), 0);
  const auto cell_of = [&](const Eigen::Vector2d& pixel) {
    return static_cast<std::size_t>(static_cast<int>(pixel.y() / kImageCell) * columns +
                                    static_cast<int>(pixel.x() / kImageCell));
  };
  for (const Landmark& landmark : landmarks) taken[cell_of(landmark.pixel)] = 1;
  std::vector<std::size_t> empty;
  for (std::size_t i = 0; i < taken.size(); ++i) {
    if (!taken[i]) empty.push_back(i);
  }
  std::shuffle(empty.begin(), empty.end(), rng);
  for (const std::size_t cell : empty) {
    if (landmarks.size() >= static_cast<std::size_t>(max_features)) return;
    const std::size_t column = cell % static_cast<std::size_t>(columns);
    const std::size_t row = cell / static_cast<std::size_t>(columns);
    const double u = kImageCell * (static_cast<double>(column) + uniform(rng, 0.0, 1.0));
    const double v = kImageCell * (static_cast<double>(row) + uniform(rng, 0.0, 1.0));
    const Eigen::Vector3d direction_W = T_WC.linear() * to_ray(camera, {u, v}).homogeneous().normalized();
    const auto hit = view.scene.cast(T_WC.translation(), direction_W);
    if (!hit || hit->range > kFarthestFeature) continue;
    const Eigen::Vector3d p_W = T_WC.translation() + hit->range * direction_W;
    const auto pixel = see(view, p_W);
    if (!pixel) continue;
    points_W.push_back(p_W);
    landmarks.push_back({points_W.size(), p_W, *pixel});
  }
}

}  // namespace

Tracks generate_tracks(const Scene& scene, const Trajectory& trajectory, const std::vector<CameraCalibration>& cameras,
                       const std::vector<TimeNs>& stamps, const Obstruction& obstruction, const TrackOptions& options,
                       Rng& rng) {
  const CameraCalibration& left = cameras.front();
  Tracks tracks;
  tracks.frames.reserve(stamps.size());
  std::vector<Landmark> landmarks;
  TimeNs previous_ns = stamps.empty() ? 0 : stamps.front();
  for (const TimeNs t_ns : stamps) {
    const Kinematics motion = trajectory.at(motion_time(t_ns));
    const CameraView left_view{scene, left, camera_pose(motion, left.T_BC), obstruction, 0, motion_time(t_ns)};

    const double loss = 1.0 - std::exp(-seconds_between(previous_ns, t_ns) / options.mean_life);
    previous_ns = t_ns;
    std::vector<Landmark> kept;
    for (const Landmark& landmark : landmarks) {
      if (uniform(rng, 0.0, 1.0) < loss) continue;
      if (const auto pixel = see(left_view, landmark.p_W)) kept.push_back({landmark.id, landmark.p_W, *pixel});
    }
    landmarks = std::move(kept);
    replenish(landmarks, tracks.points_W, left_view, options.max_features, rng);

    FeatureFrame frame{t_ns, {}};
    frame.features.reserve(landmarks.size());
    for (const Landmark& landmark : landmarks) {
      FeatureObservation seen;
      seen.id = landmark.id;
      seen.left = measure(left, landmark.pixel, options.sigma_px, rng);
      if (cameras.size() > 1) {
        const CameraView right_view{scene,       cameras[1], camera_pose(motion, cameras[1].T_BC),
                                    obstruction, 1,          left_view.t};
        if (const auto pixel = see(right_view, landmark.p_W)) {
          seen.right = measure(cameras[1], *pixel, options.sigma_px, rng);
          seen.has_right = true;
        }
      }
      frame.features.push_back(seen);
    }
    tracks.frames.push_back(std::move(frame));
  }
  return tracks;
}

}  // namespace ear::simulator
