// The readers of calibration files. First byte: which file the rest is; the other ones are good. All that may happen is
// a calibration, which the check and the filter can judge, or an InputError.
#include <array>

#include "filter/filter.h"
#include "src/recording/calibration_files.h"
#include "src/recording/input_error.h"
#include "tests/fuzz/support.h"

namespace {

constexpr const char* kCamchain = R"(cam0:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.05]
  - [0.0, 0.0, -1.0, 0.0]
  - [1.0, 0.0, 0.0, -0.1]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]
  distortion_model: equidistant
  intrinsics: [10.5, 10.25, 8.0, 6.0]
  resolution: [16, 12]
  timeshift_cam_imu: -0.0125
)";
constexpr const char* kImu =
    "update_rate: 250.0\naccelerometer_noise_density: 0.02\naccelerometer_random_walk: 0.003\n"
    "gyroscope_noise_density: 0.004\ngyroscope_random_walk: 0.00005\n";
constexpr std::array<const char*, 6> kFiles{"camchain-imucam.yaml",      "imu.yaml",
                                            "mav0/cam0/sensor.yaml",     "mav0/imu0/sensor.yaml",
                                            "mav0/encoder0/sensor.yaml", "mav0/laser0/sensor.yaml"};

ear::Calibration load(const ear::fuzz::Folder& folder, std::size_t which, const std::filesystem::path& file) {
  switch (which) {
    case 0:
      return ear::load_kalibr(file, folder.write("good/imu.yaml", kImu));
    case 1:
      return ear::load_kalibr(folder.write("good/camchain-imucam.yaml", kCamchain), file);
    default: {
      ear::Warnings warnings;
      const std::filesystem::path sensor = file.parent_path();
      for (const char* name : {"cam0", "encoder0", "laser0"}) {
        std::filesystem::remove_all(sensor.parent_path() / name / "data.csv");
      }
      folder.write(("mav0/" + sensor.filename().string() + "/data.csv").c_str(), "");
      folder.write("mav0/imu0/data.csv", "");
      std::vector<std::filesystem::path> kalibr{folder.write("good/camchain-imucam.yaml", kCamchain)};
      if (which != 3) kalibr.push_back(folder.write("good/imu.yaml", kImu));
      if (which == 2) kalibr.erase(kalibr.begin());
      return ear::load_calibration(folder.path() / "mav0", kalibr, warnings);
    }
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ear::fuzz::Folder kFolder;
  if (size == 0) return 0;
  const std::size_t which = data[0] % kFiles.size();
  const auto file = kFolder.write(kFiles[which], {reinterpret_cast<const char*>(data) + 1, size - 1});
  try {
    const ear::Calibration calibration = load(kFolder, which, file);
    static_cast<void>(ear::check_calibration(calibration));
    const ear::Filter filter(ear::FilterConfig{}, calibration);
  } catch (const ear::InputError&) {
  } catch (const std::invalid_argument&) {  // the filter's word on what it cannot use
  }
  return 0;
}
