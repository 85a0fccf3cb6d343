// What several rules share: how long nothing may come, how much must be seen, how much memory is taken. For samples,
// starts, sources and health alike.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ear {

// ---- Time

/// [s] chosen: a moment. Samples that do not come for so long are missing, and the stamp that follows needs to be
/// confirmed; what came within it is recent: a mean, a noise, an image, wheels that seemed to lift.
inline constexpr double kStreamGap = 0.25;
/// [s] chosen: what a sensor showed so long ago shows nothing of now.
inline constexpr double kStale = 0.5;
/// [s] chosen: what goes on for so long is no chance of a moment: a clock that was set back, images that contradict the
/// state or fit it, innovations that are alike.
inline constexpr double kLasting = 1.0;
/// [s] chosen: without inertial samples, or with nothing but these, for so long, and the state is lost. So stamps that
/// are off by more are of another clock, and older readings start nothing.
inline constexpr double kLostAfter = 2.0;
/// Chosen: one sample may be lost; so many of the usual intervals are a gap.
inline constexpr double kMissed = 2.5;
/// [s] chosen: but not less than this. Nor is a reading used that comes later.
inline constexpr double kSilent = 0.12;

/// How long a sensor may be silent [s] that usually delivers every `interval` seconds; 0: not known.
[[nodiscard]] inline double longest_silence(double interval) { return std::max(kSilent, kMissed * interval); }

inline constexpr double kFastest = 100.0;  ///< [m/s] chosen: no vehicle with wheels and rotors is faster

// ---- Evidence

/// [s] chosen: of what a regression is made of, of an interval, which a crystal keeps, and of how late stamps are.
inline constexpr double kSlopeMemory = 100.0;
/// Chosen: of the path, two standard deviations of the position while tracking; a fit has settled when it moves by no
/// more, in standard deviations.
inline constexpr double kPrecise = 0.05;
/// [s] chosen: of what a stream is usually like: its noise, its interval, how far it is ahead of another. One image
/// that is wrong, or one reading that is late, changes little.
inline constexpr double kStreamMemory = 2.0;
/// Chosen: of a variance, times the usual or stated one: noise that is learned is ten times that at most.
inline constexpr double kFarthest = 100.0;
/// Chosen: times the usual or stated noise; less may be chance.
inline constexpr double kNoisy = 1.25;
inline constexpr double kClear = 4.0;  ///< chosen: so many standard deviations are not chance
/// Chosen: of what samples differ by from others: among themselves they are alike. In a spike, and before and after it;
/// half a sine over three samples differs by 0.4. Of steps in a row, and of how many: of those of real sensors a third
/// and more are unlike the one before.
inline constexpr double kAlike = 0.25;
inline constexpr int kToKnow = 20;  ///< chosen: a mean of so many is known, whatever their rate
/// Chosen: so many samples in a row confirm each other; one may have a false stamp.
inline constexpr int kConfirmed = 3;
/// Chosen: fewer features show too little of where the vehicle is, or of how it moved.
inline constexpr int kFewFeatures = 10;
/// Are so many repeats in a row no chance, where this share of the readings repeats? As little as kClear standard
/// deviations of two sensors.
[[nodiscard]] inline bool is_no_chance(double share, int repeats) {
  return std::pow(share, repeats) < std::exp(-kClear * kClear);
}
/// Does the gate refuse most of so many features? That of a state that is right refuses hardly any.
[[nodiscard]] inline bool refuses_most(double used, double rejected) {
  return rejected > used && used + rejected >= kFewFeatures;
}

// ---- Memory

/// Frames with up to so many features are processed without asking for memory. The first one with more takes it then.
inline constexpr std::size_t kFeatureCapacity = 256;
/// Chosen: samples of one stream that are kept: 20 s at 200 Hz, 4 s at 1 kHz.
inline constexpr std::size_t kCapacity = 4096;

}  // namespace ear
