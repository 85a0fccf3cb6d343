#include <doctest/doctest.h>

#include <vector>

#include "tools/experiments/sample_feed.h"

namespace ear::experiments {
namespace {

/// Notes what it is given.
struct Receiver {
  std::vector<TimeNs> stamps;
  std::size_t encoders = 0;
  std::size_t lasers = 0;
  void add_imu(const ImuSample& sample) { stamps.push_back(sample.t_ns); }
  void add_encoder(const EncoderSample&) { ++encoders; }
  void add_laser(const LaserSample&) { ++lasers; }
};

TEST_CASE("sample feed: every sample once, in time order, and none that is later than the frame's arrival") {
  simulator::Options options;
  options.duration = 2.0;
  options.tracks = false;
  const simulator::Simulation simulation(options);
  Receiver receiver;
  SampleFeed feed(simulation);
  for (const TimeNs t_ns : simulation.frame_times()) {
    feed.until_frame(t_ns, receiver);
    REQUIRE(!receiver.stamps.empty());
    CHECK(receiver.stamps.back() < t_ns + kFrameDelay);
    CHECK(receiver.stamps.back() >= t_ns + kFrameDelay - 5'000'000);  // 200 Hz
  }
  feed.until(simulation.imu().back().t_ns + 1, receiver);
  REQUIRE(receiver.stamps.size() == simulation.imu().size());
  CHECK(receiver.encoders >= simulation.encoders().size() - 1);  // the last may be later than the last IMU sample
  CHECK(receiver.lasers >= simulation.lasers().size() - 1);
  for (std::size_t i = 0; i < receiver.stamps.size(); ++i) CHECK(receiver.stamps[i] == simulation.imu()[i].t_ns);
}

}  // namespace
}  // namespace ear::experiments
