// The samples of a simulation in the order in which a vehicle's drivers deliver them.
#pragma once

#include <cstddef>

#include "tools/simulator/simulation.h"

namespace ear::experiments {

/// Hands one sample to `receiver`, which has add_imu(), add_encoder() and add_laser(). Frames are the caller's.
template <typename Receiver>
void hand_over(const simulator::Simulation& simulation, const simulator::Delivery& delivery, Receiver& receiver) {
  switch (delivery.stream) {
    case simulator::SensorStream::imu:
      receiver.add_imu(simulation.imu()[delivery.index]);
      break;
    case simulator::SensorStream::encoder:
      receiver.add_encoder(simulation.encoders()[delivery.index]);
      break;
    case simulator::SensorStream::laser:
      receiver.add_laser(simulation.lasers()[delivery.index]);
      break;
    case simulator::SensorStream::camera:
      break;
  }
}

/// For those who ask for samples rather than wait for them.
class SampleFeed {
 public:
  /// `simulation` must outlive the feed.
  explicit SampleFeed(const simulator::Simulation& simulation) : simulation_(simulation) {}

  /// Hands every sample not handed out yet that arrives before `t_ns` to `receiver`: see hand_over().
  template <typename Receiver>
  void until(TimeNs t_ns, Receiver& receiver) {
    const auto& deliveries = simulation_.deliveries();
    for (; next_ < deliveries.size() && deliveries[next_].arrival_ns < t_ns; ++next_) {
      hand_over(simulation_, deliveries[next_], receiver);
    }
  }

  /// All that comes before a frame with this stamp.
  template <typename Receiver>
  void until_frame(TimeNs frame_ns, Receiver& receiver) {
    until(frame_ns + simulator::kFrameDelay, receiver);
  }

 private:
  const simulator::Simulation& simulation_;
  std::size_t next_ = 0;
};

}  // namespace ear::experiments
