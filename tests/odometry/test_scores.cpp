// The consistency scores that health reports: near 1 for a sound sensor, low while it is not, of that sensor alone.
#include <doctest/doctest.h>

#include <string>

#include "tests/support/simulated_run.h"

using namespace ear;

namespace {

/// Means of a source's score before the fault (8 to 10 s), during it (11 to 15 s) and after it (18 to 20 s).
struct Scores {
  double before = 0.0, during = 0.0, after = 0.0;
};

class Run {
 public:
  Run(const std::string& sequence, const std::string& fault) {
    simulator::Options options;
    options.sequence = sequence;
    options.seed = 861;
    options.duration = 20.0;
    options.faults = {simulator::parse_fault(fault)};
    const simulator::Simulation simulation(options);
    Filter filter(FilterConfig{}, simulation.calibration());
    estimates_ = test::run_filter(filter, simulation);
  }

  Scores of(Source source) const { return {mean(source, 8, 10), mean(source, 11, 15), mean(source, 18, 20)}; }

 private:
  double mean(Source source, double from, double to) const {
    double sum = 0.0;
    int count = 0;
    for (const test::EvaluatedEstimate& e : estimates_) {
      if (e.t < from || e.t > to) continue;
      sum += e.estimate.health.sources[index_of(source)].score;
      ++count;
    }
    REQUIRE(count > 0);
    return sum / count;
  }

  std::vector<test::EvaluatedEstimate> estimates_;
};

}  // namespace

// The other wheel has only the weight (15) of the odometer, which the two have in common.
TEST_CASE("scores: of a wheel that spins idly, and of no other sensor") {
  const Run run("flat1", "wheel_idle_spin.left@10+5");
  const Scores left = run.of(Source::wheel_left);
  CHECK(left.before > 0.7);
  CHECK(left.during < 0.3);
  CHECK(left.after > 0.7);
  CHECK(run.of(Source::wheel_right).during > 3.0 * left.during);
  for (const Source other : {Source::beam_0, Source::gyroscope, Source::accelerometer}) {
    CAPTURE(index_of(other));
    CHECK(run.of(other).during > 0.6);
  }
}

TEST_CASE("scores: of a beam that hits something else, and of no other") {
  const Run run("flat1", "laser_biased.front_left@10+5");
  CHECK(run.of(Source::beam_0).before > 0.7);
  CHECK(run.of(Source::beam_0).during < 0.5);
  CHECK(run.of(Source::beam_1).during > 0.6);
}
