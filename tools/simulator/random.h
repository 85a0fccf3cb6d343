// Random streams: one engine per purpose, so that one sensor's draws never shift another's.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace ear::simulator {

using Rng = std::mt19937_64;

/// What a stream of random numbers is for. The numbers are part of every recording: only append.
enum class Stream : std::uint32_t {
  sequence = 0,
  motion = 1,
  imu = 2,
  encoder = 3,
  laser = 4,
  tracks = 5,
  calibration = 6,
  scene = 7,
  exposure = 8,
  pixels = 9,
  laser_faults = 10,
  obstruction = 11,
  faults = 12,
  calibration_errors = 13,
  board = 14
};

[[nodiscard]] inline Rng make_rng(std::uint64_t seed, Stream stream) {
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                         static_cast<std::uint32_t>(stream)};
  return Rng(sequence);
}

[[nodiscard]] inline double normal(Rng& rng, double sigma) {
  return std::normal_distribution<double>(0.0, 1.0)(rng) * sigma;
}

[[nodiscard]] inline double uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

/// Independent components of the same sigma.
[[nodiscard]] inline Eigen::Vector3d normal3(Rng& rng, double sigma) {
  const double x = normal(rng, sigma);
  const double y = normal(rng, sigma);
  const double z = normal(rng, sigma);
  return {x, y, z};
}

/// Uniform on the unit sphere.
[[nodiscard]] inline Eigen::Vector3d random_direction(Rng& rng) { return normal3(rng, 1.0).normalized(); }

}  // namespace ear::simulator
