// How much memory the filter takes at construction.
#pragma once

#include <cstddef>

namespace ear {

/// Frames with up to so many features are processed without asking for memory. The first one with more takes it then.
inline constexpr std::size_t kFeatureCapacity = 256;
/// Chosen: samples of one stream that are kept: 20 s at 200 Hz, 4 s at 1 kHz.
inline constexpr std::size_t kCapacity = 4096;

}  // namespace ear
