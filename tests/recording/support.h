// Recordings made for tests, in a folder that goes away with the test.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>

#include <doctest/doctest.h>
#include "src/recording/input_error.h"

namespace ear::test {

namespace fs = std::filesystem;

/// A new empty folder, removed at the end.
class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (fs::temp_directory_path() / "ear_test_XXXXXX").string();
    REQUIRE(::mkdtemp(pattern.data()) != nullptr);
    path_ = pattern;
  }
  ~TempFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  TempFolder(TempFolder&&) = delete;
  TempFolder& operator=(TempFolder&&) = delete;

  [[nodiscard]] fs::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

inline void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

inline std::string read_text(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// The message of the InputError that f throws; "" if it throws none.
template <typename F>
std::string input_error_of(F&& f) {
  try {
    f();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

inline const std::string kIdentityText = "{rows: 4, cols: 4, data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}";

inline const std::string kImuYaml =
    "sensor_type: imu\nT_BS: " + kIdentityText +
    "\nrate_hz: 100\ngyroscope_noise_density: 0.001\n"
    "gyroscope_random_walk: 0.00002\naccelerometer_noise_density: 0.01\naccelerometer_random_walk: 0.0003\n";

/// x right of the camera is y to the right of the body: looks forward. `y` is where it sits on the body's left [m].
inline std::string camera_yaml(const std::string& y, const std::string& lens = "radial-tangential") {
  return "%YAML:1.0\n# a camera\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0, 0, 1, 0.1,\n         "
         "-1, 0, 0, " +
         y +
         ",\n         0, -1, 0, 0.0,\n         0, 0, 0, 1]\nrate_hz: 10\nresolution: [16, 12]\ncamera_model: pinhole\n"
         "intrinsics: [10.5, 10.25, 8.0, 6.0] # fu, fv, cu, cv\ndistortion_model: " +
         lens + "\ndistortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n";
}

inline const std::string kEncoderYaml =
    "sensor_type: wheel_encoder\nrate_hz: 100\nT_BS: {rows: 4, cols: 4, data: [1,0,0,0, 0,1,0,0, 0,0,1,-0.05, "
    "0,0,0,1]}\nresolution: 4096\nwraps: true\nwheel_radius: [0.075, 0.076]\nwheel_separation: 0.4\nnoise_counts: "
    "2.0\n";

inline const std::string kLaserYaml =
    "sensor_type: single_point_lasers\nrate_hz: 50\nbeams:\n"
    "  - {name: front_left, origin: [0.1, 0.1, 0], direction: [0, 0, -1]}\n"
    "  - {name: front_right, origin: [0.1, -0.1, 0], direction: [0, 0, -1]}\n"
    "  - {name: rear, origin: [-0.1, 0, 0], direction: [0, 0, -1]}\n"
    "range: [0.02, 4.0]\nnoise: 0.004\n";

/// An image whose pixels all have one value.
inline void write_image(const fs::path& file, int value, int type = CV_8UC1, cv::Size size = {16, 12}) {
  fs::create_directories(file.parent_path());
  REQUIRE(cv::imwrite(file.string(), cv::Mat(size, type, cv::Scalar::all(value))));
}

/// An IMU alone: `count` samples from 0 on, every 10 ms, at rest.
inline void write_imu(const fs::path& mav0, int count) {
  std::string csv = "#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n";
  for (int i = 0; i < count; ++i) csv += std::to_string(i * 10'000'000) + ",0.01,0.02,0.03,0.1,0.2,9.8\n";
  write_text(mav0 / "imu0/data.csv", csv);
  write_text(mav0 / "imu0/sensor.yaml", kImuYaml);
}

/// `count` images of camera `name` every 100 ms; the pixels of image i have the value i.
inline void write_camera(const fs::path& mav0, const std::string& name, int count) {
  std::string csv = "#timestamp [ns],filename\n";
  for (int i = 0; i < count; ++i) {
    const std::string stamp = std::to_string(i * 100'000'000);
    csv += stamp + "," + stamp + ".png\n";
    write_image(mav0 / name / "data" / (stamp + ".png"), i);
  }
  write_text(mav0 / name / "data.csv", csv);
  write_text(mav0 / name / "sensor.yaml", camera_yaml(name == "cam0" ? "0.05" : "-0.05"));
}

/// All sensors for one second.
inline void write_full_recording(const fs::path& mav0) {
  write_imu(mav0, 101);
  write_camera(mav0, "cam0", 10);
  write_camera(mav0, "cam1", 10);
  std::string encoder = "#timestamp [ns],left [count],right [count]\n";
  for (int i = 0; i <= 100; ++i) encoder += std::to_string(i * 10'000'000) + "," + std::to_string(40 * i) + ",7\n";
  write_text(mav0 / "encoder0/data.csv", encoder);
  write_text(mav0 / "encoder0/sensor.yaml", kEncoderYaml);
  std::string laser = "#timestamp [ns],front_left [m],front_right [m],rear [m]\n";
  for (int i = 0; i <= 50; ++i) laser += std::to_string(i * 20'000'000) + ", 0.12, nan, 9.5\n";
  write_text(mav0 / "laser0/data.csv", laser);
  write_text(mav0 / "laser0/sensor.yaml", kLaserYaml);
}

}  // namespace ear::test
