#include "src/live/calibration_source.h"

#include <cstdlib>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "src/log/log.h"
#include "src/recording/calibration_files.h"
#include "src/recording/folder_writer.h"
#include "src/recording/input_error.h"

namespace ear::live {

Calibration known_calibration(const LiveSettings& settings, const Calibration* played) {
  if (settings.calibration.empty()) {
    if (played != nullptr) return *played;
    if (!settings.ros)
      throw InputError(located(settings.file, 0, "calibration", "missing: a folder with <sensor>/sensor.yaml"));
    return settings.kalibr.size() == 2 ? load_kalibr(settings.kalibr[0], settings.kalibr[1]) : Calibration{};
  }
  Warnings warnings;
  const Calibration calibration = load_calibration(find_mav0(settings.calibration), settings.kalibr, warnings);
  for (const Warning& warning : warnings.list()) log_warning(warning.kind + ": " + warning.first);
  return calibration;
}

void require_usable(const Calibration& calibration, const LiveSettings& settings) {
  std::vector<Finding> findings = check_calibration(calibration);
  if (const auto missing = check_sensors(calibration)) findings.push_back(*missing);
  for (const Finding& finding : findings) {
    const std::string where = located(settings.file, 0, "calibration: " + finding.where, finding.message);
    if (finding.severity == Severity::error) throw InputError(where);
    log_warning(where);
  }
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

}  // namespace ear::live
