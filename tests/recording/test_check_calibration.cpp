#include <doctest/doctest.h>

#include <cmath>

#include "src/recording/calibration_files.h"

using namespace ear;

namespace {

Calibration good() {
  Calibration c;
  CameraCalibration left;
  left.T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  left.T_BC.translation() << 0.1, 0.05, 0.0;
  left.width = 640;
  left.height = 480;
  left.fu = left.fv = 400.0;
  left.cu = 320.0;
  left.cv = 240.0;
  CameraCalibration right = left;
  right.T_BC.translation().y() = -0.05;
  c.cameras = {left, right};
  c.encoder = EncoderCalibration{};
  c.lasers = LaserCalibration{};
  c.lasers->beams.push_back({"rear", Eigen::Vector3d::Zero(), -Eigen::Vector3d::UnitZ()});
  return c;
}

// Checks that there is exactly one finding, as said.
void check_one(const Calibration& c, Severity severity, const std::string& where, const std::string& part) {
  const std::vector<Finding> findings = check_calibration(c);
  REQUIRE(findings.size() == 1);
  CHECK((findings[0].severity == severity));
  CHECK(findings[0].where == where);
  CAPTURE(findings[0].message);
  CHECK(findings[0].message.find(part) != std::string::npos);
}

}  // namespace

TEST_CASE("check_calibration: nothing to say about a good one") { CHECK(check_calibration(good()).empty()); }

TEST_CASE("check_calibration: rotations") {
  Calibration c = good();
  c.cameras[0].T_BC.linear()(0, 2) = 1.1;
  check_one(c, Severity::error, "cam0: T_BS", "not orthonormal");

  c = good();
  c.encoder->T_BO.linear()(2, 2) = -1.0;
  check_one(c, Severity::error, "encoder0: T_BS", "determinant -1");
}

TEST_CASE("check_calibration: the pair") {
  Calibration c = good();
  std::swap(c.cameras[0], c.cameras[1]);
  check_one(c, Severity::error, "cam1: T_BS", "swapped");

  c = good();
  c.cameras[1].T_BC = c.cameras[0].T_BC;
  check_one(c, Severity::error, "cam1: T_BS", "same place");

  c = good();
  c.cameras[1].T_BC.translation() = c.cameras[0].T_BC.translation() + Eigen::Vector3d(0.0, 0.0, 0.1);
  check_one(c, Severity::warning, "cam1: T_BS", "not lie to the right");

  c = good();
  c.cameras[1].T_BC.translation().y() = -9.0;
  check_one(c, Severity::warning, "cam1: T_BS", "baseline");
}

TEST_CASE("check_calibration: a camera") {
  Calibration c = good();
  c.cameras.pop_back();
  c.cameras[0].T_BC.setIdentity();
  check_one(c, Severity::warning, "cam0: T_BS", "identity");

  c = good();
  c.cameras[0].fu = c.cameras[0].fv = 4.0;  // millimetres
  check_one(c, Severity::warning, "cam0: intrinsics", "focal length 4 px");

  c = good();
  c.cameras[0].fv = -400.0;
  check_one(c, Severity::error, "cam0: intrinsics", "not positive");

  c = good();
  c.cameras[0].fv = 250.0;
  check_one(c, Severity::warning, "cam0: intrinsics", "differ");

  c = good();
  c.cameras[0].cv = 900.0;
  check_one(c, Severity::warning, "cam0: intrinsics", "principal point");

  c = good();
  c.cameras[0].distortion = {-0.3, 0.1, 0.0, 0.0, -0.01};
  CHECK(check_calibration(c).empty());
  c.cameras[0].distortion = {-0.3, 0.1, 0.0, 0.0, -0.3};
  check_one(c, Severity::warning, "cam0: distortion_coefficients", "folds 247 px from the principal point");
  c.cameras[0].distortion[4] = std::nan("");
  check_one(c, Severity::error, "cam0: distortion_coefficients", "not finite");
  c.cameras[0].distortion = {-0.01, 0.02, -0.01, 0.002, 0.1};
  c.cameras[0].lens = LensModel::equidistant;
  check_one(c, Severity::error, "cam0: distortion_coefficients", "four");
  c.cameras[0].distortion[4] = 0.0;
  CHECK(check_calibration(c).empty());

  c = good();
  c.cameras[0].width = 0;
  check_one(c, Severity::error, "cam0: resolution", "not positive");
}

TEST_CASE("check_calibration: the cameras' clock") {
  Calibration c = good();
  c.camera_time_offset = -0.4;
  CHECK(check_calibration(c).empty());
  c.camera_time_offset = 0.6;
  check_one(c, Severity::warning, "cam0: timeshift_cam_imu", "0.6 s");
  for (const double offset : {std::nan(""), -HUGE_VAL, 3601.0, 1e12}) {
    CAPTURE(offset);
    c.camera_time_offset = offset;
    check_one(c, Severity::error, "cam0: timeshift_cam_imu", "not a number of seconds, at most 3600");
  }
}

TEST_CASE("check_calibration: the clocks of wheels and lasers") {
  for (const double offset : {std::nan(""), -HUGE_VAL, 3601.0, 1e12, 0.6}) {
    CAPTURE(offset);
    const bool odd = offset == 0.6;
    const Severity severity = odd ? Severity::warning : Severity::error;
    const char* const words = odd ? "0.6 s" : "not a number of seconds, at most 3600";
    Calibration c = good();
    c.encoder->time_offset = offset;
    check_one(c, severity, "encoder0: timeshift_encoder_imu", words);
    c = good();
    c.lasers->time_offset = offset;
    check_one(c, severity, "laser0: timeshift_laser_imu", words);
  }
}

TEST_CASE("check_sensors: a camera or wheels are needed") {
  Calibration c = good();
  CHECK_FALSE(check_sensors(c));
  c.cameras.clear();
  CHECK_FALSE(check_sensors(c));
  c.encoder.reset();
  REQUIRE(check_sensors(c));  // lasers alone
  CHECK((check_sensors(c)->severity == Severity::error));
  c.cameras = good().cameras;
  CHECK_FALSE(check_sensors(c));
}

TEST_CASE("check_calibration: noise, wheels, beams") {
  Calibration c = good();
  c.imu.accel_noise = 0.0;
  check_one(c, Severity::error, "imu0: accelerometer_noise_density", "0 is not positive");

  c = good();
  c.encoder->wheel_radius[1] = -0.1;
  check_one(c, Severity::error, "encoder0: wheel_radius", "-0.1 is not positive");

  c = good();
  c.lasers->beams[0].d_B.z() = -2.0;
  check_one(c, Severity::error, "laser0: beams.rear.direction", "length 2");

  c = good();
  c.lasers->range_min = 5.0;
  check_one(c, Severity::error, "laser0: range", "");
}
