#include "tools/simulator/passerby.h"

#include <algorithm>
#include <cmath>

#include "tools/simulator/constants.h"
#include "tools/simulator/materials.h"

namespace ear::simulator {
namespace {

constexpr double kPairWidth = 1.0;   // [m] two people side by side
constexpr double kPairHeight = 1.8;  // [m]
constexpr double kNearest = 0.6;     // [m] nobody comes nearer
constexpr double kCrossing = 5.0;    // [s] from one side to the other
constexpr double kHalfView = 0.9;    // tangent of half the angle that a camera sees, and some more

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
  const double outside = kHalfView * distance_ + 0.5 * kPairWidth;
  const double aside = outside * std::cos(kPi * crossings * (t - fault_.start) / fault_.duration);
  Eigen::Vector3d foot_W = motion.p_WB + distance_ * ahead_W + aside * left_W;
  foot_W.z() = terrain_.height(foot_W.x(), foot_W.y());
  return {
      foot_W + 0.5 * kPairWidth * left_W, -left_W, Eigen::Vector3d::UnitZ(), kPairWidth, kPairHeight, Material::poster};
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

}  // namespace ear::simulator
