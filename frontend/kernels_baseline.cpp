// The image kernels for processors of which a build knows one kind only: NEON on 64-bit Arm, else plain C++.
#define EAR_VARIANT baseline
#include "frontend/kernels_body.h"

namespace ear {

ImageKernels kernels_baseline() {
#if defined(__aarch64__)
  constexpr Kernels kKind = Kernels::neon;
#else
  constexpr Kernels kKind = Kernels::plain;
#endif
  return {kKind,
          baseline::align_position,
          baseline::align_affine,
          baseline::compare,
          baseline::compare_along,
          baseline::capture,
          baseline::moments,
          baseline::position_moments,
          baseline::corner_scores,
          baseline::texture,
          baseline::halve};
}

}  // namespace ear
