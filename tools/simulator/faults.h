// What goes wrong, by name, from when to when: faults that are laid over the clean data of a simulation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/simulator/random.h"

namespace ear::simulator {

enum class FaultKind {
  encoder_frozen,
  wheel_slipping,
  wheel_idle_spin,
  wheel_lifted,
  laser_stuck,
  laser_biased,
  laser_no_return,
  people,
  camera_covered,
  camera_dark,
  camera_overexposed,
  camera_frozen,
  camera_swapped,
  camera_dropped,
  camera_late,
  hard_landing,
  imu_spikes,
  imu_saturated,
  imu_bias_jump,
  imu_gap,
  clock_jump
};

/// One fault. Times are those of the motion: a stamp less the 1.6e9 s at which it begins.
struct Fault {
  FaultKind kind = FaultKind::encoder_frozen;
  std::size_t target = 0;  ///< what it hits: index into FaultType::targets
  double start = 0.0;      ///< [s]
  double duration = 5.0;   ///< [s]
  double parameter = 0.0;  ///< how much; its meaning and unit: FaultType::parameter
  int length = 0;          ///< of each spike [samples]; 0 if none is given: FaultType::length

  [[nodiscard]] double end() const { return start + duration; }
  // Stamps are whole nanoseconds: half of one decides on which side of a limit they are.
  [[nodiscard]] bool begun(double t) const { return t > start - 0.5e-9; }
  [[nodiscard]] bool over(double t) const { return t > end() - 0.5e-9; }
  [[nodiscard]] bool active(double t) const { return begun(t) && !over(t); }
  /// Whether it hits one of several: a wheel, a beam, a camera. The first target is all of them.
  [[nodiscard]] bool hits(std::size_t part) const { return target == 0 || target == part + 1; }
};

/// What there is to know about the faults of one kind.
struct FaultType {
  struct Parameter {
    const char* meaning;  ///< with its unit
    double usual, lowest, highest;
  };
  /// Kinds that are another fault when a length is given.
  struct Length {
    const char* summary;
    int highest;          ///< [samples], the lowest is 1
    Parameter parameter;  ///< in place of the usual one
  };
  FaultKind kind;
  const char* name;
  const char* summary;
  std::vector<std::string> targets;  ///< the first is all of them; none where there is nothing to choose
  std::size_t usual_target = 0;
  double usual_duration = 5.0;  ///< [s]
  std::optional<Parameter> parameter = std::nullopt;
  std::optional<Length> length = std::nullopt;
};

/// All kinds, as they are listed for people.
[[nodiscard]] std::vector<FaultType> fault_types();
[[nodiscard]] FaultType type_of(FaultKind kind);

/// Reads NAME[.TARGET][:LENGTH]@START[+DURATION][=PARAMETER], such as `laser_biased.rear@20+5=0.1`; what is left out is
/// as usual. Throws std::invalid_argument, with the text and what is wrong with it.
[[nodiscard]] Fault parse_fault(const std::string& text);

/// The same, with nothing left out.
[[nodiscard]] std::string to_string(const Fault& fault);

/// Throws std::invalid_argument for times or a parameter that cannot be.
void require_valid(const Fault& fault);

/// How faults are written, and one line for each kind.
[[nodiscard]] std::string fault_help();

/// The random numbers of one fault: they depend on no other fault.
[[nodiscard]] Rng fault_rng(const Fault& fault, std::uint64_t seed);

}  // namespace ear::simulator
