// The moments of an estimate that a reader looks for first: take-off, landing, faults, losses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

enum class MomentKind : std::uint8_t { lost, found, fault, landing, strike, take_off, end };

struct Moment {
  TimeNs t_ns = 0;
  MomentKind kind = MomentKind::end;
  std::string words;   ///< what happened
  std::string jpeg{};  ///< what the left camera saw then; empty: nobody knows
};

/// By what the estimate says about itself, in the order of time: its first and last pose, where it leaves the ground
/// and comes back, where its health or the sensor that it takes for the one at fault becomes another, and where there
/// is no estimate for half a second. What recurs within five seconds is there once. An estimate that says nothing about
/// itself has losses and ends alone.
[[nodiscard]] std::vector<Moment> moments_of(const Estimate& estimate);

/// At most so many: losses before faults, these before landings, and so on.
[[nodiscard]] std::vector<Moment> foremost(std::vector<Moment> moments, std::size_t most);

}  // namespace ear::evaluation
