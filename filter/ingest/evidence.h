// How much must be seen before a rule acts.
#pragma once

namespace ear {

/// [s] chosen: of what a regression is made of, of an interval, which a crystal keeps, and of how late stamps are.
inline constexpr double kSlopeMemory = 100.0;
inline constexpr double kClear = 4.0;  ///< chosen: so many standard deviations are not chance
inline constexpr int kToKnow = 20;     ///< chosen: a mean of so many is known, whatever their rate
/// Chosen: fewer features show too little of where the vehicle is, or of how it moved.
inline constexpr int kFewFeatures = 10;

}  // namespace ear
