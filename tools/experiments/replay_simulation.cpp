#include "tools/experiments/replay_simulation.h"

#include "tools/experiments/sample_feed.h"

namespace ear::experiments {

void replay(const simulator::Simulation& simulation, Filter& filter, const OnEstimate& on_estimate,
            const ChangeFrame& change) {
  SampleFeed feed(simulation);
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    feed.until_frame(simulation.frame_times()[i], filter);
    FeatureFrame frame = simulation.tracks(i);
    if (change) change(frame);
    if (const std::optional<Estimate> estimate = filter.process(frame)) on_estimate(i, *estimate);
  }
}

}  // namespace ear::experiments
