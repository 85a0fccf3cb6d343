#include "tools/simulator/sensors.h"

#include <array>
#include <cmath>

#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

constexpr double kInitialGyroBias = 3e-3;  // [rad/s] per axis

// Gauss-Legendre, three points on [0, 1]: exact for polynomials of degree 5.
constexpr std::array<double, 3> kNodes{0.11270166537925831, 0.5, 0.88729833462074169};
constexpr std::array<double, 3> kWeights{5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};

}  // namespace

std::vector<TimeNs> regular_stamps(double rate_hz, double phase, double duration) {
  std::vector<TimeNs> stamps;
  for (std::size_t i = 0;; ++i) {
    const double t = phase + static_cast<double>(i) / rate_hz;
    if (t > duration + 1e-9) return stamps;
    stamps.push_back(kStart + std::llround(1e9 * t));
  }
}

std::vector<ImuBias> draw_imu_biases(const ImuCalibration& imu, std::size_t count, Rng& rng) {
  const double root_dt = std::sqrt(1.0 / imu.rate_hz);
  ImuBias bias{normal3(rng, kInitialGyroBias), normal3(rng, kInitialAccelBias)};
  std::vector<ImuBias> biases;
  for (std::size_t i = 0; i < count; ++i) {
    biases.push_back(bias);
    bias.gyro += normal3(rng, imu.gyro_random_walk * root_dt);
    bias.accel += normal3(rng, imu.accel_random_walk * root_dt);
  }
  return biases;
}

std::vector<ImuSample> ideal_imu(const Trajectory& trajectory, const std::vector<TimeNs>& stamps, double rate_hz) {
  const Eigen::Vector3d gravity_W(0.0, 0.0, -kGravity);
  const double interval = 1.0 / rate_hz;
  const int pieces = std::max(1, static_cast<int>(std::lround(interval / trajectory.period())));
  const double piece = interval / pieces;
  std::vector<ImuSample> samples;
  samples.reserve(stamps.size());
  for (const TimeNs t_ns : stamps) {
    ImuSample sample{t_ns, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    const double begin = motion_time(t_ns) - 0.5 * interval;
    for (int i = 0; i < pieces; ++i) {
      for (std::size_t node = 0; node < kNodes.size(); ++node) {
        const Kinematics motion = trajectory.at(begin + piece * (i + kNodes[node]));
        sample.gyro_B += kWeights[node] / pieces * motion.omega_B;
        sample.accel_B += kWeights[node] / pieces * (motion.R_WB.transpose() * (motion.a_W - gravity_W));
      }
    }
    samples.push_back(sample);
  }
  return samples;
}

void corrupt_imu(std::vector<ImuSample>& samples, const ImuCalibration& imu, const std::vector<ImuBias>& biases,
                 Rng& rng) {
  const double root_rate = std::sqrt(imu.rate_hz);
  const Eigen::Matrix3d measured = imu.gyro_matrix.inverse();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].gyro_B = (measured * samples[i].gyro_B).eval();
    samples[i].gyro_B += biases[i].gyro + normal3(rng, imu.gyro_noise * root_rate);
    samples[i].accel_B += biases[i].accel + normal3(rng, imu.accel_noise * root_rate);
  }
}

std::vector<EncoderSample> read_encoders(const WheelMotion& wheels, const EncoderCalibration& encoder,
                                         const std::vector<TimeNs>& stamps, Rng& rng) {
  const auto resolution = static_cast<double>(encoder.resolution);
  const double counts_per_radian = resolution / (2.0 * kPi);
  const std::array<double, 2> start{uniform(rng, 0.0, resolution), uniform(rng, 0.0, resolution)};
  const auto read = [&](double angle, double offset) {
    const double count = offset + angle * counts_per_radian + normal(rng, encoder.noise_counts);
    const std::int64_t rounded = std::llround(count);
    if (!encoder.wraps) return rounded;
    const std::int64_t wrapped = rounded % encoder.resolution;
    return wrapped < 0 ? wrapped + encoder.resolution : wrapped;
  };
  std::vector<EncoderSample> samples;
  samples.reserve(stamps.size());
  for (const TimeNs t_ns : stamps) {
    const std::array<double, 2> angle = wheels.angles(motion_time(t_ns));
    const std::int64_t left = read(angle[0], start[0]);
    const std::int64_t right = read(angle[1], start[1]);
    samples.push_back({t_ns, left, right});
  }
  return samples;
}

std::vector<LaserSample> read_lasers(const Trajectory& trajectory, const Terrain& terrain,
                                     const LaserCalibration& lasers, const std::vector<TimeNs>& stamps, Rng& rng) {
  std::vector<LaserSample> samples;
  samples.reserve(stamps.size());
  for (const TimeNs t_ns : stamps) {
    const Kinematics motion = trajectory.at(motion_time(t_ns));
    LaserSample sample{t_ns, {}};
    for (const LaserBeam& beam : lasers.beams) {
      const Eigen::Vector3d origin_W = motion.p_WB + motion.R_WB * beam.p_BL;
      const auto hit = terrain.cast(origin_W, motion.R_WB * beam.d_B, lasers.range_max + 1.0);
      const double noise = normal(rng, lasers.noise);  // drawn for every beam: a lost return shifts no other draw
      const double range = hit ? *hit + noise : std::nan("");
      const bool seen = range >= lasers.range_min && range <= lasers.range_max;
      sample.range.push_back(seen ? range : std::nan(""));
    }
    samples.push_back(std::move(sample));
  }
  return samples;
}

void corrupt_lasers(std::vector<LaserSample>& samples, const LaserCalibration& lasers, const LaserFaults& faults,
                    Rng& rng) {
  if (faults.lost == 0.0 && faults.wrong == 0.0 && faults.fades == 0.0) return;
  std::vector<TimeNs> faded_until(lasers.beams.size(), 0);
  for (LaserSample& sample : samples) {
    for (std::size_t beam = 0; beam < sample.range.size(); ++beam) {
      double& range = sample.range[beam];
      if (uniform(rng, 0.0, 1.0) < faults.fades / lasers.rate_hz) {
        faded_until[beam] = sample.t_ns + std::llround(1e9 * uniform(rng, 0.2, 1.0));
      }
      if (uniform(rng, 0.0, 1.0) < faults.wrong) {
        // Mostly something above the ground; one in four goes past an edge, or returns by a detour.
        const bool nearer = uniform(rng, 0.0, 1.0) < 0.75;
        range = nearer ? range * uniform(rng, 0.3, 0.85) : range + uniform(rng, 0.05, 0.5);
      }
      const bool lost = uniform(rng, 0.0, 1.0) < faults.lost || sample.t_ns < faded_until[beam];
      if (lost || !(range >= lasers.range_min && range <= lasers.range_max)) range = std::nan("");
    }
  }
}

}  // namespace ear::simulator
