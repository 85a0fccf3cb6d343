#include "tools/experiments/replay_simulation.h"

#include <optional>

#include "tools/blind_steps.h"
#include "tools/experiments/sample_feed.h"

namespace ear::experiments {

void replay(const simulator::Simulation& simulation, Filter& filter, const OnEstimate& on_estimate,
            const ReplayOptions& options) {
  tools::BlindSteps steps(options.camera, options.wheels);
  const auto estimate = [&](TimeNs stamp_ns, const std::optional<Estimate>& result) {
    if (result) on_estimate(stamp_ns, *result);
  };
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    if (delivery.stream == simulator::SensorStream::encoder && options.change_encoder) {
      filter.add_encoder(options.change_encoder(simulation.encoders()[delivery.index]));
    } else if (delivery.stream == simulator::SensorStream::laser && options.change_laser) {
      filter.add_laser(options.change_laser(simulation.lasers()[delivery.index]));
    } else {
      hand_over(simulation, delivery, filter);
    }
    if (delivery.stream == simulator::SensorStream::camera && options.camera) {
      FeatureFrame frame = simulation.tracks(delivery.index);
      if (const std::optional<TimeNs> stamp_ns = filter.common_stamp(frame.t_ns)) {
        frame.t_ns = *stamp_ns;
        if (options.change) options.change(frame);
        if (filter.is_next(frame.t_ns) && filter.covers(frame.t_ns)) steps.saw_frame(delivery.arrival_ns);
        estimate(frame.t_ns, filter.process(frame));
      }
    } else if (delivery.stream == simulator::SensorStream::imu && steps.due(delivery.arrival_ns)) {
      const TimeNs stamp_ns = filter.camera_time(simulation.imu()[delivery.index].t_ns);
      estimate(stamp_ns, filter.process_without_image(stamp_ns));
    }
    if (options.after) options.after(delivery);
  }
}

}  // namespace ear::experiments
