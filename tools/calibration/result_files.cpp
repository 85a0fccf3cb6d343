#include "tools/calibration/result_files.h"

#include <fstream>
#include <vector>

#include "calibration/degree.h"
#include "calibration/stated.h"
#include "src/recording/calibration_writer.h"
#include "src/recording/input_error.h"
#include "tools/calibration/result_text.h"

namespace ear::calibration {
namespace {

/// Of each beam, the mean of its axes.
std::vector<BeamSigma> beam_sigmas(const Result& result) {
  std::vector<BeamSigma> sigmas;
  if (!result.calibration.lasers) return sigmas;
  for (const LaserBeam& beam : result.calibration.lasers->beams) {
    const auto mean = [&](const std::string& what) {
      return mean_sigma(result.findings, "laser0 " + beam.name + ": " + what).value_or(0.0);
    };
    sigmas.push_back({1e-3 * mean("origin"), kDegree * mean("direction")});
  }
  return sigmas;
}

}  // namespace

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  stream.close();
  if (!stream) throw InputError(located(file, 0, "", "cannot be written"));
}

std::string write_result(const Result& result, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  write_calibration(result.calibration, folder, "by ear calibrate", beam_sigmas(result));
  const std::string text = to_text(result);
  write_text(folder / "calibration.txt", text);
  write_text(folder / "calibration.json", to_json(result));
  return text;
}

}  // namespace ear::calibration
