// What wheels and beams measure, as models of JetFactor. Equations: docs/calibration.md.
//
// The ground block (3) of a keyframe: height h and slopes a, b of the plane z = h + a (x - x0) + b (y - y0) under it;
// (x0, y0) stays where it is.
#pragma once

#include <Eigen/Core>
#include <array>

#include "calibration/jet_factor.h"
#include "filter/ekf/state.h"

namespace ear::calibration {

/// The middle of the axle and its direction to the left, in the body.
template <typename T>
struct Axle {
  Vector3<T> p;
  Vector3<T> y;
  T radius_left, radius_right, track_width;
};

/// `wheels` and `axle`: blocks of Parameters, errors of what was given.
template <typename T>
[[nodiscard]] Axle<T> axle_of(const OdometerState& given, const BlockValues<T>& wheels, const BlockValues<T>& axle) {
  const Vector3<T> y_O = Vector3<T>(-axle.v[4], T(1.0), axle.v[3]).normalized();  // as in applied()
  Axle<T> result;
  result.p = given.T_BO.p.cast<T>() + axle.vector3(0);
  result.y = given.T_BO.R.cast<T>() * y_O;
  result.radius_left = given.wheel_radius(0) * (T(1.0) + wheels.v[0] + T(0.5) * wheels.v[1]);
  result.radius_right = given.wheel_radius(1) * (T(1.0) + wheels.v[0] - T(0.5) * wheels.v[1]);
  result.track_width = given.track_width * (T(1.0) + wheels.v[2]);
  return result;
}

/// Both wheels rolled from keyframe i to j. The centre of a wheel goes as far as its rim turns over the ground: the
/// encoder's angle and the body's own turn about the axle. Blocks: pose i, pose j, motion i, wheels, axle, time.
/// Residuals: left, right, and along the axle [m], whitened.
struct RollModel {
  OdometerState given;
  Eigen::Vector2d angle = Eigen::Vector2d::Zero();         ///< that the wheels turned, left and right [rad]
  Eigen::Vector2d speed_gained = Eigen::Vector2d::Zero();  ///< of their turning from i to j [rad/s]
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();        ///< integral of the measured rate [rad]
  double duration = 0.0;                                   ///< [s]
  std::array<Eigen::Vector3d, 2> along;                    ///< direction of each wheel's path, in the body at i
  Eigen::Matrix3d R_im = Eigen::Matrix3d::Identity();      ///< from the body in the middle of the path to that at i
  Eigen::Vector3d bend = Eigen::Vector3d::Zero();          ///< path less chord, as the residuals [m]
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Identity();

  template <typename T>
  void operator()(const std::array<BlockValues<T>, 6>& blocks, T* residual) const {
    const Axle<T> axle = axle_of(given, blocks[3], blocks[4]);
    const Vector3<T> b_g = blocks[2].vector3(smoother::motion_entry::b_g);
    const T& late = blocks[5].v[0];
    const T pitched = axle.y.dot(turned.cast<T>() - b_g * T(duration));
    const Matrix3<T> R_BiW = blocks[0].R().transpose();
    const Matrix3<T> R_ij = R_BiW * blocks[1].R();
    const Vector3<T> moved = R_BiW * (blocks[1].p() - blocks[0].p());
    const Vector3<T> moved_O = moved + R_ij * axle.p - axle.p;
    Vector3<T> r;
    for (int side = 0; side < 2; ++side) {
      const Vector3<T> lever = axle.p + axle.y * (axle.track_width * (side == 0 ? 0.5 : -0.5));
      const Vector3<T> moved_C = moved + R_ij * lever - lever;
      const T radius = side == 0 ? axle.radius_left : axle.radius_right;
      const T rolled = radius * (angle(side) - speed_gained(side) * late + pitched);
      r(side) = rolled - along[static_cast<std::size_t>(side)].cast<T>().dot(moved_C) - bend(side);
    }
    r(2) = -(R_im.cast<T>() * axle.y).dot(moved_O) - bend(2);
    Eigen::Map<Vector3<T>> out(residual);
    out = whitening.cast<T>() * r;
  }
};

/// The normal of a ground block's plane, not of unit length.
template <typename T>
[[nodiscard]] Vector3<T> upwards(const BlockValues<T>& ground) {
  return {-ground.v[1], -ground.v[2], T(1.0)};
}

/// Where a keyframe's ground block is centred.
struct GroundCentre {
  double x = 0.0, y = 0.0;  ///< [m]
};

/// Where the body is a little after a keyframe. Only what the accelerometer adds is taken as it was integrated:
/// velocity, gravity and bias move with the keyframe, or readings would seem to show how the body lies in the world.
struct Onwards {
  double after = 0.0;                                        ///< [s]
  Eigen::Vector3d pushed = Eigen::Vector3d::Zero();          ///< by the specific force, in the keyframe [m]
  Eigen::Matrix3d pushed_by_bias = Eigen::Matrix3d::Zero();  ///< its derivative by the bias
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();             ///< that it was integrated with [m/s^2]

  /// Blocks: pose of the keyframe, its motion. In the world.
  template <typename T>
  [[nodiscard]] Vector3<T> position(const BlockValues<T>& pose, const BlockValues<T>& motion) const {
    const Vector3<T> more = motion.vector3(smoother::motion_entry::b_a) - b_a.cast<T>();
    const Vector3<T> force = pushed.cast<T>() + pushed_by_bias.cast<T>() * more;
    const Vector3<T> fallen = (0.5 * after * after * kGravity_W).cast<T>();
    return pose.p() + motion.vector3(smoother::motion_entry::v) * T(after) + fallen + pose.R() * force;
  }
};

/// A beam meets the plane. Blocks: pose of the keyframe, its motion, ground, beam, time. Residual: measured less
/// predicted.
struct BeamModel {
  Eigen::Vector3d p_BL, d_B;         ///< the beam as it was given
  Eigen::Matrix<double, 3, 2> tilt;  ///< axes that the direction turns about
  GroundCentre centre;
  Onwards onwards;                                     ///< to the reading's time
  Eigen::Matrix3d R_kt = Eigen::Matrix3d::Identity();  ///< the body there, in that at the keyframe
  Eigen::Vector3d v_kt = Eigen::Vector3d::Zero();      ///< its velocity, there [m/s]
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();    ///< [rad/s]
  double range = 0.0, sigma = 1.0;                     ///< [m]

  template <typename T>
  void operator()(const std::array<BlockValues<T>, 5>& blocks, T* residual) const {
    const T& late = blocks[4].v[0];
    const Vector3<T> tilted = tilt.cast<T>() * Eigen::Matrix<T, 2, 1>(blocks[3].v[3], blocks[3].v[4]);
    const Vector3<T> d = d_B.cast<T>();
    const Vector3<T> direction = (d + tilted.cross(d)).normalized();  // as in applied()
    const Vector3<T> turn = rate_B.cast<T>() * late;
    const auto to_keyframe = [&](const Vector3<T>& v) -> Vector3<T> { return R_kt.cast<T>() * (v + turn.cross(v)); };
    const Vector3<T> lever_k = v_kt.cast<T>() * late + to_keyframe(p_BL.cast<T>() + blocks[3].vector3(0));
    const Matrix3<T> R_Wk = blocks[0].R();
    const Vector3<T> p_W = onwards.position(blocks[0], blocks[1]) + R_Wk * lever_k;
    const Vector3<T> d_W = R_Wk * to_keyframe(direction);
    const Vector3<T> n = upwards(blocks[2]);
    const Vector3<T> from_centre = p_W - Vector3<T>(T(centre.x), T(centre.y), blocks[2].v[0]);
    residual[0] = (range + n.dot(from_centre) / n.dot(d_W)) / sigma;
  }
};

/// Both wheels stand on the plane. Blocks: pose, ground, wheels, axle. Residuals: left, right.
struct StandModel {
  OdometerState given;
  GroundCentre centre;
  double sigma = 1.0;  ///< [m]

  template <typename T>
  void operator()(const std::array<BlockValues<T>, 4>& blocks, T* residual) const {
    const Axle<T> axle = axle_of(given, blocks[2], blocks[3]);
    const Matrix3<T> R = blocks[0].R();
    const Vector3<T> n = upwards(blocks[1]).normalized();
    const Vector3<T> y = R * axle.y;
    const T lean = n.dot(y);
    using std::sqrt;
    const T upright = sqrt(T(1.0) - lean * lean);  // the rim's lowest point under the centre, over the radius
    for (int side = 0; side < 2; ++side) {
      const Vector3<T> C = blocks[0].p() + R * axle.p + y * (axle.track_width * (side == 0 ? 0.5 : -0.5));
      const Vector3<T> from_centre = C - Vector3<T>(T(centre.x), T(centre.y), blocks[1].v[0]);
      const T radius = side == 0 ? axle.radius_left : axle.radius_right;
      residual[side] = (n.dot(from_centre) - radius * upright) / sigma;
    }
  }
};

/// The plane of the next keyframe continues that of this one. Blocks: ground i, ground j.
struct GroundModel {
  GroundCentre from, to;
  double height_sigma = 1.0, slope_sigma = 1.0;  ///< [m], [rad]

  template <typename T>
  void operator()(const std::array<BlockValues<T>, 2>& blocks, T* residual) const {
    const auto& i = blocks[0].v;
    const auto& j = blocks[1].v;
    // Symmetric: the slope between is the mean of both.
    const T rise = T(0.5) * ((i[1] + j[1]) * (to.x - from.x) + (i[2] + j[2]) * (to.y - from.y));
    residual[0] = (j[0] - i[0] - rise) / height_sigma;
    residual[1] = (j[1] - i[1]) / slope_sigma;
    residual[2] = (j[2] - i[2]) / slope_sigma;
  }
};

/// Position and heading of the first keyframe are those of the world. Block: its pose.
struct OriginModel {
  Pose at;
  double position_sigma = 1e-3, yaw_sigma = 1e-3;  ///< small: they tie nothing else

  template <typename T>
  void operator()(const std::array<BlockValues<T>, 1>& blocks, T* residual) const {
    const Vector3<T> p = (blocks[0].p() - at.p.cast<T>()) / T(position_sigma);
    const Matrix3<T> turned = blocks[0].R() * at.R.transpose().cast<T>();
    for (int k = 0; k < 3; ++k) residual[k] = p(k);
    residual[3] = T(0.5) * (turned(1, 0) - turned(0, 1)) / yaw_sigma;
  }
};

/// The biases of the first keyframe. Block: its motion.
struct BiasModel {
  double gyro_sigma = 0.1, accel_sigma = 0.5;  ///< [rad/s], [m/s^2]

  template <typename T>
  void operator()(const std::array<BlockValues<T>, 1>& blocks, T* residual) const {
    for (std::size_t k = 0; k < 3; ++k) {
      residual[k] = blocks[0].v[smoother::motion_entry::b_g + k] / gyro_sigma;
      residual[3 + k] = blocks[0].v[smoother::motion_entry::b_a + k] / accel_sigma;
    }
  }
};

/// A position that something else measured, in a world of its own. Blocks: pose, motion, the other world's (4): its
/// origin in ours [m], and its heading [rad].
struct ReferenceModel {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< measured [m]
  Onwards onwards;                              ///< to its time
  double sigma = 1.0;                           ///< [m]

  template <typename T>
  void operator()(const std::array<BlockValues<T>, 3>& blocks, T* residual) const {
    using std::cos;
    using std::sin;
    const T c = cos(blocks[2].v[3]);
    const T s = sin(blocks[2].v[3]);
    const Vector3<T> there(c * p.x() - s * p.y(), s * p.x() + c * p.y(), T(p.z()));
    const Vector3<T> error = there + blocks[2].vector3(0) - onwards.position(blocks[0], blocks[1]);
    for (int k = 0; k < 3; ++k) residual[k] = error(k) / sigma;
  }
};

using RollFactor = JetFactor<RollModel, 3, 7, 7, 9, 3, 5, 1>;
using BeamFactor = JetFactor<BeamModel, 1, 7, 9, 3, 5, 1>;
using StandFactor = JetFactor<StandModel, 2, 7, 3, 3, 5>;
using GroundFactor = JetFactor<GroundModel, 3, 3, 3>;
using OriginFactor = JetFactor<OriginModel, 4, 7>;
using BiasFactor = JetFactor<BiasModel, 6, 9>;
using ReferenceFactor = JetFactor<ReferenceModel, 3, 7, 9, 4>;

// Compiled in files of their own, since each takes the compiler hundreds of megabytes.
extern template class JetFactor<RollModel, 3, 7, 7, 9, 3, 5, 1>;
extern template class JetFactor<BeamModel, 1, 7, 9, 3, 5, 1>;
extern template class JetFactor<ReferenceModel, 3, 7, 9, 4>;

}  // namespace ear::calibration
