#include "src/recording/folder_writer.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "src/recording/input_error.h"
#include "src/recording/writers.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

std::string exact_text(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.17g", value);
  return buffer.data();
}

template <typename Values>
std::string list(const Values& values) {
  std::string joined;
  for (const double value : values) joined += (joined.empty() ? "" : ", ") + exact_text(value);
  return "[" + joined + "]";
}

std::string matrix(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = pose.matrix();
  return "{rows: 4, cols: 4, data: " + list(std::vector<double>(m.data(), m.data() + 16)) + "}";
}

/// One sensor.yaml, key by key.
class OriginalSensorFile {
 public:
  explicit OriginalSensorFile(const fs::path& folder)
      : file_((fs::create_directories(folder), folder / "sensor.yaml")) {}
  OriginalSensorFile& line(const std::string& key, const std::string& value) {
    file_.write(key + ": " + value + "\n");
    return *this;
  }
  OriginalSensorFile& number(const std::string& key, const std::optional<double>& value) {
    return value ? line(key, exact_text(*value)) : *this;
  }
  OriginalSensorFile& sigma(const std::string& key, const std::optional<PoseSigma>& value) {
    if (!value) return *this;
    return line(key, "{rotation: " + exact_text(value->rotation) + ", position: " + exact_text(value->position) + "}");
  }
  OriginalSensorFile& sigma(const std::string& key, const std::optional<IntrinsicsSigma>& value) {
    if (!value) return *this;
    return line(key, "{focal_length: " + exact_text(value->focal_length) +
                         ", principal_point: " + exact_text(value->principal_point) + "}");
  }

 private:
  OutputFile file_;
};

void write_camera(const Calibration& calibration, std::size_t index, const fs::path& folder) {
  const CameraCalibration& camera = calibration.cameras[index];
  const bool fisheye = camera.lens == LensModel::equidistant;
  const std::size_t coefficients = fisheye || camera.distortion[4] == 0.0 ? 4 : 5;
  OriginalSensorFile file(folder / ("cam" + std::to_string(index)));
  file.line("sensor_type", "camera").line("T_BS", matrix(camera.T_BC)).number("rate_hz", camera.rate_hz);
  file.line("resolution", list(std::array<double, 2>{double(camera.width), double(camera.height)}));
  file.line("camera_model", "pinhole");
  file.line("intrinsics", list(std::array<double, 4>{camera.fu, camera.fv, camera.cu, camera.cv}));
  file.sigma("intrinsics_sigma", camera.intrinsics_sigma);
  file.line("distortion_model", fisheye ? "equidistant" : "radial-tangential");
  file.line("distortion_coefficients",
            list(std::vector<double>(camera.distortion.begin(), camera.distortion.begin() + coefficients)));
  file.sigma(index == 0 ? "T_BS_sigma" : "T_C0C1_sigma", camera.pose_sigma);
  if (index > 0) return;
  file.number("timeshift_cam_imu", calibration.camera_time_offset);
  file.number("timeshift_cam_imu_sigma", calibration.camera_time_offset_sigma);
}

void write_imu(const ImuCalibration& imu, const fs::path& folder) {
  OriginalSensorFile file(folder / "imu0");
  file.line("sensor_type", "imu").line("T_BS", matrix(Eigen::Isometry3d::Identity())).number("rate_hz", imu.rate_hz);
  file.number("gyroscope_noise_density", imu.gyro_noise).number("gyroscope_random_walk", imu.gyro_random_walk);
  file.number("accelerometer_noise_density", imu.accel_noise);
  file.number("accelerometer_random_walk", imu.accel_random_walk);
  file.number("gyroscope_bias_sigma", imu.gyro_bias_sigma).number("accelerometer_bias_sigma", imu.accel_bias_sigma);
  file.number("gyroscope_scale_sigma", imu.gyro_scale_sigma);
  file.number("accelerometer_scale_sigma", imu.accel_scale_sigma);
  if (!imu.gyro_matrix.isIdentity(0.0)) {
    const Eigen::Matrix<double, 9, 1> rows = imu.gyro_matrix.reshaped<Eigen::RowMajor>();
    file.line("gyroscope_matrix", list(rows));
  }
}

void write_encoder(const EncoderCalibration& encoder, const fs::path& folder) {
  OriginalSensorFile file(folder / "encoder0");
  file.line("sensor_type", "wheel_encoder").line("T_BS", matrix(encoder.T_BO)).number("rate_hz", encoder.rate_hz);
  file.line("resolution", std::to_string(encoder.resolution)).line("wraps", encoder.wraps ? "true" : "false");
  file.line("wheel_radius", list(encoder.wheel_radius)).number("wheel_separation", encoder.track_width);
  file.number("noise_counts", encoder.noise_counts);
  if (encoder.stamp_sigma > 0.0) file.number("stamp_sigma", encoder.stamp_sigma);
  file.number("timeshift_encoder_imu", encoder.time_offset);
  file.number("timeshift_encoder_imu_sigma", encoder.time_offset_sigma);
  file.sigma("T_BS_sigma", encoder.T_BO_sigma).number("wheel_radius_sigma", encoder.wheel_radius_sigma);
  file.number("wheel_radius_difference_sigma", encoder.wheel_radius_difference_sigma);
  file.number("wheel_separation_sigma", encoder.track_width_sigma);
}

void write_lasers(const LaserCalibration& lasers, const fs::path& folder) {
  OriginalSensorFile file(folder / "laser0");
  file.line("sensor_type", "single_point_lasers").number("rate_hz", lasers.rate_hz).line("beams", "");
  for (const LaserBeam& beam : lasers.beams) {
    file.line("  - {name", beam.name + ", origin: " + list(beam.p_BL) + ", direction: " + list(beam.d_B) + "}");
  }
  file.line("range", list(std::array<double, 2>{lasers.range_min, lasers.range_max})).number("noise", lasers.noise);
  file.number("timeshift_laser_imu", lasers.time_offset);
  file.number("timeshift_laser_imu_sigma", lasers.time_offset_sigma);
  file.number("offset_sigma", lasers.offset_sigma);
}

/// data.csv of each sensor, and images.
class Csvs {
 public:
  explicit Csvs(fs::path mav0) : mav0_(std::move(mav0)) {}

  void write(const ImuSample& s) {
    const auto &w = s.gyro_B, &a = s.accel_B;
    row("imu0", "data.csv", "#timestamp [ns],w_x [rad/s],w_y [rad/s],w_z [rad/s],a_x [m/s^2],a_y [m/s^2],a_z [m/s^2]",
        s.t_ns, numbers({w.x(), w.y(), w.z(), a.x(), a.y(), a.z()}));
  }
  void write(const EncoderSample& s) {
    row("encoder0", "data.csv", "#timestamp [ns],left [count],right [count]", s.t_ns,
        std::to_string(s.left_count) + "," + std::to_string(s.right_count));
  }
  void write(const LaserSample& s) {
    row("laser0", "data.csv", "#timestamp [ns], beams [m]", s.t_ns, numbers(s.range));
  }
  void write(const RecordedFrame& frame) {
    write("cam0", frame.left, frame.t_ns);
    if (!frame.right.empty()) write("cam1", frame.right, frame.t_ns);
    if (frame.arrival_ns == frame.t_ns) return;
    row("cam0", "arrival.csv", "#timestamp [ns],arrival [ns]", frame.t_ns, std::to_string(frame.arrival_ns));
  }

 private:
  static std::string numbers(const std::vector<double>& values) {
    std::string joined;
    for (const double value : values) joined += (joined.empty() ? "" : ",") + exact_text(value);
    return joined;
  }

  void write(const std::string& camera, const ImageView& image, TimeNs t_ns) {
    const std::string name = std::to_string(t_ns) + ".pgm";
    row(camera, "data.csv", "#timestamp [ns],filename", t_ns, name);
    const fs::path file = mav0_ / camera / "data" / name;
    fs::create_directories(file.parent_path());
    std::ofstream out(file, std::ios::binary);
    out << "P5\n" << image.width << " " << image.height << "\n255\n";
    for (int y = 0; y < image.height; ++y) {
      out.write(reinterpret_cast<const char*>(image.data + y * image.stride), image.width);
    }
    if (!out.flush()) throw InputError(located(file, 0, "", "cannot be written"));
  }

  void row(const std::string& sensor, const char* name, const char* heading, TimeNs t_ns, const std::string& values) {
    const fs::path path = mav0_ / sensor / name;
    auto file = files_.find(path.string());
    if (file == files_.end()) {
      fs::create_directories(path.parent_path());
      file = files_.emplace(path.string(), OutputFile(path)).first;
      file->second.write(std::string(heading) + "\n");
    }
    file->second.write(std::to_string(t_ns) + "," + values + "\n");
  }

  fs::path mav0_;
  std::map<std::string, OutputFile> files_;
};

}  // namespace

void write_sensor_files(const Calibration& calibration, const fs::path& folder) {
  write_imu(calibration.imu, folder);
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) write_camera(calibration, i, folder);
  if (calibration.encoder) write_encoder(*calibration.encoder, folder);
  if (calibration.lasers) write_lasers(*calibration.lasers, folder);
}

void write_folder(Recording& recording, const fs::path& folder) {
  const fs::path mav0 = folder / "mav0";
  write_sensor_files(recording.calibration(), mav0);
  Csvs files(mav0);
  while (const auto sample = recording.next()) {
    std::visit([&](const auto& s) { files.write(s); }, *sample);
  }
}

}  // namespace ear
