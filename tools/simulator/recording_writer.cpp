#include "tools/simulator/recording_writer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "tools/simulator/picture_files.h"
#include "tools/simulator/sensors.h"

namespace ear::simulator {
namespace {

namespace fs = std::filesystem;

// A text file written with printf's formats; failures name the file.
class TextFile {
 public:
  explicit TextFile(const fs::path& path) : path_(path) {
    fs::create_directories(path.parent_path());
    file_.reset(std::fopen(path.c_str(), "w"));
    if (!file_) throw std::runtime_error(path.string() + ": cannot be written");
  }

  [[gnu::format(printf, 2, 3)]] void print(const char* format, ...) {
    std::va_list arguments;
    va_start(arguments, format);
    std::vfprintf(file_.get(), format, arguments);
    va_end(arguments);
  }

  // Must be called last: a full disk shows only now.
  void close() {
    const bool written = std::ferror(file_.get()) == 0;
    if (std::fclose(file_.release()) != 0 || !written) throw std::runtime_error(path_.string() + ": write failed");
  }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  fs::path path_;
  std::unique_ptr<std::FILE, Closer> file_;
};

// Of integer nanoseconds, whatever the platform calls them.
long long number(TimeNs t_ns) { return static_cast<long long>(t_ns); }

void print_pose(TextFile& file, const Eigen::Isometry3d& T_BS) {
  const Eigen::Matrix4d& m = T_BS.matrix();
  file.print("T_BS:\n  rows: 4\n  cols: 4\n  data: [");
  for (Eigen::Index row = 0; row < 4; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) {
      file.print("%.15g%s", m(row, column), row == 3 && column == 3 ? "]\n" : column == 3 ? ",\n         " : ", ");
    }
  }
}

void write_camera(const Simulation& simulation, const fs::path& folder, std::size_t index) {
  const CameraCalibration& camera = simulation.calibration().cameras[index];
  TextFile yaml(folder / "sensor.yaml");
  yaml.print(
      "# Global shutter; stamps are the middle of the exposure; pixel (0, 0) is the centre of the first pixel.\n");
  yaml.print("sensor_type: camera\ncomment: %s camera of the stereo pair, simulated\n", index == 0 ? "left" : "right");
  print_pose(yaml, camera.T_BC);
  yaml.print("rate_hz: %g\nresolution: [%d, %d]\ncamera_model: pinhole\n", camera.rate_hz, camera.width, camera.height);
  yaml.print("intrinsics: [%.6f, %.6f, %.6f, %.6f]  # fu, fv, cu, cv\n", camera.fu, camera.fv, camera.cu, camera.cv);
  yaml.print("distortion_model: %s\n", camera.lens == LensModel::equidistant ? "equidistant" : "radial-tangential");
  const std::array<double, 5>& k = camera.distortion;
  yaml.print("distortion_coefficients: [%.8f, %.8f, %.8f, %.8f", k[0], k[1], k[2], k[3]);
  if (k[4] != 0.0) yaml.print(", %.8f", k[4]);
  yaml.print("]\n");
  yaml.print("timeshift_cam_imu: %g  # [s] add it to a stamp to get IMU time\n",
             simulation.calibration().camera_time_offset);
  yaml.close();

  TextFile csv(folder / "data.csv");
  csv.print("#timestamp [ns],filename\n");
  for (const Frame& frame : simulation.frames()) {
    csv.print("%lld,%lld.png\n", number(frame.t_ns), number(frame.taken_ns));
  }
  csv.close();
}

// Frames that arrive later than they usually do.
void write_arrivals(const Simulation& simulation, const fs::path& file) {
  const auto late = [](const Frame& frame) { return frame.arrival_ns > frame.taken_ns + kFrameDelay; };
  const std::vector<Frame>& frames = simulation.frames();
  if (std::none_of(frames.begin(), frames.end(), late)) return;
  TextFile csv(file);
  csv.print("#timestamp [ns],arrival [ns]\n");
  for (const Frame& frame : frames) {
    if (late(frame)) csv.print("%lld,%lld\n", number(frame.t_ns), number(frame.arrival_ns));
  }
  csv.close();
}

void write_imu(const Simulation& simulation, const fs::path& folder) {
  const ImuCalibration& imu = simulation.calibration().imu;
  TextFile yaml(folder / "sensor.yaml");
  yaml.print("sensor_type: imu\ncomment: simulated; each sample is the mean over the interval centred on its stamp\n");
  print_pose(yaml, Eigen::Isometry3d::Identity());
  yaml.print("rate_hz: %g\n", imu.rate_hz);
  yaml.print("gyroscope_noise_density: %g      # [rad/s/sqrt(Hz)]\n", imu.gyro_noise);
  yaml.print("gyroscope_random_walk: %g        # [rad/s^2/sqrt(Hz)]\n", imu.gyro_random_walk);
  yaml.print("accelerometer_noise_density: %g  # [m/s^2/sqrt(Hz)]\n", imu.accel_noise);
  yaml.print("accelerometer_random_walk: %g    # [m/s^3/sqrt(Hz)]\n", imu.accel_random_walk);
  yaml.close();

  TextFile csv(folder / "data.csv");
  csv.print("#timestamp [ns],w_x [rad/s],w_y [rad/s],w_z [rad/s],a_x [m/s^2],a_y [m/s^2],a_z [m/s^2]\n");
  for (const ImuSample& sample : simulation.imu()) {
    csv.print("%lld,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f\n", number(sample.t_ns), sample.gyro_B.x(), sample.gyro_B.y(),
              sample.gyro_B.z(), sample.accel_B.x(), sample.accel_B.y(), sample.accel_B.z());
  }
  csv.close();
}

void write_encoder(const Simulation& simulation, const fs::path& folder) {
  const EncoderCalibration& encoder = *simulation.calibration().encoder;
  TextFile yaml(folder / "sensor.yaml");
  yaml.print("sensor_type: wheel_encoder\nrate_hz: %g\n", encoder.rate_hz);
  yaml.print("# odometer frame O -> body; O at the middle of the axle, x forward, y left, z up\n");
  print_pose(yaml, encoder.T_BO);
  yaml.print("resolution: %lld\nwraps: %s\n", static_cast<long long>(encoder.resolution),
             encoder.wraps ? "true" : "false");
  yaml.print("wheel_radius: [%.9g, %.9g]  # left, right [m]\n", encoder.wheel_radius[0], encoder.wheel_radius[1]);
  yaml.print("wheel_separation: %.9g\nnoise_counts: %g\n", encoder.track_width, encoder.noise_counts);
  yaml.close();

  TextFile csv(folder / "data.csv");
  csv.print("#timestamp [ns],left [count],right [count]\n");
  for (const EncoderSample& sample : simulation.encoders()) {
    csv.print("%lld,%lld,%lld\n", number(sample.t_ns), static_cast<long long>(sample.left_count),
              static_cast<long long>(sample.right_count));
  }
  csv.close();
}

void write_lasers(const Simulation& simulation, const fs::path& folder) {
  const LaserCalibration& lasers = *simulation.calibration().lasers;
  TextFile yaml(folder / "sensor.yaml");
  yaml.print("sensor_type: single_point_lasers\nrate_hz: %g\nbeams:\n", lasers.rate_hz);
  for (const LaserBeam& beam : lasers.beams) {
    yaml.print("  - {name: %s, origin: [%.9f, %.9f, %.9f], direction: [%.12f, %.12f, %.12f]}\n", beam.name.c_str(),
               beam.p_BL.x(), beam.p_BL.y(), beam.p_BL.z(), beam.d_B.x(), beam.d_B.y(), beam.d_B.z());
  }
  yaml.print("range: [%g, %g]\nnoise: %g\n", lasers.range_min, lasers.range_max, lasers.noise);
  yaml.close();

  TextFile csv(folder / "data.csv");
  csv.print("#timestamp [ns]");
  for (const LaserBeam& beam : lasers.beams) csv.print(",%s [m]", beam.name.c_str());
  csv.print("\n");
  for (const LaserSample& sample : simulation.lasers()) {
    csv.print("%lld", number(sample.t_ns));
    for (const double range : sample.range) {
      if (std::isfinite(range)) {
        csv.print(",%.4f", range);
      } else {
        csv.print(",nan");
      }
    }
    csv.print("\n");
  }
  csv.close();
}

void write_truth(const Simulation& simulation, const fs::path& mav0) {
  TextFile csv(mav0 / "state_groundtruth_estimate0" / "data.csv");
  TextFile extra(mav0 / "truth_extra.csv");
  csv.print(
      "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],v_x [m/s],v_y [m/s],v_z [m/s],"
      "b_w_x [rad/s],b_w_y [rad/s],b_w_z [rad/s],b_a_x [m/s^2],b_a_y [m/s^2],b_a_z [m/s^2]\n");
  extra.print(
      "#timestamp [ns],mode [0 ground 1 air],slope_along [rad],slope_across [rad],axle_speed [m/s],slip [m/s]\n");
  for (const TimeNs t_ns : simulation.truth_times()) {
    const Truth truth = simulation.truth(t_ns);
    Eigen::Quaterniond q_WB(truth.R_WB);
    if (q_WB.w() < 0.0) q_WB.coeffs() *= -1.0;
    csv.print("%lld,%.9f,%.9f,%.9f,%.12f,%.12f,%.12f,%.12f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f\n",
              number(truth.t_ns), truth.p_WB.x(), truth.p_WB.y(), truth.p_WB.z(), q_WB.w(), q_WB.x(), q_WB.y(),
              q_WB.z(), truth.v_W.x(), truth.v_W.y(), truth.v_W.z(), truth.b_g.x(), truth.b_g.y(), truth.b_g.z(),
              truth.b_a.x(), truth.b_a.y(), truth.b_a.z());
    extra.print("%lld,%d,%.9f,%.9f,%.9f,%.9f\n", number(truth.t_ns), truth.mode == Mode::air ? 1 : 0, truth.slope_along,
                truth.slope_across, truth.axle_speed, truth.slip);
  }
  csv.close();
  extra.close();
}

// When what goes wrong.
void write_faults(const Simulation& simulation, const fs::path& mav0) {
  TextFile csv(mav0 / "faults.csv");
  csv.print("#fault,target,start [ns],end [ns],parameter\n");
  for (const Fault& fault : simulation.options().faults) {
    const FaultType type = type_of(fault.kind);
    const auto time = [](double seconds) { return number(kStart + std::llround(1e9 * seconds)); };
    const std::string name = type.name + (fault.length > 0 ? ':' + std::to_string(fault.length) : "");
    csv.print("%s,%s,%lld,%lld,%g\n", name.c_str(), type.targets.empty() ? "" : type.targets[fault.target].c_str(),
              time(fault.start), time(fault.end()), fault.parameter);
  }
  csv.close();
}

void write_origin(const Simulation& simulation, const fs::path& directory) {
  TextFile yaml(origin_file(directory));
  yaml.print("# What made this recording. The first lines decide which pictures it can share with another one.\n");
  for (const std::string& line : picture_origin(simulation)) yaml.print("%s\n", line.c_str());
  if (const std::optional<double>& error = simulation.options().calibration_error) {
    yaml.print("calibration_error: %g\n", *error);
  } else {
    yaml.print("calibration_error: fixed sizes\n");
  }
  yaml.print("faults:%s\n", simulation.options().faults.empty() ? " []" : "");
  for (const Fault& fault : simulation.options().faults) yaml.print("  - %s\n", to_string(fault).c_str());
  yaml.close();
}

}  // namespace

void write_recording(const Simulation& simulation, const fs::path& directory, WithCameras cameras) {
  const fs::path mav0 = directory / "mav0";
  if (fs::exists(mav0)) throw std::runtime_error(mav0.string() + ": there is a recording already");
  if (cameras == WithCameras::yes) {
    for (std::size_t i = 0; i < simulation.calibration().cameras.size(); ++i) {
      write_camera(simulation, mav0 / ("cam" + std::to_string(i)), i);
    }
    write_arrivals(simulation, mav0 / "cam0" / "arrival.csv");
  }
  write_imu(simulation, mav0 / "imu0");
  write_encoder(simulation, mav0 / "encoder0");
  write_lasers(simulation, mav0 / "laser0");
  write_truth(simulation, mav0);
  write_faults(simulation, mav0);
  write_origin(simulation, directory);
}

}  // namespace ear::simulator
