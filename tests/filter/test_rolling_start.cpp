#include "filter/start/rolling_start.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "filter/sources/wheels/reading_noise.h"
#include "tools/simulator/simulation.h"

using namespace ear;

namespace {

const StartFit::Vector kPrior = start_sigma(PriorConfig{}, Calibration{});

/// Two seconds of a simulated drive, from `from` seconds on.
struct Window {
  ImuBuffer imu{4096};
  Ring<WheelIncrement> turns{512};
  OdometerState odometer;
  TimeNs start_ns = 0;
  TimeNs end_ns = 0;

  /// Every n-th reading of the encoders, whose stamps are off by up to `jitter` [s].
  Window(const simulator::Simulation& simulation, double from, std::size_t every = 1, double jitter = 0.0) {
    const TimeNs begin_ns = simulation.imu().front().t_ns + static_cast<TimeNs>(1e9 * from);
    end_ns = begin_ns + 2'000'000'000;
    std::mt19937_64 rng(17);
    std::uniform_real_distribution<double> off(-jitter, jitter);
    for (const ImuSample& sample : simulation.imu()) {
      if (sample.t_ns >= begin_ns - 20'000'000 && sample.t_ns <= end_ns) imu.push(sample);
    }
    const EncoderCalibration& axle = *simulation.calibration().encoder;
    EncoderReader reader(axle);
    for (std::size_t i = 0; i < simulation.encoders().size(); i += every) {
      EncoderSample sample = simulation.encoders()[i];
      sample.t_ns += static_cast<TimeNs>(1e9 * off(rng));
      const auto turn = reader.add(sample);
      if (turn && turn->from_ns >= begin_ns && turn->to_ns <= end_ns) turns.push(*turn);
    }
    odometer.wheel_radius << axle.wheel_radius[0], axle.wheel_radius[1];
    odometer.T_BO = {axle.T_BO.linear(), axle.T_BO.translation()};
    start_ns = turns.front().from_ns;
  }
};

simulator::Simulation drive(const char* sequence, std::uint64_t seed) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.duration = 30.0;
  options.tracks = false;
  return simulator::Simulation(options);
}

}  // namespace

TEST_CASE("rolling start: tilt, speed and direction of a vehicle that drives") {
  for (const char* sequence : {"flat1", "wave1", "slope"}) {
    CAPTURE(sequence);
    for (const double from : {7.0, 13.0, 19.0}) {
      CAPTURE(from);
      const simulator::Simulation simulation = drive(sequence, 821);
      const Window window(simulation, from);
      CHECK(lacking_for_rolling_start(window.imu, window.turns, window.end_ns, 1.5) == Reason::none);
      const auto state = rolling_start(window.imu, window.turns, window.odometer, kPrior, 0.0, 0.0).x;
      REQUIRE(state);
      CHECK(state->t_ns == window.start_ns);
      const simulator::Truth truth = simulation.truth(state->t_ns);
      const Eigen::Vector3d up_B = state->R_WB.transpose() * Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d true_up_B = truth.R_WB.transpose() * Eigen::Vector3d::UnitZ();
      CHECK(std::acos(std::min(1.0, up_B.dot(true_up_B))) < 0.1);  // a point to linearize at
      const Eigen::Vector3d v_B = state->R_WB.transpose() * state->v_W;
      CHECK((v_B - truth.R_WB.transpose() * truth.v_W).norm() < 0.5);  // the body leans against the hill
    }
  }
}

TEST_CASE("rolling start: encoders at 50, 10 and 5 Hz, and at 10 Hz with stamps that are off by 20 ms") {
  const simulator::Simulation simulation = drive("flat1", 823);
  struct Rate {
    std::size_t every;
    double jitter;
  };
  for (const Rate& rate : {Rate{2, 0.0}, Rate{10, 0.0}, Rate{20, 0.0}, Rate{10, 0.02}}) {
    CAPTURE(rate.every);
    CAPTURE(rate.jitter);
    for (const double from : {7.0, 13.0, 19.0}) {
      CAPTURE(from);
      const Window window(simulation, from, rate.every, rate.jitter);
      CHECK(lacking_for_rolling_start(window.imu, window.turns, window.end_ns, 1.5) == Reason::none);
      const auto state =
          rolling_start(window.imu, window.turns, window.odometer, kPrior, rate.jitter / std::sqrt(3.0), 0.0).x;
      REQUIRE(state);
      const simulator::Truth truth = simulation.truth(state->t_ns);
      CHECK((state->R_WB.transpose() * Eigen::Vector3d::UnitZ() - truth.R_WB.transpose() * Eigen::Vector3d::UnitZ())
                .norm() < 0.1);
      CHECK((state->R_WB.transpose() * state->v_W - truth.R_WB.transpose() * truth.v_W).norm() < 0.2);
    }
  }
}

TEST_CASE("rolling start: stamps that scatter by more than is stated") {
  const simulator::Simulation simulation = drive("flat1", 824);
  for (const std::size_t every : {std::size_t{1}, std::size_t{4}}) {  // at 100 and at 25 Hz
    CAPTURE(every);
    for (const double from : {7.0, 13.0, 19.0}) {
      CAPTURE(from);
      const Window window(simulation, from, every, 0.0045);
      if (every == 1) CHECK_FALSE(rolling_start(window.imu, window.turns, window.odometer, kPrior, 0.0, 0.0).x);
      ReadingNoise readings;
      for (std::size_t i = 0; i < window.turns.size(); ++i) {
        const WheelIncrement& turn = window.turns[i];
        readings.add(window.odometer.wheel_radius.dot(turn.angle) / (2.0 * turn.duration()), turn);
      }
      const auto state =
          rolling_start(window.imu, window.turns, window.odometer, kPrior, 0.0, readings.of_increment()).x;
      REQUIRE(state);
      const simulator::Truth truth = simulation.truth(state->t_ns);
      CHECK((state->R_WB.transpose() * state->v_W - truth.R_WB.transpose() * truth.v_W).norm() < 0.2);
    }
  }
}

TEST_CASE("rolling start: what the readings lack") {
  const simulator::Simulation simulation = drive("flat1", 822);
  const Window window(simulation, 8.0);
  const TimeNs now_ns = window.end_ns;
  CHECK(lacking_for_rolling_start(window.imu, window.turns, now_ns, 2.5) == Reason::few_readings);
  CHECK(lacking_for_rolling_start(ImuBuffer(8), window.turns, now_ns, 1.5) == Reason::few_samples);
  CHECK(lacking_for_rolling_start(window.imu, Ring<WheelIncrement>(8), now_ns, 1.5) == Reason::wheel_gaps);
  CHECK(lacking_for_rolling_start(window.imu, window.turns, now_ns + 1'000'000'000, 1.5) == Reason::wheel_gaps);

  Ring<WheelIncrement> with_gap(512);
  for (std::size_t i = 0; i < window.turns.size(); ++i) {
    if (i != 50) with_gap.push(window.turns[i]);
  }
  CHECK(lacking_for_rolling_start(window.imu, with_gap, now_ns, 1.5) == Reason::wheel_gaps);
}

TEST_CASE("rolling start: not in the air or on slipping wheels") {
  const simulator::Simulation simulation = drive("flat1", 822);
  const Window window(simulation, 8.0);
  Ring<WheelIncrement> contradicting(512);  // wheels that race, at accelerations that the accelerometer does not see
  for (std::size_t i = 0; i < window.turns.size(); ++i) {
    WheelIncrement turn = window.turns[i];
    turn.angle *= 1.0 + 2.0 * std::sin(0.3 * static_cast<double>(i));
    contradicting.push(turn);
  }
  CHECK_FALSE(rolling_start(window.imu, contradicting, window.odometer, kPrior, 0.0, 0.0).x);
}
