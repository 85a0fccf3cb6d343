#include "tools/simulator/vehicle.h"

#include <Eigen/Geometry>

#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

Eigen::Matrix3d rotation(double roll_deg, double pitch_deg, double yaw_deg) {
  return (Eigen::AngleAxisd(yaw_deg * kDegree, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(pitch_deg * kDegree, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll_deg * kDegree, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Isometry3d pose(const Eigen::Matrix3d& R, const Eigen::Vector3d& p) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = R;
  T.translation() = p;
  return T;
}

// Camera axes (x right, y down, z forward) of a camera that looks along the body's x axis.
Eigen::Matrix3d forward_looking() {
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1,  //
      -1, 0, 0,     //
      0, -1, 0;
  return R_BC;
}

CameraCalibration make_camera(double rate_hz, LensModel lens) {
  CameraCalibration camera;
  camera.width = 640;
  camera.height = 480;
  camera.rate_hz = rate_hz;
  camera.lens = lens;
  return camera;
}

}  // namespace

Calibration make_vehicle(double camera_rate_hz, LensModel lens) {
  Calibration calibration;

  // The cameras look 10 degrees up: close to the ground, the floor alone would fill the picture.
  const Eigen::Matrix3d R_BC0 = rotation(0.4, -10.0, -0.6) * forward_looking();
  const Eigen::Matrix3d R_C0C1 = rotation(0.05, -0.08, 0.1);
  CameraCalibration left = make_camera(camera_rate_hz, lens);
  left.T_BC = pose(R_BC0, {0.082, 0.0245, 0.013});
  left.fu = 385.6;
  left.fv = 385.3;
  left.cu = 321.5;
  left.cv = 238.2;
  CameraCalibration right = make_camera(camera_rate_hz, lens);
  right.T_BC = left.T_BC * pose(R_C0C1, {0.05, 0.0002, -0.0001});
  right.fu = 385.0;
  right.fv = 384.7;
  right.cu = 317.8;
  right.cv = 241.1;
  if (lens == LensModel::radial_tangential) {
    left.distortion = {-0.054, 0.047, 0.0006, -0.0004};
    right.distortion = {-0.052, 0.045, -0.0004, 0.0005};
  } else {
    left.distortion = {0.012, -0.009, 0.004, -0.001};
    right.distortion = {0.011, -0.008, 0.004, -0.001};
  }
  calibration.cameras = {left, right};

  EncoderCalibration encoder;
  encoder.T_BO = pose(rotation(-0.3, 1.0, 0.4), {-0.021, -0.002, -0.048});
  calibration.encoder = encoder;

  LaserCalibration lasers;
  lasers.beams = {{"front_left", {0.10, 0.10, -0.028}, rotation(0.6, 1.1, 0.0) * -Eigen::Vector3d::UnitZ()},
                  {"front_right", {0.10, -0.11, -0.027}, rotation(-1.0, 0.7, 0.0) * -Eigen::Vector3d::UnitZ()},
                  {"rear", {-0.16, -0.002, -0.019}, rotation(0.4, -1.2, 0.0) * -Eigen::Vector3d::UnitZ()}};
  calibration.lasers = lasers;
  return calibration;
}

}  // namespace ear::simulator
