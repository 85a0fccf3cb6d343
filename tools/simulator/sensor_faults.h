// Faults of IMU, encoders, lasers and clocks, laid over clean samples: outside of its interval a fault changes nothing.
#pragma once

#include <cstdint>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/sensors.h"
#include "tools/simulator/wheel_faults.h"

namespace ear::simulator {

/// Spikes, saturation, a jump of the biases (which `biases`, one per sample, follow), a gap.
void fault_imu(std::vector<ImuSample>& samples, std::vector<ImuBias>& biases, const std::vector<Fault>& faults,
               std::uint64_t seed);

/// Wheels that turn otherwise, and frozen counts. After the fault the counts differ by a constant (modulo the
/// resolution) from those without it: encoders count on.
void fault_encoders(std::vector<EncoderSample>& samples, const EncoderCalibration& encoder, const WheelFaults& wheels,
                    const std::vector<Fault>& faults);

/// Beams that stick, are biased, or give nothing.
void fault_lasers(std::vector<LaserSample>& samples, const LaserCalibration& lasers, const std::vector<Fault>& faults);

/// The streams of samples, each with a clock that may jump: FaultType::targets of clock_jump without the first.
enum class SensorStream { imu, encoder, laser, camera };

/// What jumping clocks add to a stamp [ns].
[[nodiscard]] TimeNs clock_error(const std::vector<Fault>& faults, SensorStream stream, TimeNs t_ns);

/// Stamps by the jumping clocks; the order of the samples stays.
template <typename Sample>
void fault_clock(std::vector<Sample>& samples, const std::vector<Fault>& faults, SensorStream stream) {
  for (Sample& sample : samples) sample.t_ns += clock_error(faults, stream, sample.t_ns);
}

}  // namespace ear::simulator
