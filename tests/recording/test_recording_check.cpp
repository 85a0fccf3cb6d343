#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "src/recording/recording_check.h"
#include "src/recording/standing_watch.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

namespace {

bool has_finding(const RecordingReport& report, Severity severity, const std::string& where, const std::string& part) {
  return std::any_of(report.findings.begin(), report.findings.end(), [&](const Finding& f) {
    return f.severity == severity && contains(f.where, where) && contains(f.message, part);
  });
}

double relative_error(double value, double expected) { return std::abs(value / expected - 1.0); }

ImuSample imu_at(int index, double gyro_x, double accel_x) {
  ImuSample sample;
  sample.t_ns = index * 5'000'000LL;  // 200 Hz
  sample.gyro_B.x() = gyro_x;
  sample.accel_B << accel_x, 0.0, 9.81;
  return sample;
}

}  // namespace

TEST_CASE("timing: rate, jitter and gaps") {
  StreamTiming timing;
  CHECK(timing.report().count == 0);
  TimeNs t = 1'000'000'000;
  for (int i = 0; i < 100; ++i) {
    timing.add(t + (i % 2 == 0 ? 1'000'000 : -1'000'000));
    t += i == 50 ? 500'000'000 : 10'000'000;
  }
  const TimingReport report = timing.report();
  CHECK(report.count == 100);
  CHECK(report.first_ns == 1'001'000'000);
  CHECK(report.gaps == 1);
  CHECK(report.longest_gap == doctest::Approx(0.498));
  CHECK(relative_error(report.jitter_s, 0.002) < 0.02);  // intervals of 8 and 12 ms
  CHECK((report.rate_hz > 80.0 && report.rate_hz < 130.0));
}

TEST_CASE("imu check: clipping is an extreme value that stays") {
  ImuCheck check;
  for (int i = 0; i < 100; ++i) {
    const bool strike = i >= 40 && i < 45;
    check.add(imu_at(i, 0.01 * (i % 3), strike ? 78.5 : 0.1 * (i % 7)));
  }
  CHECK(check.report().clipped == 5);
}

TEST_CASE("imu check: a larger value later shows that it was no clipping") {
  ImuCheck check;
  for (const double accel : {0.0, 50.0, 50.0, 0.0, 60.0, 0.0}) check.add(imu_at(0, 0.0, accel));
  CHECK(check.report().clipped == 0);
}

TEST_CASE("imu check: equal small values are quantisation, not clipping") {
  ImuCheck check;
  for (int i = 0; i < 100; ++i) check.add(imu_at(i, 0.001 * ((i / 5) % 2), 0.0));
  CHECK(check.report().clipped == 0);
  CHECK(check.report().repeated == 80);
}

TEST_CASE("imu check: noise at rest, not in motion") {
  std::mt19937 rng{3};
  std::normal_distribution<double> normal;
  const double sample_rate_root = std::sqrt(200.0);
  ImuCheck rest;
  ImuCheck motion;
  for (int i = 0; i < 2000; ++i) {
    ImuSample sample = imu_at(i, 0.0, 0.0);
    for (int axis = 0; axis < 3; ++axis) {
      sample.gyro_B(axis) = 0.03 + 1e-3 * sample_rate_root * normal(rng);
      sample.accel_B(axis) += 1e-2 * sample_rate_root * normal(rng);
    }
    rest.add(sample);
    sample.gyro_B.z() += std::sin(0.01 * i);
    motion.add(sample);
  }
  const auto always = [](TimeNs, TimeNs) { return true; };
  const std::optional<StandingNoise> noise = rest.report(always).standing_noise;
  REQUIRE(noise);
  CHECK(noise->windows >= 9);
  CHECK(relative_error(noise->gyro, 1e-3) < 0.05);
  CHECK(relative_error(noise->accel, 1e-2) < 0.05);
  CHECK_FALSE(motion.report(always).standing_noise);

  // A quiet second is one of rest only where somebody saw the vehicle stand.
  CHECK_FALSE(rest.report().standing_noise);
  const auto first_half = [](TimeNs, TimeNs end_ns) { return end_ns < 5'000'000'000; };
  CHECK(rest.report(first_half).standing_noise->windows == 5);
}

TEST_CASE("standing: wheels that rest, turn, are silent, and wrap") {
  EncoderCalibration wheels;  // 262144 counts for 0.47 m, wrapping
  StandingWatch watch;
  const auto until = [](double t) { return static_cast<TimeNs>(1e9 * t); };
  CHECK_FALSE(watch.stood(0, until(1.0)));  // nobody saw anything
  for (int i = 0; i < 1000; ++i) {
    if (i >= 700 && i < 800) continue;                   // silent
    const int path = i < 300 || i >= 600 ? 0 : i - 300;  // cm: rolls from 3 to 6 s
    const std::int64_t counts = 262143 + 5563LL * path + (i % 3);
    watch.add({until(0.01 * i), counts % 262144, 1000 + i % 2}, wheels);
  }
  CHECK(watch.stood(0, until(1.0)));
  CHECK(watch.stood(until(1.9), until(2.9)));
  CHECK_FALSE(watch.stood(until(2.5), until(3.5)));
  CHECK_FALSE(watch.stood(until(4.0), until(5.0)));  // at constant speed
  CHECK_FALSE(watch.stood(until(6.5), until(7.5)));
  CHECK(watch.stood(until(8.1), until(9.1)));
  CHECK_FALSE(watch.stood(until(20.0), until(21.0)));
}

TEST_CASE("standing: images that change, all or a little, and a covered lens") {
  std::mt19937 rng{5};
  cv::Mat scene(240, 640, CV_8UC1);
  cv::randu(scene, 40, 210);
  cv::blur(scene, scene, {31, 31});
  cv::normalize(scene, scene, 30, 220, cv::NORM_MINMAX);
  const auto until = [](double t) { return static_cast<TimeNs>(1e9 * t); };
  const auto seen = [&](const std::function<cv::Mat(int)>& image) {
    StandingWatch watch;
    std::normal_distribution<float> noise(0.0F, 2.0F);
    for (int i = 0; i < 30; ++i) {
      cv::Mat picture = image(i).clone();
      for (std::uint8_t& pixel : cv::Mat_<std::uint8_t>(picture)) {
        pixel = cv::saturate_cast<std::uint8_t>(static_cast<float>(pixel) + noise(rng));
      }
      watch.add(until(0.1 * i), {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)});
    }
    return watch.stood(until(1.0), until(2.0));
  };
  const cv::Rect left(0, 0, 320, 240);
  CHECK(seen([&](int) { return scene(left); }));
  CHECK(seen([&](int i) { return cv::Mat(scene(left) + cv::Scalar::all(i % 5)); }));  // exposure
  CHECK(seen([&](int i) {
    cv::Mat image = scene(left).clone();
    image({i * 8, 100, 24, 24}) = cv::Scalar::all(255);  // something small passes by
    return image;
  }));
  CHECK_FALSE(seen([&](int i) { return scene(left + cv::Point(i, 0)); }));  // 10 px a second
  CHECK_FALSE(seen([&](int) { return cv::Mat(240, 320, CV_8UC1, cv::Scalar::all(20)); }));

  // Wheels that stand while the image moves: in the air.
  StandingWatch both;
  for (int i = 0; i < 30; ++i) {
    const cv::Mat picture = scene(left + cv::Point(8 * i, 0)).clone();
    both.add(until(0.1 * i), {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)});
    both.add({until(0.1 * i), 7, 7}, EncoderCalibration{});
  }
  CHECK_FALSE(both.stood(until(1.0), until(2.0)));
}

TEST_CASE("check: a good recording") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  const RecordingReport report = check_recording(folder.path(), {});
  CHECK(report.usable());
  CHECK(report.warnings.empty());
  REQUIRE(report.streams.size() == 4);
  CHECK(report.streams[0].name == "imu0");
  CHECK(report.streams[0].timing.count == 101);
  CHECK(report.streams[3].name == "cam0+cam1");
  CHECK(report.streams[3].timing.rate_hz == doctest::Approx(10.0));
  CHECK(report.streams[3].covered_by_imu == 1.0);
}

TEST_CASE("check: streams that do not meet, gaps, wrong rates") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  std::string csv = "#t,l,r\n";
  for (int i = 0; i < 50; ++i) csv += std::to_string(i * 30'000'000LL + (i > 30 ? 400'000'000LL : 0)) + ",1,1\n";
  write_text(folder / "mav0/encoder0/data.csv", csv);
  write_text(folder / "mav0/laser0/data.csv", "#t\n5000000000,0.1,0.1,0.1\n5020000000,0.1,0.1,0.1\n");
  const RecordingReport report = check_recording(folder.path(), {});
  CHECK_FALSE(report.usable());
  CHECK(has_finding(report, Severity::error, "laser0", "no time at which there are inertial"));
  CHECK(has_finding(report, Severity::warning, "encoder0", "% of its time only"));
  CHECK(has_finding(report, Severity::warning, "encoder0", "1 gaps, the longest 0.43 s"));
  CHECK(has_finding(report, Severity::warning, "encoder0", "33.3 Hz, but its calibration says 100 Hz"));
}

TEST_CASE("check: streams meet by the IMU's clock") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/laser0/data.csv", "#t\n5000000000,0.1,0.1,0.1\n5020000000,0.1,0.1,0.1\n");
  write_text(folder / "mav0/laser0/sensor.yaml", kLaserYaml + "timeshift_laser_imu: -4.5\n");
  const RecordingReport report = check_recording(folder.path(), {});
  CHECK(report.usable());
  CHECK(has_finding(report, Severity::warning, "laser0: timeshift_laser_imu", "-4.5 s"));
  REQUIRE(report.streams.size() == 4);
  CHECK(report.streams[2].covered_by_imu == 1.0);
}

TEST_CASE("check: a calibration that cannot be is reported with the rest") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/cam1/sensor.yaml", camera_yaml("0.3"));
  write_image(folder / "mav0/cam0/data/0.png", 3, CV_8UC1, {20, 12});
  const RecordingReport report = check_recording(folder.path(), {});
  CHECK_FALSE(report.usable());
  CHECK(has_finding(report, Severity::error, "cam1: T_BS", "swapped"));
  CHECK(has_finding(report, Severity::error, "cam0: resolution", "20x12"));
  CHECK(report.streams.size() == 4);
}

TEST_CASE("check: what cannot be read is a finding, not an exception") {
  const TempFolder folder;
  const RecordingReport report = check_recording(folder / "none", {});
  CHECK_FALSE(report.usable());
  CHECK(has_finding(report, Severity::error, "recording", "no such folder"));
}
