// How much memory the filter takes at construction.
#pragma once

#include <cstddef>

namespace ear {

/// Frames with up to so many features are processed without asking for memory. The first one with more takes it then.
inline constexpr std::size_t kFeatureCapacity = 256;

}  // namespace ear
