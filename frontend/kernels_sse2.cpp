// The image kernels for any x86-64 processor.
#define EAR_VARIANT sse2
#include "frontend/kernels_body.h"

namespace ear {

ImageKernels kernels_sse2() {
  return {Kernels::sse2, sse2::align_position,   sse2::align_affine,  sse2::compare, sse2::compare_along, sse2::capture,
          sse2::moments, sse2::position_moments, sse2::corner_scores, sse2::texture, sse2::halve};
}

}  // namespace ear
