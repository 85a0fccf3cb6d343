#include "src/recording/calibration_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "src/recording/input_error.h"
#include "src/recording/yaml_map.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

constexpr int kMostPixels = 65536;  // along one side of an image

std::optional<LensModel> lens_model(const std::string& name) {
  constexpr std::array kRadialTangential{"radial-tangential", "radial_tangential", "radtan", "plumb_bob", "none"};
  constexpr std::array kEquidistant{"equidistant", "equi", "kannala_brandt", "kannala_brandt4", "fisheye"};
  const auto among = [&](const auto& names) { return std::find(names.begin(), names.end(), name) != names.end(); };
  if (among(kRadialTangential)) return LensModel::radial_tangential;
  if (among(kEquidistant)) return LensModel::equidistant;
  return std::nullopt;
}

// Four coefficients, or five with the k3 of ROS and OpenCV. Zeros behind them change nothing.
std::array<double, 5> distortion_coefficients(const YamlMap& map, const std::string& key, LensModel lens) {
  const bool fisheye = lens == LensModel::equidistant;
  const std::size_t most = fisheye ? 4 : 5;
  const std::vector<double> values = map.numbers(key, 0);
  if (values.size() < 4)
    throw map.error(key, std::to_string(values.size()) + " numbers, not 4" + (fisheye ? "" : " or 5"));
  if (values.size() > most && std::any_of(values.begin() + static_cast<std::ptrdiff_t>(most), values.end(),
                                          [](double value) { return value != 0.0; })) {
    throw map.error(key, std::to_string(values.size()) + " coefficients, of which only the first " +
                             (fisheye ? "four (k1, k2, k3, k4)" : "five (k1, k2, p1, p2, k3)") +
                             " may be other than 0: no other model is known");
  }
  std::array<double, 5> coefficients{};
  std::copy_n(values.begin(), std::min(values.size(), most), coefficients.begin());
  return coefficients;
}

int pixels(const YamlMap& map, double number) {
  if (number != std::floor(number) || number < 1.0 || number > kMostPixels) {
    throw map.error("resolution", "two whole numbers from 1 to " + std::to_string(kMostPixels) + " expected");
  }
  return static_cast<int>(number);
}

// {rotation: rad, position: m}, both if any.
std::optional<PoseSigma> pose_sigma(const YamlMap& map, const std::string& key) {
  if (!map.has(key)) return std::nullopt;
  const YamlMap both = map.child(key);
  both.require_only({"rotation", "position"});
  const std::optional<double> rotation = both.sigma("rotation"), position = both.sigma("position");
  if (!rotation || !position) throw map.error(key, "{rotation: rad, position: m} expected");
  return PoseSigma{*rotation, *position};
}

// {focal_length: px, principal_point: px}, both if any.
std::optional<IntrinsicsSigma> intrinsics_sigma(const YamlMap& map) {
  const char* const key = "intrinsics_sigma";
  if (!map.has(key)) return std::nullopt;
  const YamlMap both = map.child(key);
  both.require_only({"focal_length", "principal_point"});
  const std::optional<double> focal = both.sigma("focal_length"), centre = both.sigma("principal_point");
  if (!focal || !centre) throw map.error(key, "{focal_length: px, principal_point: px} expected");
  return IntrinsicsSigma{*focal, *centre};
}

// What EuRoC's sensor.yaml and Kalibr's camchain have in common; they differ in the key of the coefficients.
CameraCalibration read_lens(const YamlMap& map, const std::string& coefficients_key) {
  const auto camera_model = map.get_or<std::string>("camera_model", "pinhole");
  if (camera_model != "pinhole") throw map.error("camera_model", "'" + camera_model + "' is not known: pinhole");
  const auto lens_name = map.get<std::string>("distortion_model");
  const std::optional<LensModel> lens = lens_model(lens_name);
  if (!lens) {
    throw map.error("distortion_model", "'" + lens_name + "' is not known: radial-tangential, equidistant, none");
  }

  CameraCalibration camera;
  const std::vector<double> resolution = map.numbers("resolution", 2);
  camera.width = pixels(map, resolution[0]);
  camera.height = pixels(map, resolution[1]);
  const std::vector<double> intrinsics = map.numbers("intrinsics", 4);
  camera.fu = intrinsics[0];
  camera.fv = intrinsics[1];
  camera.cu = intrinsics[2];
  camera.cv = intrinsics[3];
  camera.intrinsics_sigma = intrinsics_sigma(map);
  camera.lens = *lens;
  if (lens_name != "none") camera.distortion = distortion_coefficients(map, coefficients_key, *lens);
  camera.rate_hz = map.get_or("rate_hz", 0.0);
  return camera;
}

void read_imu_noise(const YamlMap& map, ImuCalibration& imu) {
  imu.gyro_noise = map.get<double>("gyroscope_noise_density");
  imu.gyro_random_walk = map.get<double>("gyroscope_random_walk");
  imu.accel_noise = map.get<double>("accelerometer_noise_density");
  imu.accel_random_walk = map.get<double>("accelerometer_random_walk");
  imu.gyro_bias_sigma = map.sigma("gyroscope_bias_sigma");
  imu.accel_bias_sigma = map.sigma("accelerometer_bias_sigma");
  imu.gyro_scale_sigma = map.sigma("gyroscope_scale_sigma");
  imu.accel_scale_sigma = map.sigma("accelerometer_scale_sigma");
  if (map.has("gyroscope_matrix")) {
    const std::vector<double> rows = map.numbers("gyroscope_matrix", 9);
    imu.gyro_matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
  }
}

CameraCalibration read_camera(const fs::path& file, bool right) {
  const YamlMap map = YamlMap::load(file);
  CameraCalibration camera = read_lens(map, "distortion_coefficients");
  camera.T_BC = map.pose("T_BS");
  if (right && map.has("T_BS_sigma")) {
    throw map.error("T_BS_sigma", "of the left camera only; here T_C0C1_sigma: how well this camera is known in cam0");
  }
  camera.pose_sigma = pose_sigma(map, right ? "T_C0C1_sigma" : "T_BS_sigma");
  return camera;
}

EncoderCalibration read_encoder(const fs::path& file) {
  const YamlMap map = YamlMap::load(file);
  EncoderCalibration encoder;
  encoder.T_BO = map.pose("T_BS");
  encoder.rate_hz = map.get_or("rate_hz", encoder.rate_hz);
  encoder.resolution = map.get<std::int64_t>("resolution");
  encoder.wraps = map.get<bool>("wraps");
  const std::vector<double> radius = map.numbers("wheel_radius", 2);
  encoder.wheel_radius = {radius[0], radius[1]};
  encoder.track_width = map.get<double>("wheel_separation");
  encoder.noise_counts = map.get<double>("noise_counts");
  encoder.stamp_sigma = map.sigma("stamp_sigma").value_or(0.0);
  encoder.time_offset = map.get_or("timeshift_encoder_imu", 0.0);
  encoder.time_offset_sigma = map.sigma("timeshift_encoder_imu_sigma");
  encoder.T_BO_sigma = pose_sigma(map, "T_BS_sigma");
  encoder.wheel_radius_sigma = map.sigma("wheel_radius_sigma");
  encoder.wheel_radius_difference_sigma = map.sigma("wheel_radius_difference_sigma");
  encoder.track_width_sigma = map.sigma("wheel_separation_sigma");
  return encoder;
}

// Digits that were cut off are not a mistake; check_calibration() finds directions that are worse.
Eigen::Vector3d without_rounding(const Eigen::Vector3d& direction) {
  constexpr double kRotationRounding = 1e-3;
  return std::abs(direction.norm() - 1.0) < kRotationRounding ? Eigen::Vector3d(direction.normalized()) : direction;
}

LaserCalibration read_lasers(const fs::path& file) {
  const YamlMap map = YamlMap::load(file);
  LaserCalibration lasers;
  for (const YamlMap& beam : map.children("beams")) {
    lasers.beams.push_back(
        {beam.get<std::string>("name"), beam.vector3("origin"), without_rounding(beam.vector3("direction"))});
  }
  if (lasers.beams.empty()) throw map.error("beams", "no beam");
  lasers.rate_hz = map.get_or("rate_hz", lasers.rate_hz);
  const std::vector<double> range = map.numbers("range", 2);
  lasers.range_min = range[0];
  lasers.range_max = range[1];
  lasers.noise = map.get<double>("noise");
  lasers.time_offset = map.get_or("timeshift_laser_imu", 0.0);
  lasers.time_offset_sigma = map.sigma("timeshift_laser_imu_sigma");
  lasers.offset_sigma = map.sigma("offset_sigma");
  return lasers;
}

// An optional key beyond EuRoC's, under Kalibr's name.
void read_time_offset(const YamlMap& map, Calibration& calibration) {
  calibration.camera_time_offset = map.get_or("timeshift_cam_imu", 0.0);
  calibration.camera_time_offset_sigma = map.sigma("timeshift_cam_imu_sigma");
}

// Kalibr's camchain: T_cam_imu takes a point from the IMU to the camera; T_cn_cnm1 from the camera before to this one.
void read_camchain(const YamlMap& map, Calibration& calibration) {
  calibration.cameras.clear();
  Eigen::Isometry3d T_CB_before = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 2 && map.has("cam" + std::to_string(i)); ++i) {
    const YamlMap camera_map = map.child("cam" + std::to_string(i));
    CameraCalibration camera = read_lens(camera_map, "distortion_coeffs");
    const bool chained = i > 0 && !camera_map.has("T_cam_imu");
    const Eigen::Isometry3d T_CB = chained ? camera_map.pose("T_cn_cnm1") * T_CB_before : camera_map.pose("T_cam_imu");
    camera.T_BC = T_CB.inverse(Eigen::Affine);
    camera.pose_sigma = pose_sigma(camera_map, i > 0 ? "T_cn_cnm1_sigma" : "T_cam_imu_sigma");
    calibration.cameras.push_back(camera);
    T_CB_before = T_CB;
    // t_imu = t_cam + shift, as ours. Both cameras of a pair share one clock: the left one's shift counts.
    if (i == 0) read_time_offset(camera_map, calibration);
  }
}

void read_kalibr_imu(const YamlMap& file_map, Calibration& calibration) {
  const YamlMap map = file_map.has("imu0") ? file_map.child("imu0") : file_map;
  read_imu_noise(map, calibration.imu);
  calibration.imu.rate_hz = map.get_or("update_rate", calibration.imu.rate_hz);
}

void read_kalibr_file(const fs::path& file, Calibration& calibration) {
  const YamlMap map = YamlMap::load(file);
  if (map.has("cam0")) {
    read_camchain(map, calibration);
  } else if (map.has("imu0") || map.has("accelerometer_noise_density")) {
    read_kalibr_imu(map, calibration);
  } else {
    throw InputError(located(file, 0, "", "neither Kalibr's camchain (cam0) nor its imu.yaml (noise densities)"));
  }
}

bool has_camchain(const std::vector<fs::path>& files) {
  return std::any_of(files.begin(), files.end(), [](const fs::path& file) { return YamlMap::load(file).has("cam0"); });
}

bool has_sensor(const fs::path& mav0, const std::string& name) { return fs::is_directory(mav0 / name); }

std::size_t count_cameras(const fs::path& mav0) {
  const bool left = has_sensor(mav0, "cam0");
  const bool right = has_sensor(mav0, "cam1");
  if (right && !left) throw InputError(located(mav0 / "cam0", 0, "", "no such folder, although there is cam1"));
  return left ? (right ? 2 : 1) : 0;
}

/// Where the sensor.yaml of a recording's sensor is: in the last of the folders given that has one, or in the
/// recording.
class SensorFiles {
 public:
  SensorFiles(const fs::path& mav0, const std::vector<fs::path>& given) : mav0_(mav0) {
    for (const fs::path& path : given) {
      if (!fs::is_directory(path)) continue;
      folders_.push_back(fs::is_directory(path / "mav0") ? path / "mav0" : path);
      bool any = false;
      for (const char* name : {"cam0", "cam1", "imu0", "encoder0", "laser0"}) {
        any = any || fs::exists(folders_.back() / name / "sensor.yaml");
      }
      if (!any)
        throw InputError(located(path, 0, "", "no cam0/sensor.yaml, imu0/sensor.yaml or the like in this folder"));
    }
  }

  [[nodiscard]] fs::path of(const std::string& sensor) const {
    for (auto folder = folders_.rbegin(); folder != folders_.rend(); ++folder) {
      if (fs::exists(*folder / sensor / "sensor.yaml")) return *folder / sensor / "sensor.yaml";
    }
    return mav0_ / sensor / "sensor.yaml";
  }

 private:
  fs::path mav0_;
  std::vector<fs::path> folders_;
};

std::vector<fs::path> files_among(const std::vector<fs::path>& paths) {
  std::vector<fs::path> files;
  std::copy_if(paths.begin(), paths.end(), std::back_inserter(files),
               [](const fs::path& path) { return !fs::is_directory(path); });
  return files;
}

void read_cameras(const fs::path& mav0, const SensorFiles& files, Calibration& calibration) {
  for (const char* name : {"cam0", "cam1"}) {
    const bool right = !calibration.cameras.empty();
    if (has_sensor(mav0, name)) calibration.cameras.push_back(read_camera(files.of(name), right));
  }
  if (has_sensor(mav0, "cam0")) read_time_offset(YamlMap::load(files.of("cam0")), calibration);
}

// Reads imu0/sensor.yaml and returns its T_BS: IMU to the body of the files.
Eigen::Isometry3d read_imu(const fs::path& file, ImuCalibration& imu) {
  const YamlMap map = YamlMap::load(file);
  read_imu_noise(map, imu);
  imu.rate_hz = map.get_or("rate_hz", imu.rate_hz);
  return map.has("T_BS") ? map.pose("T_BS") : Eigen::Isometry3d::Identity();
}

// Our body is the IMU; the body of the files, F, may be another one.
void express_in_imu_frame(const Eigen::Isometry3d& T_FB, Calibration& calibration) {
  const Eigen::Isometry3d T_BF = T_FB.inverse(Eigen::Affine);
  for (CameraCalibration& camera : calibration.cameras) camera.T_BC = T_BF * camera.T_BC;
  if (calibration.encoder) calibration.encoder->T_BO = T_BF * calibration.encoder->T_BO;
  if (!calibration.lasers) return;
  for (LaserBeam& beam : calibration.lasers->beams) {
    beam.p_BL = T_BF * beam.p_BL;
    beam.d_B = T_BF.linear() * beam.d_B;
  }
}

}  // namespace

Calibration load_calibration(const fs::path& mav0, const std::vector<fs::path>& calibration_files, Warnings& warnings,
                             CalibrationKind kind) {
  const SensorFiles sensor_files(mav0, calibration_files);
  const std::vector<fs::path> kalibr_files = files_among(calibration_files);
  Calibration calibration;
  const std::size_t cameras = count_cameras(mav0);
  if (!has_camchain(kalibr_files)) read_cameras(mav0, sensor_files, calibration);
  if (has_sensor(mav0, "encoder0")) calibration.encoder = read_encoder(sensor_files.of("encoder0"));
  if (has_sensor(mav0, "laser0")) calibration.lasers = read_lasers(sensor_files.of("laser0"));

  const fs::path imu_file = sensor_files.of("imu0");
  if (kind == CalibrationKind::alone && !fs::exists(imu_file) && kalibr_files.empty()) {
    warnings.add("calibration: imu0",
                 located(imu_file, 0, "", "does not exist: noise of a typical small IMU is assumed"));
  } else if (fs::exists(imu_file) || kalibr_files.empty()) {
    const Eigen::Isometry3d T_FB = read_imu(imu_file, calibration.imu);
    if (!T_FB.isApprox(Eigen::Isometry3d::Identity(), 1e-6)) {
      express_in_imu_frame(T_FB, calibration);
      warnings.add("calibration: body is not the IMU",
                   located(imu_file, 0, "T_BS", "not the identity; all poses are turned into the IMU's frame"));
    }
  }
  // Kalibr's cameras are already relative to the IMU.
  for (const fs::path& file : kalibr_files) read_kalibr_file(file, calibration);

  if (kind == CalibrationKind::recording) {
    calibration.cameras.resize(std::min(calibration.cameras.size(), cameras));
  }
  return calibration;
}

Calibration load_kalibr(const fs::path& camchain, const fs::path& imu) {
  Calibration calibration;
  const YamlMap map = YamlMap::load(camchain);
  if (!map.has("cam0")) throw map.error("cam0", "missing");
  read_camchain(map, calibration);
  read_kalibr_imu(YamlMap::load(imu), calibration);
  return calibration;
}

}  // namespace ear
