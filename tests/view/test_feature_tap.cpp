// What the view knows of features: their ages, and what the filter made of each; and that the estimates do not change.
#include <doctest/doctest.h>

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <optional>
#include <vector>

#include "filter/filter.h"
#include "src/view/feature_tap.h"
#include "tools/experiments/sample_feed.h"
#include "tools/simulator/simulation.h"

using namespace ear;
using namespace ear::view;

namespace {

FeatureFrame frame_of(std::initializer_list<std::uint64_t> ids) {
  FeatureFrame frame;
  for (const std::uint64_t id : ids) {
    FeatureObservation seen;
    seen.id = id;
    seen.left.x() = static_cast<double>(id);
    frame.features.push_back(seen);
  }
  return frame;
}

std::unique_ptr<Estimator> make_filter(const FilterConfig& config, const Calibration& calibration) {
  return std::make_unique<Filter>(config, calibration);
}

simulator::Simulation flight() {
  simulator::Options options;
  options.sequence = "fly1";
  options.seed = 21;
  options.duration = 12.0;
  options.camera_rate_hz = 10.0;
  return simulator::Simulation(options);
}

}  // namespace

TEST_CASE("feature tap: a feature's age is the number of frames since it was seen first") {
  FeatureTap tap;
  tap.take(frame_of({7, 3}), {});
  tap.take(frame_of({3, 9}), {});
  tap.take(frame_of({9, 3, 7}), {});
  REQUIRE(tap.features().size() == 3);
  CHECK(tap.features()[0].id == 3);
  CHECK(tap.features()[0].age == 2);
  CHECK(tap.features()[1].age == 0);  // 7 was away: its number would not be used again, and if so it is new
  CHECK(tap.features()[2].age == 1);
}

TEST_CASE("feature tap: what the filter made of a feature stays with it, and one that ended is shown once") {
  FeatureTap tap;
  tap.take(frame_of({1, 2, 3}), {});
  tap.take(frame_of({2, 3}), {{1, true}, {3, false}, {8, true}});  // nobody knows where 8 was
  REQUIRE(tap.features().size() == 3);
  CHECK(tap.features()[0].use == FeatureUse::none_yet);
  CHECK(tap.features()[1].use == FeatureUse::refused);
  CHECK_FALSE(tap.features()[1].ended);
  CHECK(tap.features()[2].id == 1);
  CHECK(tap.features()[2].ended);
  CHECK(tap.features()[2].use == FeatureUse::used);
  CHECK(tap.features()[2].left.x() == 1.0);  // where it was seen last
  tap.take(frame_of({1, 3}), {{3, true}});
  REQUIRE(tap.features().size() == 2);
  CHECK(tap.features()[0].use == FeatureUse::none_yet);  // another one: 1 had ended
  CHECK(tap.features()[0].age == 0);
  CHECK(tap.features()[1].use == FeatureUse::used);
}

TEST_CASE("feature tap: it changes no bit, and shows those that the filter tested as they ended") {
  const simulator::Simulation simulation = flight();
  const auto tap = std::make_shared<FeatureTap>();
  const std::unique_ptr<Estimator> watched = tapped(make_filter, tap)(FilterConfig{}, simulation.calibration());
  const std::unique_ptr<Estimator> alone = make_filter(FilterConfig{}, simulation.calibration());
  int used = 0, refused = 0, ended = 0;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    experiments::hand_over(simulation, delivery, *watched);
    experiments::hand_over(simulation, delivery, *alone);
    if (delivery.stream != simulator::SensorStream::camera) continue;
    const FeatureFrame& frame = simulation.tracks(delivery.index);
    const std::optional<Estimate> a = watched->process(frame), b = alone->process(frame);
    REQUIRE(a.has_value() == b.has_value());
    if (!a) continue;
    REQUIRE(a->state.p_WB == b->state.p_WB);
    REQUIRE(a->state.q_WB.coeffs() == b->state.q_WB.coeffs());
    REQUIRE(a->covariance == b->covariance);
    used += a->frame.features_used;
    refused += a->frame.features_rejected;
    const std::vector<SeenFeature>& features = tap->features();
    const auto gone = std::count_if(features.begin(), features.end(), [](const SeenFeature& f) { return f.ended; });
    REQUIRE(static_cast<int>(features.size() - static_cast<std::size_t>(gone)) == a->frame.tracks);
    ended += static_cast<int>(gone);
  }
  REQUIRE(used > 500);
  CHECK(ended > used / 4);         // many are tested when they end,
  CHECK(ended <= used + refused);  // others go on
}

TEST_CASE("track outcomes: one for each that was tested, also after the clocks were set back; none without an image") {
  const simulator::Simulation simulation = flight();
  std::vector<TrackOutcome> outcomes;
  Filter filter(FilterConfig{}, simulation.calibration());
  filter.report_tracks(&outcomes);
  constexpr TimeNs kHour = 3'600'000'000'000;
  const TimeNs middle = simulation.frame_times()[simulation.frame_times().size() / 2];
  const auto shifted = [&](TimeNs t_ns) { return t_ns > middle ? t_ns - kHour : t_ns; };
  int used_before = 0, used_after = 0;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    if (delivery.stream == simulator::SensorStream::imu) {
      ImuSample sample = simulation.imu()[delivery.index];
      sample.t_ns = shifted(sample.t_ns);
      filter.add_imu(sample);
    }
    if (delivery.stream != simulator::SensorStream::camera) continue;
    FeatureFrame frame = simulation.tracks(delivery.index);
    frame.t_ns = shifted(frame.t_ns);
    const std::optional<Estimate> estimate = filter.process(frame);
    if (!estimate) continue;
    const auto used = std::count_if(outcomes.begin(), outcomes.end(), [](const TrackOutcome& o) { return o.used; });
    REQUIRE(used == estimate->frame.features_used);
    REQUIRE(static_cast<int>(outcomes.size()) == used + estimate->frame.features_rejected);
    (shifted(delivery.arrival_ns) == delivery.arrival_ns ? used_before : used_after) += static_cast<int>(used);
  }
  CHECK(used_before > 200);
  CHECK(used_after > 200);  // it began anew, and was asked before
  REQUIRE_FALSE(outcomes.empty());
  filter.report_tracks(nullptr);
  const std::vector<TrackOutcome> kept = outcomes;
  FeatureFrame last = simulation.tracks(simulation.frame_times().size() - 1);
  last.t_ns = shifted(last.t_ns) + 1'000'000;
  static_cast<void>(filter.process(last));
  CHECK(outcomes.size() == kept.size());  // nobody asks any more
}
