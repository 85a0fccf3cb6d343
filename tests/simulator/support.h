// What the simulator's tests share.
#pragma once

#include <cstdint>
#include <string>

#include "tools/simulator/simulation.h"

namespace ear::simulator {

/// A simulation whose sensors make no errors, without feature tracks.
inline Options ideal(const std::string& sequence, std::uint64_t seed) {
  Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.sensor_noise = false;
  options.tracks = false;
  return options;
}

}  // namespace ear::simulator
