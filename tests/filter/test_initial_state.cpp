// What the calibration states of its own uncertainty becomes the prior of the filter.
#include "filter/ekf/initial_state.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "filter/ekf/ekf.h"
#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

Calibration vehicle() {
  Calibration calibration;
  calibration.cameras.resize(2);
  for (CameraCalibration& camera : calibration.cameras) camera.fu = camera.fv = 400.0;
  calibration.encoder.emplace();
  calibration.encoder->wheel_radius = {0.08, 0.08};
  calibration.encoder->track_width = 0.5;
  calibration.lasers.emplace();
  return calibration;
}

}  // namespace

TEST_CASE("initial state: what is stated replaces the prior, the rest stays") {
  FilterConfig config;
  Calibration calibration = vehicle();
  CHECK(settings_for(config, calibration).prior.wheel_radius == config.prior.wheel_radius);
  CHECK(settings_for(config, calibration).prior.stereo_rotation == config.prior.stereo_rotation);

  calibration.cameras[0].pose_sigma = PoseSigma{0.011, 0.012};
  calibration.cameras[1].pose_sigma = PoseSigma{0.013, 0.014};
  calibration.camera_time_offset_sigma = 0.015;
  calibration.imu.gyro_bias_sigma = 0.016;
  calibration.imu.accel_bias_sigma = 0.017;
  calibration.imu.gyro_scale_sigma = 0.022;
  calibration.imu.accel_scale_sigma = 0.024;
  calibration.encoder->time_offset_sigma = 0.023;
  calibration.encoder->T_BO_sigma = PoseSigma{0.018, 0.019};
  calibration.encoder->wheel_radius_sigma = 8e-4;
  calibration.encoder->track_width_sigma = 0.01;
  calibration.lasers->offset_sigma = 0.021;
  const PriorConfig prior = settings_for(config, calibration).prior;
  CHECK(prior.camera_rotation == 0.011);
  CHECK(prior.camera_position == 0.012);
  CHECK(prior.stereo_rotation == 0.013);
  CHECK(prior.stereo_position == 0.014);
  CHECK(prior.time_offset == 0.015);
  CHECK(prior.gyro_bias == 0.016);
  CHECK(prior.accel_bias == 0.017);
  CHECK(prior.gyro_scale == 0.022);
  CHECK(prior.accel_scale == 0.024);
  CHECK(prior.gyro_unseen == 0.022);
  CHECK(prior.gyro_axes_unseen == 0.022);
  CHECK(prior.encoder_time_offset == 0.023);
  for (const double rotation : {prior.odometer_rotation, prior.odometer_unseen}) CHECK(rotation == 0.018);
  for (const double position : {prior.axle, prior.axle_unseen}) CHECK(position == 0.019);
  CHECK(prior.wheel_scale == doctest::Approx(0.01));
  CHECK(prior.wheel_apart == config.prior.wheel_apart);
  CHECK(prior.track_width == doctest::Approx(0.02));
  CHECK(prior.beam_offset == 0.021);
}

TEST_CASE("initial state: each lens is as well known as it states, whatever is stated of the cameras' poses") {
  const PriorConfig prior;
  Calibration calibration = vehicle();
  const Eigen::Vector3d usual(prior.focal_length, prior.principal_point / 400.0, prior.principal_point / 400.0);
  calibration.cameras[1].pose_sigma = PoseSigma{0.013, 0.014};
  const FilterConfig config = settings_for(FilterConfig{}, calibration);
  for (const CameraCalibration& camera : calibration.cameras) CHECK(lens_sigma(config.prior, camera) == usual);

  calibration.cameras[1].fv = 500.0;
  calibration.cameras[1].intrinsics_sigma = IntrinsicsSigma{0.8, 0.2};
  CHECK(lens_sigma(config.prior, calibration.cameras[0]) == usual);
  CHECK(lens_sigma(config.prior, calibration.cameras[1]).isApprox(Eigen::Vector3d(2e-3, 5e-4, 4e-4)));
}

TEST_CASE("initial state: mean and difference of the wheel radii are as well known as stated") {
  for (const double difference : {1e-5, 4e-4, 1.5e-3}) {
    CAPTURE(difference);
    Calibration calibration = vehicle();
    calibration.encoder->wheel_radius_sigma = 8e-4;
    calibration.encoder->wheel_radius_difference_sigma = difference;
    const FilterConfig config = settings_for(FilterConfig{}, calibration);
    Ekf ekf(config, calibration);
    Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
    sigma.segment<2>(err::wheel_radius).setConstant(config.prior.wheel_radius);
    ekf.start(ImuState{}, sigma);
    const Eigen::Matrix2d P = ekf.covariance().matrix().block<2, 2>(err::wheel_radius, err::wheel_radius);
    const Eigen::RowVector2d apart(0.08, -0.08), mean(0.04, 0.04);  // [m] of what is relative
    CHECK(std::sqrt((mean * P * mean.transpose()).value()) == about(8e-4, 1e-3));
    CHECK(std::sqrt((apart * P * apart.transpose()).value()) == about(difference, 1e-3));
  }
}

TEST_CASE("initial state: standard deviations, rates and offsets that cannot be are named") {
  using C = Calibration;
  const auto reason = [](const std::function<void(C&)>& spoil) {
    C calibration = vehicle();
    spoil(calibration);
    try {
      (void)checked(calibration);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto names = [](const std::string& text, const char* field) { return text.find(field) != std::string::npos; };
  CHECK(reason([](C&) {}).empty());
  CHECK(names(reason([](C& c) { c.cameras[1].pose_sigma = PoseSigma{0.0, 0.1}; }), "pose_sigma"));
  CHECK(names(reason([](C& c) { c.cameras[0].intrinsics_sigma = IntrinsicsSigma{-1.0, 1.0}; }), "intrinsics_sigma"));
  CHECK(names(reason([](C& c) { c.cameras[1].intrinsics_sigma = IntrinsicsSigma{1.0, 0.0}; }), "intrinsics_sigma"));
  CHECK(names(reason([](C& c) { c.camera_time_offset_sigma = -1e-3; }), "camera_time_offset_sigma"));
  CHECK(names(reason([](C& c) { c.imu.gyro_bias_sigma = std::numeric_limits<double>::quiet_NaN(); }), "gyro_bias"));
  CHECK(names(reason([](C& c) { c.imu.accel_bias_sigma = std::numeric_limits<double>::infinity(); }), "accel_bias"));
  CHECK(names(reason([](C& c) { c.encoder->T_BO_sigma = PoseSigma{0.1, -0.1}; }), "T_BO_sigma"));
  CHECK(names(reason([](C& c) { c.encoder->wheel_radius_sigma = 0.0; }), "wheel_radius_sigma"));
  CHECK(names(reason([](C& c) { c.encoder->wheel_radius_difference_sigma = 0.0; }), "wheel_radius_difference_sigma"));
  CHECK(names(reason([](C& c) { c.encoder->track_width_sigma = 0.0; }), "track_width_sigma"));
  CHECK(names(reason([](C& c) { c.lasers->offset_sigma = 0.0; }), "offset_sigma"));
  CHECK(names(reason([](C& c) { c.encoder->time_offset_sigma = 0.0; }), "the encoder's time_offset_sigma"));
  CHECK(names(reason([](C& c) { c.lasers->time_offset_sigma = -1.0; }), "the lasers' time_offset_sigma"));
  CHECK(names(reason([](C& c) { c.imu.gyro_matrix(0, 1) = std::nan(""); }), "gyro_matrix"));
  CHECK(names(reason([](C& c) { c.imu.gyro_matrix *= -1.0; }), "gyro_matrix"));
  for (const double rate_hz : {0.0, -200.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    CHECK(names(reason([&](C& c) { c.imu.rate_hz = rate_hz; }), "imu rate_hz must be a positive number"));
  }
  for (const double offset : {std::numeric_limits<double>::quiet_NaN(), 1e300, -4000.0}) {
    CHECK(names(reason([&](C& c) { c.encoder->time_offset = offset; }), "the encoder's time_offset must be a number"));
    CHECK(names(reason([&](C& c) { c.lasers->time_offset = offset; }), "the lasers' time_offset must be a number"));
  }
}
