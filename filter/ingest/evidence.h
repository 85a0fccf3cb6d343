// How much must be seen before a rule acts.
#pragma once

namespace ear {

/// [s] chosen: of what a regression is made of, and of an interval, which a crystal keeps.
inline constexpr double kSlopeMemory = 100.0;
inline constexpr double kClear = 4.0;  ///< chosen: so many standard deviations are not chance

}  // namespace ear
