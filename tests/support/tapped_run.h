// A filter on a simulation's samples, each of which a test may alter, hold back or repeat on its way.
#pragma once

#include <functional>
#include <optional>

#include "filter/filter.h"
#include "src/blind_steps.h"
#include "tools/simulator/simulation.h"

namespace ear::test {

/// What happens to a sample on its way: each returns how many times it is handed over. Empty: it stays as it is.
/// `t`: true time since the first arrival [s].
struct Taps {
  std::function<int(double t, ImuSample&)> imu;
  std::function<int(double t, EncoderSample&)> encoder;
  std::function<int(double t, LaserSample&)> laser;
  std::function<int(double t, FeatureFrame&)> frame;
};

template <typename Sample, typename Tap, typename Take>
void pass_on(double t, Sample sample, const Tap& tap, const Take& take) {
  const int times = tap ? tap(t, sample) : 1;
  for (int i = 0; i < times; ++i) take(sample);
}

/// Calls `check(t, result)` after every frame, and after the steps that are made while frames are missing.
inline void run_tapped(const simulator::Simulation& simulation, Filter& filter, const Taps& taps,
                       const std::function<void(double t, const std::optional<Estimate>& result)>& check) {
  BlindSteps steps(true, true);
  const TimeNs start_ns = simulation.deliveries().front().arrival_ns;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    const double t = seconds_between(start_ns, delivery.arrival_ns);
    switch (delivery.stream) {
      case simulator::SensorStream::imu:
        pass_on(t, simulation.imu()[delivery.index], taps.imu, [&](const ImuSample& s) {
          filter.add_imu(s);
          if (steps.due(delivery.arrival_ns)) check(t, filter.process_without_image(filter.camera_time(s.t_ns)));
        });
        break;
      case simulator::SensorStream::encoder:
        pass_on(t, simulation.encoders()[delivery.index], taps.encoder,
                [&](const EncoderSample& s) { filter.add_encoder(s); });
        break;
      case simulator::SensorStream::laser:
        pass_on(t, simulation.lasers()[delivery.index], taps.laser, [&](const LaserSample& s) { filter.add_laser(s); });
        break;
      case simulator::SensorStream::camera:
        pass_on(t, simulation.tracks(delivery.index), taps.frame, [&](const FeatureFrame& f) {
          steps.saw_frame(delivery.arrival_ns);
          check(t, filter.process(f));
        });
        break;
    }
  }
}

}  // namespace ear::test
