// The samples of a simulation in the order in which a vehicle's drivers deliver them.
#pragma once

#include <cstddef>

#include "tools/simulator/simulation.h"

namespace ear::experiments {

/// So much later than its stamp a frame is there: exposed, read out, tracked [ns]. Samples up to then come before it.
inline constexpr TimeNs kFrameDelay = 10'000'000;

class SampleFeed {
 public:
  /// `simulation` must outlive the feed.
  explicit SampleFeed(const simulator::Simulation& simulation) : simulation_(simulation) {}

  /// Hands every sample not handed out yet and stamped before `t_ns` to `receiver`, which has
  /// add_imu(), add_encoder() and add_laser().
  template <typename Receiver>
  void until(TimeNs t_ns, Receiver& receiver) {
    const auto feed = [t_ns](const auto& samples, std::size_t& next, const auto& add) {
      for (; next < samples.size() && samples[next].t_ns < t_ns; ++next) add(samples[next]);
    };
    feed(simulation_.imu(), imu_, [&](const ImuSample& sample) { receiver.add_imu(sample); });
    feed(simulation_.encoders(), encoder_, [&](const EncoderSample& sample) { receiver.add_encoder(sample); });
    feed(simulation_.lasers(), laser_, [&](const LaserSample& sample) { receiver.add_laser(sample); });
  }

  /// All that came before a frame with this stamp.
  template <typename Receiver>
  void until_frame(TimeNs frame_ns, Receiver& receiver) {
    until(frame_ns + kFrameDelay, receiver);
  }

 private:
  const simulator::Simulation& simulation_;
  std::size_t imu_ = 0;
  std::size_t encoder_ = 0;
  std::size_t laser_ = 0;
};

}  // namespace ear::experiments
