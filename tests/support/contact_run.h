// The contact detector over a whole simulated sequence, and how its events compare with the truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "filter/sources/ground/contact.h"
#include "tools/simulator/simulation.h"

namespace ear::test {

struct ContactRun {
  std::vector<double> takeoff_height;   ///< wheels above the ground when a take-off was noticed [m]
  std::vector<double> takeoff_delay;    ///< after the wheels were 1 cm above it [s]
  std::vector<double> touchdown_delay;  ///< after the wheels struck the ground [s]
  int wrong = 0;                        ///< events that were none
  int missed = 0;
  double hours = 0.0;

  void add(const ContactRun& run) {
    const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(takeoff_height, run.takeoff_height);
    append(takeoff_delay, run.takeoff_delay);
    append(touchdown_delay, run.touchdown_delay);
    wrong += run.wrong;
    missed += run.missed;
    hours += run.hours;
  }
};

[[nodiscard]] inline double worst(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

/// Height of the axle's middle above where it rests on level ground [m].
[[nodiscard]] inline double wheel_height(const simulator::Simulation& simulation, TimeNs t_ns) {
  const simulator::Truth truth = simulation.truth(t_ns);
  const EncoderCalibration& axle = *simulation.true_calibration().encoder;
  const Eigen::Vector3d p_WO = truth.p_WB + truth.R_WB * axle.T_BO.translation();
  return p_WO.z() - simulation.scene().terrain.height(p_WO.x(), p_WO.y()) - axle.wheel_radius[0];
}

struct ContactTruth {
  std::vector<double> lift_offs;  ///< wheels 1 cm above the ground, times of the motion [s]
  std::vector<double> touchdowns;
};

[[nodiscard]] inline ContactTruth contact_truth(const simulator::Simulation& simulation) {
  ContactTruth truth;
  truth.touchdowns = simulation.plan().touchdowns;
  bool lifted = false;
  for (const ImuSample& sample : simulation.imu()) {
    const bool in_air = simulation.truth(sample.t_ns).mode == simulator::Mode::air;
    const bool up = in_air && (lifted || wheel_height(simulation, sample.t_ns) > 0.01);
    if (up && !lifted) truth.lift_offs.push_back(simulator::motion_time(sample.t_ns));
    lifted = up;
  }
  return truth;
}

/// Feeds all samples in time order.
[[nodiscard]] inline ContactRun run_contact(const simulator::Simulation& simulation) {
  constexpr TimeNs kEnd = std::numeric_limits<TimeNs>::max();
  struct Event {
    ContactEvent what;
    TimeNs t_ns;
  };
  std::vector<Event> events;
  ContactDetector detector(FilterConfig{}, simulation.calibration());
  EncoderReader reader(*simulation.calibration().encoder);
  std::size_t imu = 0, encoder = 0, laser = 0;
  const auto next = [](const auto& samples, std::size_t i) { return i < samples.size() ? samples[i].t_ns : kEnd; };
  while (imu < simulation.imu().size()) {
    const TimeNs imu_ns = next(simulation.imu(), imu);
    const TimeNs encoder_ns = next(simulation.encoders(), encoder);
    const TimeNs laser_ns = next(simulation.lasers(), laser);
    const TimeNs t_ns = std::min({imu_ns, encoder_ns, laser_ns});
    ContactEvent event = ContactEvent::none;
    if (laser_ns == t_ns) {
      event = detector.add_laser(simulation.lasers()[laser++]);
    } else if (encoder_ns == t_ns) {
      if (const auto increment = reader.add(simulation.encoders()[encoder++])) event = detector.add_wheels(*increment);
    } else {
      event = detector.add_imu(simulation.imu()[imu++]);
    }
    if (event != ContactEvent::none) events.push_back({event, t_ns});
  }

  ContactRun run;
  run.hours = seconds_between(simulation.imu().front().t_ns, simulation.imu().back().t_ns) / 3600.0;
  // An event belongs to the true one that it follows within a second; up to 0.1 s earlier it has foreseen it.
  const auto match = [&](double t, ContactEvent what) {
    const auto found = std::find_if(events.begin(), events.end(), [&](const Event& e) {
      const double delay = simulator::motion_time(e.t_ns) - t;
      return e.what == what && delay > -0.1 && delay < 1.0;
    });
    if (found == events.end()) {
      ++run.missed;
      return;
    }
    const double delay = simulator::motion_time(found->t_ns) - t;
    if (what == ContactEvent::takeoff) run.takeoff_height.push_back(wheel_height(simulation, found->t_ns));
    (what == ContactEvent::takeoff ? run.takeoff_delay : run.touchdown_delay).push_back(delay);
    events.erase(found);
  };
  const ContactTruth truth = contact_truth(simulation);
  for (const double t : truth.lift_offs) match(t, ContactEvent::takeoff);
  for (const double t : truth.touchdowns) match(t, ContactEvent::touchdown);
  run.wrong = static_cast<int>(events.size());
  return run;
}

[[nodiscard]] inline simulator::Simulation simulate_sensors(const std::string& sequence, std::uint64_t seed,
                                                            const std::vector<simulator::Fault>& faults = {}) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.tracks = false;
  options.faults = faults;
  return simulator::Simulation(options);
}

}  // namespace ear::test
