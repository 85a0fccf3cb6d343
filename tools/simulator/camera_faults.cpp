#include "tools/simulator/camera_faults.h"

#include <algorithm>
#include <cmath>

#include "tools/simulator/sensor_faults.h"
#include "tools/simulator/sensors.h"

namespace ear::simulator {
std::vector<Frame> deliver(const std::vector<TimeNs>& exposures, const std::vector<Fault>& faults, std::uint64_t seed) {
  std::vector<char> dropped(exposures.size(), 0);
  std::vector<TimeNs> delay(exposures.size(), kFrameDelay);
  for (const Fault& fault : faults) {
    Rng rng = fault_rng(fault, seed);
    bool first = true;
    for (std::size_t i = 0; i < exposures.size(); ++i) {
      if (!fault.active(motion_time(exposures[i]))) continue;
      if (fault.kind == FaultKind::camera_late) delay[i] += std::llround(1e9 * fault.parameter);
      if (fault.kind == FaultKind::camera_dropped) {
        const bool lost = uniform(rng, 0.0, 1.0) < fault.parameter || first;
        dropped[i] = static_cast<char>(dropped[i] != 0 || lost);
        first = false;
      }
    }
  }
  std::vector<Frame> frames;
  TimeNs busy_until = 0;
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    if (dropped[i] != 0) continue;
    const TimeNs stamp = exposures[i] + clock_error(faults, SensorStream::camera, exposures[i]);
    busy_until = std::max(busy_until, exposures[i] + delay[i]);
    frames.push_back({stamp, exposures[i], busy_until, i});
  }
  return frames;
}

Shot shown(const std::vector<TimeNs>& exposures, const std::vector<Fault>& faults, const Shot& shot) {
  Shot source = shot;
  const double t = motion_time(exposures.at(shot.exposure));
  for (const Fault& fault : faults) {
    if (fault.kind == FaultKind::camera_swapped && fault.active(t)) source.camera = 1 - source.camera;
  }
  for (const Fault& fault : faults) {
    if (fault.kind != FaultKind::camera_frozen || !fault.active(t) || !fault.hits(source.camera)) continue;
    // The last exposure before the fault; the first of all, if it is frozen from the beginning.
    const auto begun = std::partition_point(exposures.begin(), exposures.end(),
                                            [&fault](TimeNs taken_ns) { return !fault.begun(motion_time(taken_ns)); });
    const auto before = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, begun - exposures.begin() - 1));
    source.exposure = std::min(source.exposure, before);
  }
  return source;
}

Light light_at(const std::vector<Fault>& faults, std::size_t camera, double t) {
  Light light;
  for (const Fault& fault : faults) {
    if (!fault.active(t) || !fault.hits(camera)) continue;
    if (fault.kind == FaultKind::camera_dark || fault.kind == FaultKind::camera_overexposed) {
      light.gain *= fault.parameter;
    }
    light.covered = light.covered || fault.kind == FaultKind::camera_covered;
  }
  return light;
}

bool changes_pictures(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::people:
    case FaultKind::hard_landing:
    case FaultKind::camera_covered:
    case FaultKind::camera_dark:
    case FaultKind::camera_overexposed:
    case FaultKind::camera_frozen:
    case FaultKind::camera_swapped:
    case FaultKind::camera_dropped:
      return true;
    default:
      return false;
  }
}

}  // namespace ear::simulator
