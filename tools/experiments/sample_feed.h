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

  /// Hands every sample not handed out yet and stamped before `t_ns` to `receiver`, which has add_imu().
  template <typename Receiver>
  void until(TimeNs t_ns, Receiver& receiver) {
    for (; imu_ < simulation_.imu().size() && simulation_.imu()[imu_].t_ns < t_ns; ++imu_) {
      receiver.add_imu(simulation_.imu()[imu_]);
    }
  }

  /// All that came before a frame with this stamp.
  template <typename Receiver>
  void until_frame(TimeNs frame_ns, Receiver& receiver) {
    until(frame_ns + kFrameDelay, receiver);
  }

 private:
  const simulator::Simulation& simulation_;
  std::size_t imu_ = 0;
};

}  // namespace ear::experiments
