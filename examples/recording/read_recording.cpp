// Reads a recording as `ear run` does: all samples of all sensors in the order of time. Makes a small one first.
#include <src/recording/recording.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

namespace {

/// A second of an IMU that stands, in the layout of docs/recordings.md.
void write_recording(const std::filesystem::path& folder) {
  const std::filesystem::path imu = folder / "mav0" / "imu0";
  std::filesystem::create_directories(imu);
  std::ofstream(imu / "sensor.yaml") << "rate_hz: 200\ngyroscope_noise_density: 1e-3\ngyroscope_random_walk: 2e-5\n"
                                        "accelerometer_noise_density: 1e-2\naccelerometer_random_walk: 3e-4\n";
  std::ofstream rows(imu / "data.csv");
  rows << "#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n";
  for (int i = 0; i < 200; ++i) rows << 1'000'000'000LL + 5'000'000LL * i << ",0,0,0,0,0,9.81\n";
}

}  // namespace

int main() {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "ear-example-recording";
  write_recording(folder);
  ear::Recording recording(folder);
  int samples = 0;
  while (const auto sample = recording.next()) samples += std::holds_alternative<ear::ImuSample>(*sample) ? 1 : 0;
  std::cout << samples << " inertial samples at " << recording.calibration().imu.rate_hz << " Hz\n";
  std::filesystem::remove_all(folder);
  return samples == 200 ? EXIT_SUCCESS : EXIT_FAILURE;
}
