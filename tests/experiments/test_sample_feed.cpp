#include <doctest/doctest.h>

#include <vector>

#include "tools/experiments/sample_feed.h"

namespace ear::experiments {
namespace {

/// Notes what it is given.
struct Receiver {
  std::vector<TimeNs> imu, encoders, lasers;
  void add_imu(const ImuSample& sample) { imu.push_back(sample.t_ns); }
  void add_encoder(const EncoderSample& sample) { encoders.push_back(sample.t_ns); }
  void add_laser(const LaserSample& sample) { lasers.push_back(sample.t_ns); }
};

/// Whether these are the stamps of all samples, in the simulation's order.
template <typename Sample>
void check_complete(const std::vector<TimeNs>& stamps, const std::vector<Sample>& samples) {
  REQUIRE(stamps.size() == samples.size());
  for (std::size_t i = 0; i < stamps.size(); ++i) CHECK(stamps[i] == samples[i].t_ns);
}

TEST_CASE("sample feed: every sample once, in time order, and none that is later than the frame's arrival") {
  simulator::Options options;
  options.duration = 2.0;
  options.tracks = false;
  const simulator::Simulation simulation(options);
  Receiver receiver;
  SampleFeed feed(simulation);
  for (const TimeNs t_ns : simulation.frame_times()) {
    feed.until_frame(t_ns, receiver);
    REQUIRE(!receiver.imu.empty());
    CHECK(receiver.imu.back() < t_ns + simulator::kFrameDelay);
    CHECK(receiver.imu.back() >= t_ns + simulator::kFrameDelay - 5'000'000);  // 200 Hz
    if (!receiver.encoders.empty()) CHECK(receiver.encoders.back() < t_ns + simulator::kFrameDelay);
    if (!receiver.lasers.empty()) CHECK(receiver.lasers.back() < t_ns + simulator::kFrameDelay);
  }
  feed.until(simulation.imu().back().t_ns + simulator::kFrameDelay, receiver);
  check_complete(receiver.imu, simulation.imu());
  check_complete(receiver.encoders, simulation.encoders());
  check_complete(receiver.lasers, simulation.lasers());
}

TEST_CASE(
    "sample feed: clocks that jump change stamps, not the order of arrival; a late frame comes after more samples") {
  simulator::Options options;
  options.duration = 3.0;
  options.tracks = false;
  const simulator::Simulation clean(options);
  options.faults = {simulator::parse_fault("clock_jump.all@1+1=-0.5"), simulator::parse_fault("camera_late@1+1=0.2")};
  const simulator::Simulation faulty(options);
  const auto count_until = [](const simulator::Simulation& simulation, std::size_t frame) {
    Receiver receiver;
    SampleFeed feed(simulation);
    feed.until(simulation.frames()[frame].arrival_ns, receiver);
    return receiver.imu.size();
  };
  CHECK(count_until(faulty, 20) == count_until(clean, 20));
  CHECK(count_until(faulty, 45) == count_until(clean, 45) + 40);  // 0.2 s at 200 Hz
}

}  // namespace
}  // namespace ear::experiments
