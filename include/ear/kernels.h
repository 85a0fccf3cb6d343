// For which vector instructions the arithmetic is compiled that a program chooses from as it runs.
#pragma once

namespace ear {

/// Vector instructions for the arithmetic of images, and of the filter's sums. The results are the same bit for bit.
enum class Kernels {
  best,   ///< of those that the processor has
  sse2,   ///< any x86-64
  sse4,   ///< x86-64 with SSE 4.1
  avx2,   ///< x86-64 with AVX2
  neon,   ///< 64-bit Arm
  plain,  ///< other processors
};

}  // namespace ear
