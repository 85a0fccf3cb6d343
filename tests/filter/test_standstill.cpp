#include <doctest/doctest.h>

#include "filter/sources/standstill/standstill.h"
#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

constexpr double kFocal = 400.0;

FeatureFrame frame_at(TimeNs t_ns, double shift_px) {
  FeatureFrame frame;
  frame.t_ns = t_ns;
  for (std::uint64_t id = 0; id < 30; ++id) {
    FeatureObservation feature;
    feature.id = id;
    feature.left = {0.01 * static_cast<double>(id) + shift_px / kFocal, 0.0};
    frame.features.push_back(feature);
  }
  return frame;
}

ImuStatistics quiet() {
  ImuStatistics imu;
  imu.count = 100;
  imu.duration = 0.5;
  imu.gyro_mean = {0.005, 0.0, 0.0};
  imu.accel_mean = {0.0, 0.0, 9.81};
  imu.gyro_spread = 0.014;
  imu.accel_spread = 0.14;
  return imu;
}

constexpr TimeNs kFrame = 33'333'333;

Standstill watch() { return {StandstillConfig{}, kFocal, FilterConfig{}.window}; }

/// Does the vehicle stand, with this frame?
bool stands(Standstill& standstill, const FeatureFrame& frame, const ImuStatistics& imu = quiet(),
            bool on_ground = false) {
  standstill.update({frame, frame.t_ns, imu, Standstill::GyroBias{}, on_ground});
  return standstill.stands();
}

}  // namespace

TEST_CASE("standstill: believed after its duration, not before") {
  Standstill standstill = watch();
  for (int i = 0; i < 30; ++i) {
    CAPTURE(i);
    const bool still = stands(standstill, frame_at(i * kFrame, 0.0));
    CHECK(still == (i >= 16));  // 15 periods of 33333333 ns are just short of 0.5 s
  }
}

TEST_CASE("standstill: gliding with a quiet IMU is no standing, however slow") {
  Standstill standstill = watch();
  for (int i = 0; i < 90; ++i) {
    CHECK_FALSE(stands(standstill, frame_at(i * kFrame, 0.05 * i)));
  }
}

TEST_CASE("standstill: a shaken or turning IMU ends it at once") {
  Standstill standstill = watch();
  int i = 0;
  for (; i < 30; ++i) stands(standstill, frame_at(i * kFrame, 0.0));
  ImuStatistics shaken = quiet();
  shaken.accel_spread = 4.0;
  CHECK_FALSE(stands(standstill, frame_at(i * kFrame, 0.0), shaken));
  ImuStatistics turning = quiet();
  turning.gyro_mean = {0.0, 0.0, 0.1};
  CHECK_FALSE(stands(standstill, frame_at((i + 20) * kFrame, 0.0), turning));
}

TEST_CASE("standstill: before the bias is known any steady rate may be bias, if wheels or images rest") {
  ImuStatistics biased = quiet();
  biased.gyro_mean = {0.0, 0.55, 0.0};  // a real one
  const auto still = [&](double shift_px, double wheel_angle, bool shown) {
    Standstill standstill = watch();
    for (int i = 1; i < 60; ++i) {
      const FeatureFrame frame = frame_at(i * kFrame, shown ? shift_px * i : 0.0);
      standstill.add({(i - 1) * kFrame, i * kFrame, Eigen::Vector2d::Constant(wheel_angle)});
      FeatureFrame blind;
      blind.t_ns = frame.t_ns;
      standstill.update({shown ? frame : blind, frame.t_ns, biased, std::nullopt, true});
    }
    return standstill.stands();
  };
  CHECK(still(0.0, 0.0, true));
  CHECK(still(0.0, 0.0, false));  // by the wheels alone
  CHECK_FALSE(still(1.0, 0.0, true));
  CHECK_FALSE(still(0.0, 0.1, false));
}

TEST_CASE("standstill: without features it is not known") {
  Standstill standstill = watch();
  for (int i = 0; i < 60; ++i) {
    FeatureFrame empty;
    empty.t_ns = i * kFrame;
    CHECK_FALSE(stands(standstill, empty));
  }
}

TEST_CASE("standstill: steps without an image in between do not hide that it slides on wheels at rest") {
  Standstill standstill = watch();
  bool still = false;
  const auto see = [&](int i, double shift_px) {
    standstill.add({(i - 1) * kFrame, i * kFrame});
    still = stands(standstill, frame_at(i * kFrame, shift_px), quiet(), true);
    FeatureFrame step;
    step.t_ns = i * kFrame + kFrame / 2;
    stands(standstill, step, quiet(), true);
  };
  for (int i = 0; i < 40; ++i) see(i, 0.0);
  CHECK(still);
  for (int i = 40; i < 70; ++i) see(i, 0.1 * (i - 40));
  CHECK_FALSE(still);
}

TEST_CASE("standstill: a vehicle that turns slower and slower does not stand, whatever its bias may be") {
  for (const double error : {0.0, 0.01}) {  // of the mean rate
    Standstill standstill = watch();
    ImuStatistics imu = quiet();
    imu.gyro_mean = {0.0, 0.0, 0.03};
    imu.gyro_error = error;
    for (int i = 1; i <= 30; ++i) {
      const FeatureFrame blind{i * kFrame, {}};
      standstill.add({(i - 1) * kFrame, i * kFrame, Eigen::Vector2d::Zero()});
      standstill.update({blind, blind.t_ns, imu, std::nullopt, true});
    }
    CHECK(standstill.stands() == (error == 0.0));
  }
}

TEST_CASE("standstill: a rate that may be bias does not end it, one that cannot be does") {
  for (const double sigma : {0.0, 0.05}) {
    Standstill standstill = watch();
    ImuStatistics imu = quiet();
    imu.gyro_mean = {0.0, 0.0, 0.06};
    for (int i = 0; i < 30; ++i) {
      const FeatureFrame frame = frame_at(i * kFrame, 0.0);
      standstill.update({frame, frame.t_ns, imu, Standstill::GyroBias{Eigen::Vector3d::Zero(), sigma}, false});
    }
    CHECK(standstill.stands() == (sigma > 0.0));
  }
}

TEST_CASE("standstill: rest shows that the state is too fast, and nothing of its heading") {
  constexpr TimeNs kStart = 1'000'000'000;
  Calibration calibration;
  calibration.encoder.emplace();
  Ekf ekf(FilterConfig{}, calibration);
  ImuState x;
  x.t_ns = kStart;
  x.v_W = {0.5, 0.2, 0.0};
  x.p_WB = {3.0, 2.0, 1.0};
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(err::clones, 0.01);
  sigma(err::theta + 2) = 0.5;
  sigma.segment<3>(err::nu).setConstant(0.3);
  ekf.start(x, sigma);
  ekf.clone(1.0);
  ImuBuffer imu(64);
  for (int i = 0; i <= 20; ++i) imu.push({kStart + i * 5'000'000, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
  ekf.propagate(imu, kStart + 50'000'000, {}, 0.0);

  const double heading = ekf.state().imu.R_WB(1, 0);
  const double variance = ekf.covariance().matrix()(err::theta + 2, err::theta + 2);
  watch().hold(ekf);
  CHECK(ekf.state().imu.v_W.norm() < 0.01);
  CHECK(std::abs(ekf.state().imu.R_WB(1, 0) - heading) < 0.01);
  CHECK(ekf.covariance().matrix()(err::theta + 2, err::theta + 2) == about(variance, 0.0025));
}
