#include "tools/experiments/replay_simulation.h"

#include "tools/experiments/sample_feed.h"

namespace ear::experiments {
namespace {

/// `process` takes a frame's index to the estimate after it.
void feed_all(const simulator::Simulation& simulation, Filter& filter, const OnEstimate& on_estimate,
              const std::function<std::optional<Estimate>(std::size_t)>& process) {
  SampleFeed feed(simulation);
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    feed.until_frame(simulation.frame_times()[i], filter);
    if (const std::optional<Estimate> estimate = process(i)) on_estimate(i, *estimate);
  }
}

}  // namespace

void replay(const simulator::Simulation& simulation, Filter& filter, const OnEstimate& on_estimate,
            const ChangeFrame& change) {
  feed_all(simulation, filter, on_estimate, [&](std::size_t i) {
    FeatureFrame frame = simulation.tracks(i);
    if (change) change(frame);
    return filter.process(frame);
  });
}

void replay_without_camera(const simulator::Simulation& simulation, Filter& filter, const OnEstimate& on_estimate) {
  feed_all(simulation, filter, on_estimate,
           [&](std::size_t i) { return filter.process_without_image(simulation.frame_times()[i]); });
}

}  // namespace ear::experiments
