// How much memory the filter takes at construction.
#pragma once

#include <cstddef>

namespace ear {

/// Frames with up to so many features are processed without asking for memory. The first one with more takes it then.
inline constexpr std::size_t kFeatureCapacity = 256;
/// Chosen: readings of one stream that may wait; of inertial samples half as many, 0.25 s at 1 kHz.
inline constexpr std::size_t kReadingCapacity = 512;

}  // namespace ear
