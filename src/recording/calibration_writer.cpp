#include "src/recording/calibration_writer.h"

#include <fstream>
#include <iomanip>

#include "src/recording/input_error.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

class SensorFile {
 public:
  SensorFile(const fs::path& folder, const std::string& sensor, const std::string& heading)
      : path_(folder / sensor / "sensor.yaml") {
    fs::create_directories(path_.parent_path());
    file_.open(path_);
    file_ << std::setprecision(12) << "# " << heading << '\n';
  }

  template <typename Value>
  void value(const std::string& key, const Value& value, const std::string& unit = "") {
    file_ << key << ": " << value << (unit.empty() ? "" : "  # [" + unit + "]") << '\n';
  }

  void sigma(const std::string& key, const std::optional<double>& sigma, const std::string& unit) {
    if (sigma) value(key, *sigma, unit);
  }

  void sigma(const std::string& key, const std::optional<PoseSigma>& sigma) {
    if (!sigma) return;
    file_ << key << ": {rotation: " << sigma->rotation << ", position: " << sigma->position << "}  # [rad, m]\n";
  }

  void sigma(const std::string& key, const std::optional<IntrinsicsSigma>& sigma) {
    if (!sigma) return;
    file_ << key << ": {focal_length: " << sigma->focal_length << ", principal_point: " << sigma->principal_point
          << "}  # [px]\n";
  }

  template <typename Values>
  void list(const std::string& key, const Values& values, int count, const std::string& comment = "") {
    file_ << key << ": [";
    auto value = values.begin();
    for (int i = 0; i < count; ++i) file_ << (i > 0 ? ", " : "") << *value++;
    file_ << ']' << (comment.empty() ? "" : "  # " + comment) << '\n';
  }

  void pose(const Eigen::Isometry3d& T_BS) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = T_BS.matrix();
    file_ << "T_BS: {rows: 4, cols: 4, data: [";
    for (int i = 0; i < 16; ++i) file_ << (i == 0 ? "" : i % 4 == 0 ? ",\n  " : ", ") << rows.data()[i];
    file_ << "]}\n";
  }

  void text(const std::string& line) { file_ << line << '\n'; }
  std::ofstream& stream() { return file_; }

  /// Last: a full disk shows only now.
  void close() {
    file_.close();
    if (!file_) throw InputError(located(path_, 0, "", "cannot be written"));
  }

 private:
  fs::path path_;
  std::ofstream file_;
};

std::string triple(const Eigen::Vector3d& v) {
  std::ostringstream text;
  text << std::setprecision(12) << '[' << v.x() << ", " << v.y() << ", " << v.z() << ']';
  return text.str();
}

void write_imu(const ImuCalibration& imu, const fs::path& folder, const std::string& heading) {
  SensorFile file(folder, "imu0", heading);
  file.pose(Eigen::Isometry3d::Identity());
  file.value("rate_hz", imu.rate_hz);
  file.value("gyroscope_noise_density", imu.gyro_noise, "rad/s/sqrt(Hz)");
  file.value("gyroscope_random_walk", imu.gyro_random_walk, "rad/s^2/sqrt(Hz)");
  file.value("accelerometer_noise_density", imu.accel_noise, "m/s^2/sqrt(Hz)");
  file.value("accelerometer_random_walk", imu.accel_random_walk, "m/s^3/sqrt(Hz)");
  file.sigma("gyroscope_bias_sigma", imu.gyro_bias_sigma, "rad/s");
  file.sigma("accelerometer_bias_sigma", imu.accel_bias_sigma, "m/s^2");
  file.sigma("gyroscope_scale_sigma", imu.gyro_scale_sigma, "relative");
  file.sigma("accelerometer_scale_sigma", imu.accel_scale_sigma, "relative");
  if (!imu.gyro_matrix.isIdentity(0.0)) {
    file.list("gyroscope_matrix", imu.gyro_matrix.reshaped<Eigen::RowMajor>(), 9, "row by row: rate = M measured");
  }
  file.close();
}

void write_encoder(const EncoderCalibration& encoder, const fs::path& folder, const std::string& heading) {
  SensorFile file(folder, "encoder0", heading);
  file.pose(encoder.T_BO);
  file.sigma("T_BS_sigma", encoder.T_BO_sigma);
  file.value("rate_hz", encoder.rate_hz);
  file.value("resolution", encoder.resolution, "counts per revolution");
  file.value("wraps", encoder.wraps ? "true" : "false");
  file.list("wheel_radius", encoder.wheel_radius, 2, "left, right [m]");
  file.sigma("wheel_radius_sigma", encoder.wheel_radius_sigma, "m");
  file.sigma("wheel_radius_difference_sigma", encoder.wheel_radius_difference_sigma, "m");
  file.value("wheel_separation", encoder.track_width, "m");
  file.sigma("wheel_separation_sigma", encoder.track_width_sigma, "m");
  file.value("noise_counts", encoder.noise_counts);
  if (encoder.stamp_sigma > 0.0) file.value("stamp_sigma", encoder.stamp_sigma, "s");
  file.value("timeshift_encoder_imu", encoder.time_offset, "s");
  file.sigma("timeshift_encoder_imu_sigma", encoder.time_offset_sigma, "s");
  file.close();
}

void write_lasers(const LaserCalibration& lasers, const fs::path& folder, const std::string& heading,
                  const std::vector<BeamSigma>& sigmas) {
  SensorFile file(folder, "laser0", heading);
  file.value("rate_hz", lasers.rate_hz);
  file.text("beams:");
  for (std::size_t i = 0; i < lasers.beams.size(); ++i) {
    const LaserBeam& beam = lasers.beams[i];
    file.stream() << "  - {name: " << beam.name << ", origin: " << triple(beam.p_BL)
                  << ", direction: " << triple(beam.d_B);
    if (i < sigmas.size()) {
      file.stream() << ", origin_sigma: " << sigmas[i].origin << ", direction_sigma: " << sigmas[i].direction;
    }
    file.text("}");
  }
  file.list("range", std::array<double, 2>{lasers.range_min, lasers.range_max}, 2);
  file.value("noise", lasers.noise, "m");
  file.value("timeshift_laser_imu", lasers.time_offset, "s");
  file.sigma("timeshift_laser_imu_sigma", lasers.time_offset_sigma, "s");
  file.sigma("offset_sigma", lasers.offset_sigma, "m");
  file.close();
}

}  // namespace

void write_camera(const Calibration& calibration, std::size_t index, const fs::path& folder,
                  const std::string& heading) {
  const CameraCalibration& camera = calibration.cameras[index];
  SensorFile file(folder, "cam" + std::to_string(index), heading);
  file.pose(camera.T_BC);
  file.sigma(index == 0 ? "T_BS_sigma" : "T_C0C1_sigma", camera.pose_sigma);
  if (camera.rate_hz > 0.0) file.value("rate_hz", camera.rate_hz);
  file.list("resolution", std::array<int, 2>{camera.width, camera.height}, 2);
  file.value("camera_model", "pinhole");
  file.list("intrinsics", std::array<double, 4>{camera.fu, camera.fv, camera.cu, camera.cv}, 4, "fu, fv, cu, cv");
  file.sigma("intrinsics_sigma", camera.intrinsics_sigma);
  const bool equidistant = camera.lens == LensModel::equidistant;
  file.value("distortion_model", equidistant ? "equidistant" : "radial-tangential");
  file.list("distortion_coefficients", camera.distortion, camera.distortion[4] != 0.0 && !equidistant ? 5 : 4);
  if (index == 0) {
    file.value("timeshift_cam_imu", calibration.camera_time_offset, "s");
    file.sigma("timeshift_cam_imu_sigma", calibration.camera_time_offset_sigma, "s");
  }
  file.close();
}

void write_calibration(const Calibration& calibration, const fs::path& folder, const std::string& heading,
                       const std::vector<BeamSigma>& beams) {
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) write_camera(calibration, i, folder, heading);
  write_imu(calibration.imu, folder, heading);
  if (calibration.encoder) write_encoder(*calibration.encoder, folder, heading);
  if (calibration.lasers) write_lasers(*calibration.lasers, folder, heading, beams);
}

}  // namespace ear
