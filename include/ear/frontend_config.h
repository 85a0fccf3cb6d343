// Settings of the front end. Each default is one value for all recordings; docs/frontend.md has the measurements.
#pragma once

namespace ear {

/// Vector instructions for the arithmetic of images. The results are the same bit for bit.
enum class Kernels {
  best,   ///< of those that the processor has
  sse2,   ///< any x86-64
  sse4,   ///< x86-64 with SSE 4.1
  avx2,   ///< x86-64 with AVX2
  neon,   ///< 64-bit Arm
  plain,  ///< other processors
};

struct FrontendConfig {
  int max_features = 150;           ///< tracks kept at a time
  double nearest_depth = 0.15;      ///< [m] closer points are not searched for across the stereo pair
  bool motion_prediction = true;    ///< search features where the state's motion predicts them; else where they were
  Kernels kernels = Kernels::best;  ///< another choice is for tests and comparisons; not in files
};

}  // namespace ear
