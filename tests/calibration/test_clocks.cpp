// Clocks of wheels and lasers, from a drive to the filter that uses them: found, written, read.
#include <algorithm>
#include <cmath>
#include <string>

#include "tests/smoother/support.h"

#include "src/recording/calibration_files.h"
#include "tests/recording/support.h"
#include "tools/calibration/result_files.h"
#include "tools/calibration/simulated_drive.h"

using namespace ear;

namespace {

const calibration::Finding& finding(const calibration::Result& result, const std::string& name) {
  const auto found = std::find_if(result.findings.begin(), result.findings.end(),
                                  [&](const calibration::Finding& candidate) { return candidate.name == name; });
  REQUIRE(found != result.findings.end());
  return *found;
}

}  // namespace

TEST_CASE("calibrate: clocks of wheels and lasers are found from where they were given, written, and read back") {
  simulator::Options options;
  options.sequence = "calibrate";  // it swings, without which the lasers' clock does not show
  options.seed = 13;
  options.calibration_error = 1.0;
  const simulator::Simulation simulation(options);
  calibration::Drive drive = calibration::recorded_drive(simulation);
  drive.frames.clear();  // without cameras it takes two seconds
  for (EncoderSample& sample : drive.encoders) sample.t_ns -= 80'000'000;
  for (LaserSample& sample : drive.lasers) sample.t_ns += 40'000'000;
  Calibration given = simulation.calibration();
  given.cameras.clear();
  given.encoder->time_offset = 0.077;
  given.lasers->time_offset = -0.037;

  calibration::Priors priors = calibration::drawn_priors(1.0);
  priors.encoder_time = priors.laser_time = 5e-3;

  const calibration::Result result = calibration::calibrate(given, priors, {drive}, calibration::Settings{});
  const auto check = [&](const char* name, double told, double right) {
    const calibration::Finding& clock = finding(result, name);
    MESSAGE(clock.name << ": " << clock.given + clock.change << " +- " << clock.posterior << " [ms], told " << told);
    CHECK(clock.shown);
    CHECK(clock.given == doctest::Approx(told));
    CHECK(std::abs(clock.given + clock.change - right) < 4.5 * clock.posterior);
    CHECK(clock.posterior < 2.5);
  };
  check("encoder0: time offset", 77.0, 80.0);
  check("laser0: time offset", -37.0, -40.0);

  const test::TempFolder folder;
  calibration::write_result(result, folder.path());
  Warnings warnings;
  const Calibration back = load_calibration(folder.path(), {}, warnings, CalibrationKind::alone);
  CHECK(std::abs(back.encoder->time_offset - 0.08) < 0.0015);
  CHECK(back.encoder->time_offset == doctest::Approx(result.calibration.encoder->time_offset));
  CHECK(back.lasers->time_offset == doctest::Approx(result.calibration.lasers->time_offset));
  const calibration::Priors next = calibration::priors_of(back);
  CHECK(next.encoder_time == doctest::Approx(1e-3 * finding(result, "encoder0: time offset").posterior));
  CHECK(next.laser_time == doctest::Approx(1e-3 * finding(result, "laser0: time offset").posterior));
}
