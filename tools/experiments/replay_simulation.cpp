#include "tools/experiments/replay_simulation.h"

#include <optional>

#include "src/blind_steps.h"
#include "tools/experiments/sample_feed.h"
#include "tools/processor_time.h"

namespace ear::experiments {

void replay(const simulator::Simulation& simulation, Estimator& estimator, const OnEstimate& on_estimate,
            const ReplayOptions& options) {
  BlindSteps steps(options.camera, options.wheels);
  const auto report = [&](TimeNs stamp_ns, const std::optional<Estimate>& estimate) {
    if (estimate) on_estimate(stamp_ns, *estimate);
  };
  const auto timed = [&](const auto& call) {
    const double start = options.processor_time != nullptr ? tools::thread_time() : 0.0;
    call();
    if (options.processor_time != nullptr) *options.processor_time += tools::thread_time() - start;
  };
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    timed([&] {
      if (delivery.stream == simulator::SensorStream::encoder && options.change_encoder) {
        estimator.add_encoder(options.change_encoder(simulation.encoders()[delivery.index]));
      } else if (delivery.stream == simulator::SensorStream::laser && options.change_laser) {
        estimator.add_laser(options.change_laser(simulation.lasers()[delivery.index]));
      } else {
        hand_over(simulation, delivery, estimator);
      }
    });
    std::optional<Estimate> result;
    if (delivery.stream == simulator::SensorStream::camera && options.camera) {
      FeatureFrame frame = simulation.tracks(delivery.index);
      if (const std::optional<TimeNs> stamp_ns = estimator.common_stamp(frame.t_ns)) {
        frame.t_ns = *stamp_ns;
        if (options.change) options.change(frame);
        if (estimator.check_stamp(frame.t_ns) == FrameStamp::usable) steps.saw_frame(delivery.arrival_ns);
        timed([&] { result = estimator.process(frame); });
        report(frame.t_ns, result);
      }
    } else if (delivery.stream == simulator::SensorStream::imu && steps.due(delivery.arrival_ns)) {
      const TimeNs now_ns = simulation.imu()[delivery.index].t_ns;
      const TimeNs stamp_ns = estimator.camera_time(step_time(now_ns, estimator.frame_time(now_ns)));
      timed([&] { result = estimator.process_without_image(stamp_ns); });
      report(stamp_ns, result);
    }
    if (options.after) options.after(delivery);
  }
}

}  // namespace ear::experiments
