#include "calibration/calibrate.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

#include "calibration/information.h"
#include "calibration/stated.h"
#include "calibration/wanted_motion.h"

namespace ear::calibration {
namespace {

constexpr double kGate = 6.0;  // [sigma] of wheels and beams, once there is a solution
constexpr int kFirst = 12;     // iterations
constexpr int kNext = 6;
constexpr int kRounds = 3;
constexpr double kLasting = 1.1;  // of the features' errors, from which on they are weighed anew
constexpr double kLeftOut = 4.0;  // [s] of a drive: standing before the start
constexpr double kLate = 5e-3;    // [s] of the cameras' clock: further, the body does not turn at an even rate

std::vector<Entry> all_entries(const std::vector<ParameterBlock>& blocks) {
  std::vector<Entry> entries;
  for (const ParameterBlock& block : blocks) {
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
  for (int round = 0; round < kRounds; ++round) {
    batch.build(round == 0 ? 0.0 : kGate);
    if (round == 0) before = residuals_of(batch);
    solve(batch, settings, round == 0 ? kFirst : kNext,
          "round " + std::to_string(round + 1) + " of " + std::to_string(kRounds));
    if (round + 1 < kRounds) batch.learn_noise();
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

Eigen::MatrixXd prior_covariance(const std::vector<Entry>& entries, const std::vector<int>& which) {
  Eigen::VectorXd variance(static_cast<Eigen::Index>(which.size()));
  for (std::size_t i = 0; i < which.size(); ++i) {
    const double prior = entries[static_cast<std::size_t>(which[i])].prior;
    variance(static_cast<Eigen::Index>(i)) = prior * prior;
  }
  return variance.asDiagonal();
}

/// What was not shown goes back to the given value, and what hangs on it with it: the mean of the others given these.
/// They are then as uncertain as they are with what the given values may be wrong by. Returns the covariance of all.
Eigen::MatrixXd refuse(const std::vector<Entry>& entries, const std::vector<bool>& shown, Eigen::MatrixXd P) {
  std::vector<int> kept, moved;
  for (std::size_t i = 0; i < entries.size(); ++i) (shown[i] ? moved : kept).push_back(static_cast<int>(i));
  if (kept.empty()) return P;
  const auto value = [&](int i) -> double& { return *entries[static_cast<std::size_t>(i)].value; };
  Eigen::VectorXd change(static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) change(static_cast<Eigen::Index>(i)) = -value(kept[i]);
  const Eigen::MatrixXd P_kept = P(kept, kept);
  const Eigen::MatrixXd P_cross = P(moved, kept);
  const Eigen::MatrixXd G = P_kept.ldlt().solve(P_cross.transpose()).transpose();
  const Eigen::VectorXd others = G * change;
  for (std::size_t i = 0; i < moved.size(); ++i) value(moved[i]) += others(static_cast<Eigen::Index>(i));
  for (const int i : kept) value(i) = 0.0;
  const Eigen::MatrixXd P0 = prior_covariance(entries, kept);
  P(moved, moved) += G * (P0 - P_kept) * G.transpose();
  P(kept, kept) = P0;
  P(moved, kept) = G * P0;
  P(kept, moved) = (G * P0).transpose();
  return P;
}

void find_entangled(const std::vector<Entry>& entries, const Eigen::MatrixXd& P, std::vector<Finding>& findings) {
  for (Eigen::Index i = 0; i < P.rows(); ++i) {
    Finding& finding = findings[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < P.cols(); ++j) {
      const double correlation = P(i, j) / std::sqrt(P(i, i) * P(j, j));
      if (i == j || std::abs(correlation) <= std::abs(finding.correlation)) continue;
      finding.correlation = correlation;
      finding.entangled_with = entries[static_cast<std::size_t>(j)].name;
    }
  }
}

Information known(Batch& batch, const Settings& settings) {
  if (settings.progress) settings.progress("covariance");
  const std::optional<Information> information = information_of(batch, settings.threads);
  if (!information) throw std::runtime_error("the covariance cannot be computed: the problem is singular");
  return *information;
}

/// The covariance, where need be after features were given the weight that they deserve beside the other sensors.
Eigen::MatrixXd weighed(Batch& batch, const Settings& settings) {
  const Information first = known(batch, settings);
  if (first.lasting < kLasting) return first.covariance;
  batch.weigh_pixels(first.lasting);
  batch.build(kGate);
  solve(batch, settings, kNext, "weight of features");
  return known(batch, settings).covariance;
}

}  // namespace

Result calibrate(const Calibration& given, const Priors& priors, const std::vector<Drive>& drives,
                 const Settings& settings) {
  if (drives.empty()) throw std::invalid_argument("no drive to calibrate from");
  const Passed passed = pass_until_whole(given, priors, drives, settings);
  Batch& batch = *passed.batch;
  const Eigen::MatrixXd P = weighed(batch, settings);

  const std::vector<Entry> entries = all_entries(batch.parameter_blocks());
  std::vector<bool> shown;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    shown.push_back(std::sqrt(P(k, k)) < settings.shown_below * entries[i].prior);
  }
  const Eigen::MatrixXd after = refuse(entries, shown, P);

  Result result;
  result.covariance = after;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Entry& entry = entries[i];
    const double scale = std::abs(entry.scale);
    Finding finding{entry.name,
                    entry.unit,
                    entry.given,
                    entry.scale * *entry.value,
                    scale * entry.prior,
                    scale * std::sqrt(after(k, k)),
                    shown[i],
                    "",
                    0.0,
                    shown[i] ? "" : motion_that_shows(entry.name)};
    result.findings.push_back(finding);
  }
  find_entangled(entries, P, result.findings);
  result.before = passed.before;
  result.after = residuals_of(batch);
  result.parameters = batch.parameters();
  result.noise = batch.noise();
  result.encoder_time = batch.parameters().encoder_time[0];
  result.laser_time = batch.parameters().laser_time[0];
  result.left_out = passed.left_out;
  result.calibration = with_sigmas(applied(given, batch.parameters()), result.findings);
  return result;
}

}  // namespace ear::calibration
