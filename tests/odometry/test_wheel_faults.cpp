// Wheels that are wrong for five seconds, on feature tracks: the error stays near that of right ones, and known.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/simulated_run.h"

using namespace ear;

namespace {

constexpr double kFour = 4.0;                                // standard deviations that a mean may be off by
constexpr double kErrorScatter = 0.07, kNeesScatter = 0.25;  // measured: of one run

struct Outcome {
  double position = 0.0;  ///< RMS of the error, from the common start on [m]
  double nees = 0.0;      ///< of the position, mean from the fault's start on; 3 is consistent
};

Outcome run(const std::string& sequence, std::uint64_t seed, const std::string& fault) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.duration = 25.0;
  if (!fault.empty()) options.faults = {simulator::parse_fault(fault)};
  const simulator::Simulation simulation(options);
  Filter filter(FilterConfig{}, simulation.calibration());
  Outcome outcome;
  int count = 0;
  int later = 0;
  for (const test::EvaluatedEstimate& e : test::run_filter(filter, simulation)) {
    outcome.position += e.dp_W.squaredNorm();
    ++count;
    if (e.t < 10.0) continue;
    const Eigen::Matrix3d P = e.estimate.covariance.block<3, 3>(estimate_error::position, estimate_error::position);
    outcome.nees += e.dp_W.dot(P.ldlt().solve(e.dp_W));
    ++later;
  }
  REQUIRE(later > 0);
  outcome.position = std::sqrt(outcome.position / count);
  outcome.nees /= later;
  return outcome;
}

}  // namespace

// Measured with five seeds (821 to 825), in 60 runs: 1.025 times the error without the fault, standard deviation
// 0.063, 1.28 in the worst; a position NEES 0.07 above the one without it, standard deviation 0.24, 0.72 in the worst.
// The mean over the drives is judged: a limit for one of them would be a lottery.
TEST_CASE(
    "wheel faults: one wheel off the ground, counts that stay, wheels that slip or spin idly cost next to nothing") {
  struct Drive {
    std::string sequence;
    std::uint64_t seed;
    Outcome clean;
  };
  std::vector<Drive> drives;
  for (const char* sequence : {"flat1", "wave1"}) {
    for (const std::uint64_t seed : {821U, 822U, 823U}) drives.push_back({sequence, seed, run(sequence, seed, "")});
  }
  const double root = std::sqrt(static_cast<double>(drives.size()));
  for (const std::string fault : {"wheel_lifted.left@10+5", "wheel_lifted.right@10+5", "encoder_frozen.both@10+5",
                                  "encoder_frozen.right@10+5", "wheel_slipping@10+5", "wheel_idle_spin.left@10+5"}) {
    CAPTURE(fault);
    double error = 0.0, nees = 0.0;  // means over the drives: logarithm of the ratio, and difference
    for (const Drive& drive : drives) {
      const Outcome faulty = run(drive.sequence, drive.seed, fault);
      error += std::log(faulty.position / drive.clean.position) / static_cast<double>(drives.size());
      nees += (faulty.nees - drive.clean.nees) / static_cast<double>(drives.size());
    }
    CHECK(error < kFour * kErrorScatter / root);
    CHECK(nees < kFour * kNeesScatter / root);
  }
}
