#include "filter/start/moving_start.h"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "filter/ekf/initial_state.h"
#include "filter/filter.h"
#include "tools/simulator/simulation.h"

using namespace ear;

namespace {

simulator::Simulation fly(double camera_rate_hz, std::uint64_t seed) {
  simulator::Options options;
  options.sequence = "fly1";
  options.seed = seed;
  options.duration = 30.0;
  options.camera_rate_hz = camera_rate_hz;
  return simulator::Simulation(options);
}

/// The frames of two seconds from `from` seconds on; `change` may alter them.
template <typename Change>
std::optional<ImuState> start(const simulator::Simulation& simulation, double from, const Change& change) {
  ImuBuffer imu(4096);
  const TimeNs begin_ns = simulation.imu().front().t_ns + static_cast<TimeNs>(1e9 * from);
  const TimeNs end_ns = begin_ns + 2'000'000'000;
  for (const ImuSample& sample : simulation.imu()) {
    if (sample.t_ns >= begin_ns - 20'000'000 && sample.t_ns <= end_ns + 20'000'000) imu.push(sample);
  }
  MovingStart moving(FilterConfig{}, simulation.calibration());
  const CameraState cameras = camera_state(simulation.calibration());
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    const TimeNs t_ns = simulation.frame_times()[i];
    if (t_ns < begin_ns || t_ns > end_ns) continue;
    FeatureFrame frame = simulation.tracks(i);
    change(frame);
    moving.add(t_ns, frame, imu);
    if (auto state = moving.solve(imu, cameras).x) return state;
  }
  return std::nullopt;
}

const auto kUnchanged = [](FeatureFrame&) {};

}  // namespace

TEST_CASE("moving start: tilt and velocity in flight and on the ground, at any frame rate") {
  for (const double rate : {30.0, 10.0, 5.0}) {
    CAPTURE(rate);
    const simulator::Simulation simulation = fly(rate, 831);
    for (const double from : {4.0, 10.0, 14.0, 18.0}) {
      CAPTURE(from);
      const auto state = start(simulation, from, kUnchanged);
      REQUIRE(state);
      const simulator::Truth truth = simulation.truth(state->t_ns);
      const Eigen::Vector3d up_B = state->R_WB.transpose() * Eigen::Vector3d::UnitZ();
      CHECK(std::acos(std::min(1.0, up_B.dot(truth.R_WB.transpose() * Eigen::Vector3d::UnitZ()))) < 0.1);
      CHECK((state->R_WB.transpose() * state->v_W - truth.R_WB.transpose() * truth.v_W).norm() < 0.3);
      CHECK((state->b_g - truth.b_g).norm() < 0.02);  // the camera is mounted otherwise than told
    }
  }
}

TEST_CASE("moving start: not with swapped cameras, nor with a frozen image") {
  const simulator::Simulation simulation = fly(30.0, 832);
  CHECK_FALSE(start(simulation, 12.0, [](FeatureFrame& frame) {
    for (FeatureObservation& o : frame.features) std::swap(o.left, o.right);
  }));
  FeatureFrame first;
  CHECK_FALSE(start(simulation, 12.0, [&](FeatureFrame& frame) {
    if (first.features.empty()) first = frame;
    frame.features = first.features;
  }));
}

TEST_CASE("moving start: at five frames a second features last for three frames, which is enough by two cameras") {
  const simulator::Simulation simulation = fly(5.0, 833);
  std::uint64_t frames = 0;
  bool one_camera = false;
  const auto short_lived = [&](FeatureFrame& frame) {
    for (FeatureObservation& feature : frame.features) {
      feature.id = 1000 * feature.id + (frames + feature.id) / 3;  // one third of them end with each frame
      if (one_camera) feature.has_right = false;
    }
    ++frames;
  };
  const std::optional<ImuState> state = start(simulation, 12.0, short_lived);
  REQUIRE(state);
  const simulator::Truth truth = simulation.truth(state->t_ns);
  CHECK((state->R_WB.transpose() * state->v_W - truth.R_WB.transpose() * truth.v_W).norm() < 0.3);
  one_camera = true;
  CHECK_FALSE(start(simulation, 12.0, short_lived));
}

TEST_CASE("moving start: until then the turn from frame to frame is a guess, by a gyroscope whose bias is not known") {
  const simulator::Simulation simulation = fly(10.0, 834);
  Filter filter({}, simulation.calibration());
  const TimeNs begin_ns = simulation.imu().front().t_ns + 10'000'000'000;
  auto sample = simulation.imu().begin();
  int guesses = 0, known = 0;
  for (std::size_t i = 0; i < simulation.frame_times().size() && known < 5; ++i) {
    const TimeNs t_ns = simulation.frame_times()[i];
    if (t_ns < begin_ns) continue;
    for (; sample != simulation.imu().end() && sample->t_ns <= t_ns + 10'000'000; ++sample) {
      if (sample->t_ns >= begin_ns - 100'000'000) filter.add_imu(*sample);
    }
    if (const std::optional<RelativeMotion> motion = filter.motion_to(t_ns)) {
      const simulator::Truth before = simulation.truth(simulation.frame_times()[i - 1]), now = simulation.truth(t_ns);
      const Eigen::Matrix3d R_B1B0 = now.R_WB.transpose() * before.R_WB;
      const double off = Eigen::AngleAxisd(motion->R_B1B0 * R_B1B0.transpose()).angle();
      CHECK(off < (motion->rotation_known ? 3e-3 : 0.02));
      (motion->rotation_known ? known : guesses) += 1;
      CHECK(motion->translation_known == motion->rotation_known);
    }
    static_cast<void>(filter.process(simulation.tracks(i)));
  }
  CHECK(guesses >= 10);
  CHECK(known == 5);
}
