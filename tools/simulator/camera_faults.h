// Faults between the light and the estimator: what a camera shows instead of what it should, and which frames arrive
// when. The same for pictures and for feature tracks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ear/types.h"
#include "tools/simulator/faults.h"

namespace ear::simulator {

/// So much after the middle of its exposure a frame is there, if it is not late: exposed, read out, tracked [ns].
inline constexpr TimeNs kFrameDelay = 10'000'000;

/// One stereo frame as it is delivered.
struct Frame {
  TimeNs t_ns = 0;           ///< its stamp
  TimeNs taken_ns = 0;       ///< the middle of its exposure: the same, unless the camera's clock jumps
  TimeNs arrival_ns = 0;     ///< when it reaches the estimator, in true time
  std::size_t exposure = 0;  ///< counts all frames, also those that do not arrive
};

/// The frames that arrive, in the order of their arrival, of those exposed at these times. A late frame holds up those
/// behind it: none overtakes.
[[nodiscard]] std::vector<Frame> deliver(const std::vector<TimeNs>& exposures, const std::vector<Fault>& faults,
                                         std::uint64_t seed);

/// One exposure of one camera (0 left, 1 right).
struct Shot {
  std::size_t exposure = 0;
  std::size_t camera = 0;
};

/// What is shown as the given shot: another one, if the image is frozen or left and right are swapped.
[[nodiscard]] Shot shown(const std::vector<TimeNs>& exposures, const std::vector<Fault>& faults, const Shot& shot);

/// What reaches a camera's sensor of the light that should.
struct Light {
  double gain = 1.0;
  bool covered = false;
};

[[nodiscard]] Light light_at(const std::vector<Fault>& faults, std::size_t camera, double t);

/// Whether recordings with and without this fault differ in their pictures, or in which there are.
[[nodiscard]] bool changes_pictures(const Fault& fault);

}  // namespace ear::simulator
