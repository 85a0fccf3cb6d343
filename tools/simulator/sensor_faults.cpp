#include "tools/simulator/sensor_faults.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

constexpr double kAccelRange = 4.0 * kGravity;  // [m/s^2]
constexpr double kGyroRange = 500.0 * kDegree;  // [rad/s]
constexpr double kSpikesPerSecond = 5.0;
constexpr double kLongSpikesPerSecond = 20.0 / 60.0;
constexpr double kLongSpikeGyro = 0.075;  // [rad/s] per m/s^2 of the accelerometer: 3 rad/s and 40 m/s^2
constexpr double kJoltsPerSecond = 4.0;
// A jolt in three samples: it leaves no velocity behind, but clipping takes more from its peak than from its tail.
constexpr std::array<double, 3> kJolt{1.0, -0.5, -0.5};

constexpr std::size_t kGyro = 0;  // parts of the IMU, in the order of the targets
constexpr std::size_t kAccel = 1;

// The accelerometer's share of a fault whose parameter is that of the gyroscope, per rad/s.
constexpr double kAccelPerGyro = 10.0;  // [m/s^2]

// Samples within a fault's interval, as indices [first, last).
struct Span {
  std::size_t first, last;
};

template <typename Sample>
Span span_of(const std::vector<Sample>& samples, const Fault& fault) {
  const auto first = std::partition_point(samples.begin(), samples.end(), [&fault](const Sample& sample) {
    return !fault.begun(motion_time(sample.t_ns));
  });
  const auto last = std::partition_point(
      first, samples.end(), [&fault](const Sample& sample) { return !fault.over(motion_time(sample.t_ns)); });
  return {static_cast<std::size_t>(first - samples.begin()), static_cast<std::size_t>(last - samples.begin())};
}

double sample_period(const std::vector<ImuSample>& samples) {
  if (samples.size() < 2) return 1.0;
  return seconds_between(samples.front().t_ns, samples.back().t_ns) / static_cast<double>(samples.size() - 1);
}

void add_spikes(std::vector<ImuSample>& samples, const Fault& fault, Rng& rng) {
  const Span span = span_of(samples, fault);
  const double chance = kSpikesPerSecond * sample_period(samples);
  for (std::size_t i = span.first; i < span.last; ++i) {
    const bool spike = uniform(rng, 0.0, 1.0) < chance || i == span.first;
    if (!spike) continue;
    const Eigen::Vector3d accel = uniform(rng, 0.5, 1.0) * fault.parameter * random_direction(rng);
    const Eigen::Vector3d gyro = uniform(rng, 0.5, 1.0) * fault.parameter / kAccelPerGyro * random_direction(rng);
    if (fault.hits(kGyro)) samples[i].gyro_B += gyro;
    if (fault.hits(kAccel)) samples[i].accel_B += accel;
  }
}

// A connector that is loose for some milliseconds: what the sensor measures is shifted by the same in all samples of
// that time, and its noise goes on. (A bus that garbles each transfer for itself makes the single samples above.)
void add_long_spikes(std::vector<ImuSample>& samples, const Fault& fault, Rng& rng) {
  const Span span = span_of(samples, fault);
  const double chance = kLongSpikesPerSecond * sample_period(samples);
  const auto length = static_cast<std::size_t>(fault.length);
  for (std::size_t i = span.first; i + length <= span.last; ++i) {
    const bool spike = uniform(rng, 0.0, 1.0) < chance || i == span.first;
    if (!spike) continue;
    const Eigen::Vector3d accel = normal3(rng, fault.parameter);
    const Eigen::Vector3d gyro = normal3(rng, kLongSpikeGyro * fault.parameter);
    for (std::size_t k = i; k < i + length; ++k) {
      if (fault.hits(kGyro)) samples[k].gyro_B += gyro;
      if (fault.hits(kAccel)) samples[k].accel_B += accel;
    }
    i += length - 1;
  }
}

void add_jolts(std::vector<ImuSample>& samples, const Fault& fault, Rng& rng) {
  const Span span = span_of(samples, fault);
  const double chance = kJoltsPerSecond * sample_period(samples);
  for (std::size_t i = span.first; i + kJolt.size() <= span.last; ++i) {
    const bool jolt = uniform(rng, 0.0, 1.0) < chance || i == span.first;
    if (!jolt) continue;
    const auto gyro_axis = static_cast<Eigen::Index>(uniform(rng, 0.0, 2.999));
    const auto accel_axis = static_cast<Eigen::Index>(uniform(rng, 0.0, 2.999));
    const double gyro = (uniform(rng, 0.0, 1.0) < 0.5 ? -1.0 : 1.0) * fault.parameter * kGyroRange;
    const double accel = (uniform(rng, 0.0, 1.0) < 0.5 ? -1.0 : 1.0) * fault.parameter * kAccelRange;
    for (std::size_t k = 0; k < kJolt.size(); ++k) {
      if (fault.hits(kGyro)) samples[i + k].gyro_B(gyro_axis) += kJolt[k] * gyro;
      if (fault.hits(kAccel)) samples[i + k].accel_B(accel_axis) += kJolt[k] * accel;
    }
    i += kJolt.size() - 1;
  }
}

void clip(std::vector<ImuSample>& samples, const Fault& fault) {
  const Span span = span_of(samples, fault);
  for (std::size_t i = span.first; i < span.last; ++i) {
    if (fault.hits(kGyro)) samples[i].gyro_B = samples[i].gyro_B.cwiseMax(-kGyroRange).cwiseMin(kGyroRange);
    if (fault.hits(kAccel)) samples[i].accel_B = samples[i].accel_B.cwiseMax(-kAccelRange).cwiseMin(kAccelRange);
  }
}

void jump_biases(std::vector<ImuSample>& samples, std::vector<ImuBias>& biases, const Fault& fault, Rng& rng) {
  const Eigen::Vector3d gyro = fault.parameter * random_direction(rng);
  const Eigen::Vector3d accel = kAccelPerGyro * fault.parameter * random_direction(rng);
  const Span span = span_of(samples, fault);
  for (std::size_t i = span.first; i < span.last; ++i) {
    if (fault.hits(kGyro)) {
      samples[i].gyro_B += gyro;
      biases[i].gyro += gyro;
    }
    if (fault.hits(kAccel)) {
      samples[i].accel_B += accel;
      biases[i].accel += accel;
    }
  }
}

// Faults of one kind.
template <typename Apply>
void each(const std::vector<Fault>& faults, FaultKind kind, const Apply& apply) {
  for (const Fault& fault : faults) {
    if (fault.kind == kind) apply(fault);
  }
}

void hold_range(std::vector<LaserSample>& samples, const Fault& fault, std::size_t beam) {
  const Span span = span_of(samples, fault);
  double held = std::nan("");
  for (std::size_t i = 0; i < span.first; ++i) {
    if (std::isfinite(samples[i].range[beam])) held = samples[i].range[beam];
  }
  for (std::size_t i = span.first; i < span.last; ++i) samples[i].range[beam] = held;
}

void shift_range(std::vector<LaserSample>& samples, const LaserCalibration& lasers, const Fault& fault,
                 std::size_t beam) {
  const Span span = span_of(samples, fault);
  for (std::size_t i = span.first; i < span.last; ++i) {
    double& range = samples[i].range[beam];
    range += fault.parameter;
    if (!(range >= lasers.range_min && range <= lasers.range_max)) range = std::nan("");
  }
}

}  // namespace

void fault_imu(std::vector<ImuSample>& samples, std::vector<ImuBias>& biases, const std::vector<Fault>& faults,
               std::uint64_t seed) {
  each(faults, FaultKind::imu_bias_jump, [&](const Fault& fault) {
    Rng rng = fault_rng(fault, seed);
    jump_biases(samples, biases, fault, rng);
  });
  each(faults, FaultKind::imu_spikes, [&](const Fault& fault) {
    Rng rng = fault_rng(fault, seed);
    if (fault.length > 0) {
      add_long_spikes(samples, fault, rng);
    } else {
      add_spikes(samples, fault, rng);
    }
  });
  each(faults, FaultKind::imu_saturated, [&](const Fault& fault) {
    Rng rng = fault_rng(fault, seed);
    add_jolts(samples, fault, rng);
    clip(samples, fault);
  });
  each(faults, FaultKind::hard_landing, [&](const Fault& fault) { clip(samples, fault); });
  each(faults, FaultKind::imu_gap, [&](const Fault& fault) {
    const Span span = span_of(samples, fault);
    samples.erase(samples.begin() + static_cast<std::ptrdiff_t>(span.first),
                  samples.begin() + static_cast<std::ptrdiff_t>(span.last));
  });
}

void fault_encoders(std::vector<EncoderSample>& samples, const EncoderCalibration& encoder, const WheelFaults& wheels,
                    const std::vector<Fault>& faults) {
  const auto add = [&encoder](std::int64_t& count, double angle) {
    count += std::llround(angle / (2.0 * kPi) * static_cast<double>(encoder.resolution));
    if (encoder.wraps) count = ((count % encoder.resolution) + encoder.resolution) % encoder.resolution;
  };
  for (EncoderSample& sample : samples) {
    const std::array<double, 2> angles = wheels.angles(motion_time(sample.t_ns));
    add(sample.left_count, angles[0]);
    add(sample.right_count, angles[1]);
  }
  each(faults, FaultKind::encoder_frozen, [&](const Fault& fault) {
    const Span span = span_of(samples, fault);
    if (span.first == span.last) return;
    const EncoderSample held = samples[span.first == 0 ? 0 : span.first - 1];
    for (std::size_t i = span.first; i < span.last; ++i) {
      if (fault.hits(0)) samples[i].left_count = held.left_count;
      if (fault.hits(1)) samples[i].right_count = held.right_count;
    }
  });
}

void fault_lasers(std::vector<LaserSample>& samples, const LaserCalibration& lasers, const std::vector<Fault>& faults) {
  const auto each_beam = [&](FaultKind kind, const auto& apply) {
    each(faults, kind, [&](const Fault& fault) {
      for (std::size_t beam = 0; beam < lasers.beams.size(); ++beam) {
        if (fault.hits(beam)) apply(fault, beam);
      }
    });
  };
  each_beam(FaultKind::laser_biased,
            [&](const Fault& fault, std::size_t beam) { shift_range(samples, lasers, fault, beam); });
  each_beam(FaultKind::laser_stuck, [&](const Fault& fault, std::size_t beam) { hold_range(samples, fault, beam); });
  each_beam(FaultKind::laser_no_return, [&](const Fault& fault, std::size_t beam) {
    const Span span = span_of(samples, fault);
    for (std::size_t i = span.first; i < span.last; ++i) samples[i].range[beam] = std::nan("");
  });
}

TimeNs clock_error(const std::vector<Fault>& faults, SensorStream stream, TimeNs t_ns) {
  TimeNs error = 0;
  each(faults, FaultKind::clock_jump, [&](const Fault& fault) {
    if (fault.hits(static_cast<std::size_t>(stream)) && fault.active(motion_time(t_ns))) {
      error += std::llround(1e9 * fault.parameter);
    }
  });
  return error;
}

}  // namespace ear::simulator
