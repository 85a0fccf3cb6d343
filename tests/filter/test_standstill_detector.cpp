#include <doctest/doctest.h>

#include "filter/sources/standstill/standstill_detector.h"

using namespace ear;

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

}  // namespace

TEST_CASE("standstill: believed after its duration, not before") {
  StandstillDetector detector(StandstillConfig{}, kFocal);
  for (int i = 0; i < 30; ++i) {
    CAPTURE(i);
    const bool still = detector.update(frame_at(i * kFrame, 0.0), quiet(), Eigen::Vector3d::Zero(), 0.02, std::nullopt);
    CHECK(still == (i >= 16));  // 15 periods of 33333333 ns are just short of 0.5 s
  }
}

TEST_CASE("standstill: gliding with a quiet IMU is no standing, however slow") {
  StandstillDetector detector(StandstillConfig{}, kFocal);
  for (int i = 0; i < 90; ++i) {
    CHECK_FALSE(detector.update(frame_at(i * kFrame, 0.05 * i), quiet(), Eigen::Vector3d::Zero(), 0.02, std::nullopt));
  }
}

TEST_CASE("standstill: a shaken or turning IMU ends it at once") {
  StandstillDetector detector(StandstillConfig{}, kFocal);
  int i = 0;
  for (; i < 30; ++i) detector.update(frame_at(i * kFrame, 0.0), quiet(), Eigen::Vector3d::Zero(), 0.02, std::nullopt);
  ImuStatistics shaken = quiet();
  shaken.accel_spread = 4.0;
  CHECK_FALSE(detector.update(frame_at(i * kFrame, 0.0), shaken, Eigen::Vector3d::Zero(), 0.02, std::nullopt));
  ImuStatistics turning = quiet();
  turning.gyro_mean = {0.0, 0.0, 0.1};
  CHECK_FALSE(detector.update(frame_at((i + 20) * kFrame, 0.0), turning, Eigen::Vector3d::Zero(), 0.02, std::nullopt));
}

TEST_CASE("standstill: without features it is not known") {
  StandstillDetector detector(StandstillConfig{}, kFocal);
  for (int i = 0; i < 60; ++i) {
    FeatureFrame empty;
    empty.t_ns = i * kFrame;
    CHECK_FALSE(detector.update(empty, quiet(), Eigen::Vector3d::Zero(), 0.02, std::nullopt));
  }
}

TEST_CASE("standstill: steps without an image in between do not hide that it slides on wheels at rest") {
  StandstillDetector detector(StandstillConfig{}, kFocal);
  constexpr double kResting = 2.0;  // [s]
  bool still = false;
  const auto see = [&](int i, double shift_px) {
    still = detector.update(frame_at(i * kFrame, shift_px), quiet(), Eigen::Vector3d::Zero(), 0.02, kResting);
    FeatureFrame step;
    step.t_ns = i * kFrame + kFrame / 2;
    detector.update(step, quiet(), Eigen::Vector3d::Zero(), 0.02, kResting);
  };
  for (int i = 0; i < 40; ++i) see(i, 0.0);
  CHECK(still);
  for (int i = 40; i < 70; ++i) see(i, 0.1 * (i - 40));
  CHECK_FALSE(still);
}
