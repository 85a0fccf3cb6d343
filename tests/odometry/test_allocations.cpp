// Once there is an estimate, the filter asks for no memory: whatever it needs it took at construction.
#include <doctest/doctest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "filter/filter.h"
#include "tests/support/skip.h"
#include "tools/allocation_counter.h"
#include "tools/experiments/sample_feed.h"
#include "tools/simulator/simulation.h"

namespace ear {
namespace {

bool can_count() {
  if (tools::counts_allocations()) return true;
  test::skip("no hook in malloc: built with a sanitizer, or not on glibc");
  return false;
}

/// What the filter did, and what it asked for since the first estimate.
struct Tally {
  int frames = 0;    ///< with an estimate
  int standing = 0;  ///< of these
  int flying = 0;
  int landings = 0;
  int updates = 0;   ///< features that updated the filter
  int reported = 0;  ///< the same, by what became of each
  std::uint64_t allocations = 0;
  int allocating_frames = 0;  ///< frames, with the samples before them
};

Tally run(const simulator::Simulation& simulation, const FilterConfig& config) {
  Filter filter(config, simulation.calibration());
  std::vector<TrackOutcome> outcomes;
  outcomes.reserve(static_cast<std::size_t>(config.max_track_updates));
  filter.report_tracks(&outcomes);
  Tally tally;
  bool flying = false;
  std::uint64_t before = tools::thread_allocations();
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    experiments::hand_over(simulation, delivery, filter);
    if (delivery.stream != simulator::SensorStream::camera) continue;
    const FeatureFrame& frame = simulation.tracks(delivery.index);
    static_cast<void>(filter.common_stamp(frame.t_ns));
    const std::optional<Estimate> estimate = filter.process(frame);
    const std::uint64_t now = tools::thread_allocations();
    if (estimate && tally.frames > 0) {
      tally.allocations += now - before;
      tally.allocating_frames += now != before ? 1 : 0;
    }
    before = now;
    if (!estimate) continue;
    ++tally.frames;
    tally.standing += estimate->frame.standing ? 1 : 0;
    tally.updates += estimate->frame.features_used;
    for (const TrackOutcome& outcome : outcomes) tally.reported += outcome.used ? 1 : 0;
    tally.landings += flying && estimate->frame.on_ground ? 1 : 0;
    flying = !estimate->frame.on_ground;
    tally.flying += flying ? 1 : 0;
  }
  return tally;
}

simulator::Simulation simulate(const std::string& sequence, double duration) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = 11;
  options.duration = duration;
  return simulator::Simulation(options);
}

void check(const Tally& tally) {
  CAPTURE(tally.allocating_frames);
  CHECK(tally.frames > 200);
  CHECK(tally.updates > 1000);
  CHECK(tally.reported == tally.updates);
  CHECK(tally.allocations == 0);
}

TEST_CASE("allocations: none while it stands, drives, takes off, flies and lands") {
  if (!can_count()) return;
  for (const char* const sequence : {"flat1", "wave2", "fly1"}) {
    CAPTURE(sequence);
    const Tally tally = run(simulate(sequence, 40.0), FilterConfig{});
    check(tally);
    CHECK(tally.standing > 10);
    if (std::string(sequence) == "fly1") {
      CHECK(tally.flying > 100);
      CHECK(tally.landings > 0);
    }
  }
}

TEST_CASE("allocations: none with every model of the odometer and every update") {
  if (!can_count()) return;
  const simulator::Simulation slope = simulate("slope", 15.0);
  const simulator::Simulation level = simulate("flat1", 15.0);
  for (const OdometerModel model :
       {OdometerModel::none, OdometerModel::differential, OdometerModel::gyro, OdometerModel::terrain}) {
    CAPTURE(static_cast<int>(model));
    FilterConfig config;
    config.odometer.model = model;
    const bool planar = model == OdometerModel::differential || model == OdometerModel::gyro;
    check(run(planar ? level : slope, config));  // on a slope the planar ones lose the estimate, and begin anew
  }
  FilterConfig config;
  config.anomaly.enabled = true;
  check(run(slope, config));
}

TEST_CASE("allocations: none when samples are missing and images repeat") {
  if (!can_count()) return;
  simulator::Options options;
  options.sequence = "flat1";
  options.seed = 12;
  options.duration = 20.0;
  options.faults = {simulator::parse_fault("imu_gap@8+0.1"), simulator::parse_fault("camera_frozen@12+2")};
  check(run(simulator::Simulation(options), FilterConfig{}));
}

}  // namespace
}  // namespace ear
