// Simulated vehicles with a calibration five times as wrong as those of real rigs, on feature tracks.
#include <cmath>

#include "tests/smoother/support.h"
#include "tools/calibration/simulated_drive.h"

using namespace ear;
using namespace ear::calibration;

namespace {

SimulatedCalibration calibrated(const std::string& sequence, unsigned seed, double rate_hz,
                                std::optional<double> duration = {}) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.camera_rate_hz = rate_hz;
  options.duration = duration;
  options.calibration_error = 5.0;
  return calibrate_simulated(simulator::Simulation(options), Settings{});
}

const Finding& finding(const SimulatedCalibration& made, const std::string& name) {
  for (const Finding& candidate : made.result.findings) {
    if (candidate.name == name) return candidate;
  }
  FAIL("no finding " << name);
  return made.result.findings.front();
}

}  // namespace

TEST_CASE("calibrate: the recommended drive shows everything, and errors are as large as is said") {
  const SimulatedCalibration made = calibrated("calibrate", 11, 15.0);
  double squares = 0.0;
  for (std::size_t i = 0; i < made.errors.size(); ++i) {
    const Finding& found = made.result.findings[i];
    CAPTURE(found.name);
    CHECK(found.shown);
    CHECK(std::abs(made.errors[i]) < 4.5 * found.posterior);
    squares += std::pow(made.errors[i] / found.posterior, 2) / static_cast<double>(made.errors.size());
  }
  MESSAGE("mean squared normalized error: " << squares);
  CHECK(squares < 3.0);
  CHECK(finding(made, "encoder0: wheel radius, mean").posterior < 0.002 * 75.0);
  CHECK(made.result.calibration.encoder->wheel_radius_sigma.has_value());
}

TEST_CASE("calibrate: what standing cannot show keeps its value, and says which motion would show it") {
  const SimulatedCalibration made = calibrated("static", 12, 10.0, 20.0);
  for (const Finding& found : made.result.findings) {
    const auto is = [&](const char* part) { return found.name.find(part) != std::string::npos; };
    const bool by_motion = is("wheel") || is("axle x") || is("axle y") || is("axle turned") || is("origin y");
    if (!by_motion) continue;  // how high the axle is over the beams' origins shows at rest
    CAPTURE(found.name);
    CHECK_FALSE(found.shown);
    CHECK(found.change == 0.0);
    CHECK_FALSE(found.motion_wanted.empty());
    CHECK(found.posterior == doctest::Approx(found.prior));
  }
}

TEST_CASE("calibrate: no estimate is an error in words") {
  Drive drive;
  drive.name = "parked";
  for (int i = 0; i < 200; ++i) drive.imu.push_back({i * 5'000'000LL, {0.0, 0.0, 0.0}, {0.0, 0.0, 9.81}});
  Calibration given;
  given.encoder = EncoderCalibration{};
  CHECK_THROWS_WITH(static_cast<void>(calibrate(given, priors_of(given), {drive}, Settings{})),
                    doctest::Contains("parked: only"));
  CHECK_THROWS_WITH(static_cast<void>(calibrate(given, priors_of(given), {}, Settings{})),
                    doctest::Contains("no drive"));
}
