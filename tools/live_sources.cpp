#include "tools/live_sources.h"

#include <stdlib.h>

#include <cmath>
#include <system_error>
#include <utility>

#include "src/log/log.h"
#include "src/mavlink/odometry_message.h"
#include "src/recording/calibration_files.h"
#include "src/recording/folder_writer.h"
#include "src/recording/input_error.h"

namespace ear::tools {
namespace {

Eigen::Matrix3d mounting(const live::MavlinkSettings& settings, const Calibration& calibration) {
  constexpr double kDegree = M_PI / 180.0;
  if (settings.mounting_deg) {
    const auto& [roll, pitch, yaw] = *settings.mounting_deg;
    return mavlink::mounting_of(roll * kDegree, pitch * kDegree, yaw * kDegree);
  }
  if (calibration.encoder) return mavlink::mounting_of(*calibration.encoder);
  throw InputError("mavlink: mounting_deg: how does the IMU sit in the vehicle? Without wheels nothing else says so");
}

}  // namespace

Calibration live_calibration(const live::LiveSettings& settings, const live::Player* player) {
  if (settings.calibration.empty()) {
    if (player != nullptr) return player->calibration();
    if (!settings.ros)
      throw InputError(located(settings.file, 0, "calibration", "missing: a folder with <sensor>/sensor.yaml"));
    return settings.kalibr.size() == 2 ? load_kalibr(settings.kalibr[0], settings.kalibr[1]) : Calibration{};
  }
  Warnings warnings;
  const Calibration calibration = load_calibration(find_mav0(settings.calibration), settings.kalibr, warnings);
  for (const Warning& warning : warnings.list()) log_warning(warning.kind + ": " + warning.first);
  return calibration;
}

SensorFiles::SensorFiles(const Calibration& calibration, std::filesystem::path folder) : folder_(std::move(folder)) {
  if (!folder_.empty()) return;
  std::string name = (std::filesystem::temp_directory_path() / "ear-live-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw InputError(located(name, 0, "", "cannot be created"));
  folder_ = name;
  temporary_ = true;
  write_sensor_files(calibration, folder_);
}

SensorFiles::~SensorFiles() {
  std::error_code ignored;  // a temporary folder that stays is no reason to fail
  if (temporary_) std::filesystem::remove_all(folder_, ignored);
}

Calibration SensorFiles::read() const {
  Warnings ignored;  // they were said of the files before
  return load_calibration(folder_, {}, ignored);
}

void require_usable(const Calibration& calibration, const live::LiveSettings& settings) {
  std::vector<Finding> findings = check_calibration(calibration);
  if (const auto missing = check_sensors(calibration)) findings.push_back(*missing);
  for (const Finding& finding : findings) {
    const std::string where = located(settings.file, 0, "calibration: " + finding.where, finding.message);
    if (finding.severity == Severity::error) throw InputError(where);
    log_warning(where);
  }
}

std::unique_ptr<live::StereoCamera> open_cameras(const live::LiveSettings& settings, live::Intake& intake) {
  if (!settings.cameras) return nullptr;
  const live::CameraSettings& wanted = *settings.cameras;
  const std::vector<CameraCalibration>& cameras = intake.calibration().cameras;
  if (cameras.empty()) throw InputError(located(settings.file, 0, "cameras", "the calibration has none"));
  if (!wanted.right.empty() && cameras.size() < 2) {
    throw InputError(located(settings.file, 0, "cameras.right", "the calibration has one camera"));
  }
  const bool side_by_side = wanted.right.empty() && cameras.size() > 1;
  const int width = (side_by_side ? 2 : 1) * cameras[0].width;
  auto left = live::open_v4l2(wanted.device, width, cameras[0].height, wanted.rate_hz);
  std::unique_ptr<live::VideoDevice> right;
  if (!wanted.right.empty()) right = live::open_v4l2(wanted.right, cameras[1].width, cameras[1].height, wanted.rate_hz);
  return std::make_unique<live::StereoCamera>(std::move(left), std::move(right), wanted.delay, intake);
}

MavlinkLines::MavlinkLines(const std::vector<live::MavlinkSettings>& settings, live::Intake& intake) {
  for (const live::MavlinkSettings& one : settings) {
    Line line;
    mavlink::LinkListener listener;
    if (one.inputs.any()) {
      line.sensors = std::make_unique<live::MavlinkSensors>(one.inputs, intake);
      listener.on_packet = [sensors = line.sensors.get()](const mavlink::Packet& packet) { sensors->take(packet); };
      listener.asks_time = true;
    }
    const mavlink::Sender self{static_cast<std::uint8_t>(one.system)};
    const live::LiveClock& clock = intake.clock();
    line.link = std::make_unique<mavlink::Link>(
        one.address, self, [&clock] { return clock.now(); }, listener);
    if (one.send) {
      line.output = std::make_unique<live::MavlinkOutput>(*line.link, mounting(one, intake.calibration()),
                                                          intake.calibration().imu);
    }
    lines_.push_back(std::move(line));
  }
}

void MavlinkLines::take(const live::LiveSample& sample) {
  for (Line& line : lines_) {
    if (line.output) line.output->take(sample);
  }
}

void MavlinkLines::take(const live::LiveFrame& frame) {
  for (Line& line : lines_) {
    if (line.output) line.output->take(frame);
  }
}

std::vector<std::string> MavlinkLines::look() {
  std::vector<std::string> words;
  for (Line& line : lines_) {
    if (!line.sensors) continue;
    for (std::string& text : line.sensors->look()) words.push_back(std::move(text));
  }
  return words;
}

}  // namespace ear::tools
