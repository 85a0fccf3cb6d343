// How long nothing may come, and what is too old to count: for samples, starts, sources and health alike.
#pragma once

#include <algorithm>

namespace ear {

/// [s] chosen: a moment. Samples that do not come for so long are missing, and the stamp that follows needs to be
/// confirmed; what came within it is recent: a mean, a noise, an image, wheels that seemed to lift.
inline constexpr double kStreamGap = 0.25;
/// [s] chosen: what a sensor showed so long ago shows nothing of now.
inline constexpr double kStale = 0.5;
/// [s] chosen: without inertial samples, or with nothing but these, for so long, and the state is lost. So stamps that
/// are off by more are of another clock, and older readings start nothing.
inline constexpr double kLostAfter = 2.0;
/// Chosen: so many samples in a row confirm each other; one may have a false stamp.
inline constexpr int kConfirmed = 3;
/// Chosen: one sample may be lost; so many of the usual intervals are a gap.
inline constexpr double kMissed = 2.5;
/// [s] chosen: but not less than this. Nor is a reading used that comes later.
inline constexpr double kSilent = 0.12;

/// How long a sensor may be silent [s] that usually delivers every `interval` seconds; 0: not known.
[[nodiscard]] inline double longest_silence(double interval) { return std::max(kSilent, kMissed * interval); }

}  // namespace ear
