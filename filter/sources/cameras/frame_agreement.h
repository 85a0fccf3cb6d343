// How far a frame agrees with the motion that the other sensors predict: what the health reads of the images.
#pragma once

namespace ear {

/// By definition, of features or readings.
inline constexpr double kMajority = 0.5;

struct FrameAgreement {
  int matches = 0;     ///< features seen by both cameras in the first frame, by the left one in the second
  double left = 0.0;   ///< share of them that are not where they were expected: left camera
  double right = 0.0;  ///< right camera
  // What the image shows by itself, whatever came before.
  double noise = 1.0;          ///< of the features, times the usual
  double behind = 0.0;         ///< share of the stereo features that the geometry puts behind the cameras
  bool right_skipped = false;  ///< nobody looked at that of the second camera

  /// Do the images contradict the state? Most features are off their place then.
  [[nodiscard]] bool contradicts() const { return left > kMajority; }
};

}  // namespace ear
