#include "calibration/segment.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <unordered_map>

namespace ear::calibration {
namespace {

Keyframe make_keyframe(const GuessedState& from, const Calibration& given) {
  Keyframe keyframe;
  const NavState& state = from.state;
  keyframe.t_ns = state.t_ns;
  keyframe.late = given.camera_time_offset + seconds_between(state.t_ns, from.stamp_ns);
  keyframe.pose = smoother::to_block({state.q_WB.toRotationMatrix(), state.p_WB});
  Eigen::Map<Eigen::Matrix<double, 9, 1>>(keyframe.motion.data()) << state.v_W, state.b_g, state.b_a;
  keyframe.centre = {state.p_WB.x(), state.p_WB.y()};
  return keyframe;
}

void connect(Segment& segment, const Eigen::Matrix3d& gyro_matrix) {
  const Drive& drive = *segment.drive;
  for (std::size_t i = 0; i + 1 < segment.keyframes.size(); ++i) {
    Keyframe& keyframe = segment.keyframes[i];
    const TimeNs next_ns = segment.keyframes[i + 1].t_ns;
    keyframe.since = corrected(pieces_between(drive.imu, keyframe.t_ns, next_ns), gyro_matrix);
    if (keyframe.since.empty()) {
      const double at = seconds_between(segment.keyframes.front().t_ns, keyframe.t_ns);
      throw std::invalid_argument(drive.name + ": inertial samples are missing " + std::to_string(at) +
                                  " s after the first estimate: a calibration needs all of them");
    }
  }
}

Eigen::Vector2d pixel(const CameraCalibration& camera, const Eigen::Vector2d& normalized) {
  return to_pixel<double>(camera, {}, normalized);
}

std::vector<Point> all_points(const FirstGuess& guess, const Calibration& given) {
  std::unordered_map<std::uint64_t, std::size_t> index;
  std::vector<Point> points;
  for (std::size_t k = 0; k < guess.states.size(); ++k) {
    for (const FeatureObservation& feature : guess.states[k].features) {
      const auto [found, added] = index.emplace(feature.id, points.size());
      if (added) points.emplace_back();
      Seen seen;
      seen.keyframe = k;
      seen.left = feature.left;
      seen.left_px = pixel(given.cameras[0], feature.left);
      seen.has_right = feature.has_right && given.cameras.size() > 1;
      if (seen.has_right) {
        seen.right = feature.right;
        seen.right_px = pixel(given.cameras[1], feature.right);
      }
      points[found->second].seen.push_back(seen);
    }
  }
  return points;
}

/// Longest first, until every keyframe sees enough.
void choose_points(std::vector<Point>& all, const PointChoice& choice, Segment& segment) {
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return all[a].seen.size() > all[b].seen.size(); });
  std::vector<std::size_t> count(segment.keyframes.size(), 0);
  for (const std::size_t i : order) {
    const std::vector<Seen>& seen = all[i].seen;
    if (seen.size() < choice.shortest) break;
    const auto short_of = [&](const Seen& s) { return count[s.keyframe] < choice.per_keyframe; };
    if (std::none_of(seen.begin(), seen.end(), short_of)) continue;
    for (const Seen& s : seen) ++count[s.keyframe];
    segment.points.push_back(std::move(all[i]));
  }
}

/// The mean rate around a time, from the paths before and after; none where it is no more than the gyroscope's noise:
/// that would seem to show a clock where nothing moves.
Eigen::Vector3d rate_at(const std::vector<PathNode>& before, const std::vector<PathNode>& after, TimeNs t_ns,
                        double gyro_noise) {
  constexpr TimeNs kHalf = 25'000'000;   // [ns]
  constexpr double kSignificant = 25.0;  // times the variance of an axis: five standard deviations
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();
  double duration = 0.0;
  for (const auto* path : {&before, &after}) {
    for (std::size_t i = 0; i + 1 < path->size(); ++i) {
      const PathNode& node = (*path)[i];
      if (node.t_ns < t_ns - kHalf || node.t_ns >= t_ns + kHalf) continue;
      const double dt = seconds_between(node.t_ns, (*path)[i + 1].t_ns);
      turned += dt * node.rate_B;
      duration += dt;
    }
  }
  if (duration <= 0.0) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d rate = turned / duration;
  const double noise = kSignificant * gyro_noise * gyro_noise / duration;
  return rate * std::max(0.0, 1.0 - noise / std::max(1e-300, rate.squaredNorm()));
}

}  // namespace

Segment make_segment(const Drive& drive, const FirstGuess& guess, const Calibration& given, const PointChoice& choice) {
  Segment segment;
  segment.drive = &drive;
  for (const GuessedState& state : guess.states) segment.keyframes.push_back(make_keyframe(state, given));
  connect(segment, given.imu.gyro_matrix);
  if (!given.cameras.empty()) {
    std::vector<Point> points = all_points(guess, given);
    choose_points(points, choice, segment);
  }
  return segment;
}

NavState state_of(const Keyframe& keyframe) {
  const Pose pose = smoother::to_pose(keyframe.pose.data());
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> motion(keyframe.motion.data());
  NavState state;
  state.t_ns = keyframe.t_ns;
  state.q_WB = Eigen::Quaterniond(pose.R);
  state.p_WB = pose.p;
  state.v_W = motion.segment<3>(smoother::motion_entry::v);
  state.b_g = motion.segment<3>(smoother::motion_entry::b_g);
  state.b_a = motion.segment<3>(smoother::motion_entry::b_a);
  return state;
}

void renew_paths(Segment& segment, const GyroErrors& errors, double gyro_noise) {
  for (Keyframe& keyframe : segment.keyframes) {
    if (!keyframe.since.empty())
      keyframe.path = path_along(corrected(keyframe.since, gyro_matrix(errors)), state_of(keyframe));
  }
  for (std::size_t i = 0; i < segment.keyframes.size(); ++i) {
    Keyframe& keyframe = segment.keyframes[i];
    keyframe.rate_B = rate_at(i > 0 ? segment.keyframes[i - 1].path : std::vector<PathNode>{}, keyframe.path,
                              keyframe.t_ns, gyro_noise);
  }
}

void place_points(Segment& segment, const CameraState& cameras) {
  std::vector<Sighting> sightings;
  for (Point& point : segment.points) {
    sightings.clear();
    for (const Seen& seen : point.seen) {
      const Keyframe& keyframe = segment.keyframes[seen.keyframe];
      const Pose T_WB = smoother::to_pose(keyframe.pose.data());
      const Eigen::Vector3d v_W = Eigen::Map<const Eigen::Vector3d>(keyframe.motion.data());
      const double late = keyframe.late + cameras.time_offset;
      const Eigen::Matrix3d R_WS = T_WB.R * exp_so3(keyframe.rate_B * late);
      const Eigen::Matrix3d R_WC0 = R_WS * cameras.T_BC0.R;
      const Eigen::Vector3d p_WC0 = T_WB.p + v_W * late + R_WS * cameras.T_BC0.p;
      sightings.push_back({R_WC0.transpose(), p_WC0, seen.left});
      if (!seen.has_right) continue;
      sightings.push_back({(R_WC0 * cameras.T_C0C1.R).transpose(), p_WC0 + R_WC0 * cameras.T_C0C1.p, seen.right});
    }
    point.used = false;
    if (sightings.size() < 2) continue;
    const auto placed = triangulate(sightings);
    point.used = placed.has_value();
    if (!placed) continue;
    point.anchor = *placed;
    point.block = {placed->bearing_A.x(), placed->bearing_A.y(), placed->inverse_depth};
  }
}

}  // namespace ear::calibration
