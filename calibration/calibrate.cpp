#include "calibration/calibrate.h"

#include <cmath>
#include <stdexcept>

#include "calibration/findings.h"
#include "calibration/information.h"
#include "calibration/stated.h"
#include "calibration/wanted_motion.h"

namespace ear::calibration {
namespace {

constexpr double kGate = 6.0;  // [sigma] of wheels and beams, once there is a solution
constexpr int kFirst = 16;     // iterations
constexpr int kNext = 6;
constexpr int kWhole = 3;         // rounds
constexpr double kLasting = 1.1;  // of the features' errors, from which on they are weighed anew
constexpr double kLeftOut = 4.0;  // [s] of a drive: standing before the start
constexpr double kLate = 5e-3;    // [s] of the cameras' clock: further, the body does not turn at an even rate

std::vector<Entry> all_entries(const std::vector<CalibrationBlock>& blocks) {
  std::vector<Entry> entries;
  for (const CalibrationBlock& block : blocks) {
    entries.insert(entries.end(), block.entries.begin(), block.entries.end());
  }
  return entries;
}

/// To the minimum of what is built.
void solve(Batch& batch, const Settings& settings, int iterations, const std::string& what) {
  const auto told = [&](int iteration, double cost) {
    if (!settings.progress) return;
    settings.progress(what + ", step " + std::to_string(iteration) + ": " + std::to_string(cost));
  };
  if (!batch.solve(iterations, settings.threads, told)) {
    throw std::runtime_error(
        "no minimum found: the sensors contradict each other, or the calibration given is too "
        "far off");
  }
}

/// Returns the residuals before the first step.
std::vector<Residual> minimise(Batch& batch, const Settings& settings) {
  std::vector<Residual> before;
  for (int round = 0; round < settings.rounds; ++round) {
    batch.build(round == 0 ? 0.0 : kGate);
    if (round == 0) before = residuals_of(batch);
    solve(batch, settings, round == 0 ? kFirst : kNext,
          "round " + std::to_string(round + 1) + " of " + std::to_string(settings.rounds));
    if (round + 1 < settings.rounds) batch.learn_noise();
  }
  return before;
}

/// All drives, with the calibration at hand.
struct Passed {
  std::unique_ptr<Batch> batch;
  double left_out = 0.0;  ///< [s]
  std::vector<Residual> before;
};

Passed pass(const Calibration& given, const Priors& priors, const Parameters& start, const Calibration& now,
            const std::vector<Drive>& drives, const Settings& settings) {
  Passed passed{std::make_unique<Batch>(given, priors, start, settings.noise), 0.0, {}};
  for (const Drive& drive : drives) {
    if (settings.progress) settings.progress(drive.name + ": first guess of the motion");
    const FirstGuess guess = guess_motion(drive, given, now, settings.filter, settings.interval);
    passed.batch->add(drive, guess);
    passed.left_out += guess.left_out;
  }
  passed.before = minimise(*passed.batch, settings);
  return passed;
}

/// Over again where the calibration given was so wrong that the filter lost its way, or that keyframes are not where
/// the images were taken: with the one that was found.
Passed pass_until_whole(const Calibration& given, const Priors& priors, const std::vector<Drive>& drives,
                        const Settings& settings) {
  Passed first = pass(given, priors, zero_parameters(given), with_priors(given, priors), drives, settings);
  const Parameters found = first.batch->parameters();
  const bool whole = first.left_out < kLeftOut * static_cast<double>(drives.size());
  if (whole && std::abs(found.camera_time[0]) < kLate) return first;
  Passed second = pass(given, priors, found, applied(given, found), drives, settings);
  second.before = std::move(first.before);
  return second;
}

Information known(Batch& batch, const Settings& settings) {
  if (settings.progress) settings.progress("covariance");
  const std::optional<Information> information = information_of(batch, settings.threads);
  if (!information) throw std::runtime_error("the covariance cannot be computed: the problem is singular");
  return *information;
}

/// The covariance, where need be after features were given the weight that they deserve beside the other sensors.
Covariances weighed(Batch& batch, const Settings& settings) {
  const Information first = known(batch, settings);
  if (first.lasting < kLasting || settings.rounds < kWhole) return first.covariances;
  batch.weigh_pixels(first.lasting);
  batch.build(kGate);
  solve(batch, settings, kNext, "weight of features");
  return known(batch, settings).covariances;
}

}  // namespace

Result calibrate(const Calibration& given, const Priors& priors, const std::vector<Drive>& drives,
                 const Settings& settings) {
  if (drives.empty()) throw std::invalid_argument("no drive to calibrate from");
  const Passed passed = pass_until_whole(given, priors, drives, settings);
  Batch& batch = *passed.batch;
  const Covariances covariances = weighed(batch, settings);

  Result result;
  Decided decided = decide(all_entries(batch.parameter_blocks()), covariances, settings.shown_below, motion_that_shows);
  result.covariance = std::move(decided.covariance);
  result.findings = std::move(decided.findings);
  result.before = passed.before;
  result.after = residuals_of(batch);
  result.parameters = batch.parameters();
  result.noise = batch.noise();
  result.left_out = passed.left_out;
  result.calibration = with_sigmas(applied(given, batch.parameters()), result.findings, result.covariance);
  return result;
}

}  // namespace ear::calibration
