// What the room's surfaces look like: procedural pictures with detail at every scale, and some surfaces almost without.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/simulator/random.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/texture.h"

namespace ear::simulator {

struct Appearance {
  std::vector<Texture> panels;  ///< one per panel of the scene
  Texture ground;
};

/// A panel by itself; `rng` draws what is on it.
[[nodiscard]] Texture paint_panel(const Panel& panel, Rng& rng);

/// The same seed gives the same room.
[[nodiscard]] Appearance paint_room(const Scene& scene, std::uint64_t seed);

}  // namespace ear::simulator
