// The image kernels for x86-64 processors with SSE 4.1: small ones, without AVX.
#define EAR_VARIANT sse4
#include "frontend/kernels_body.h"

namespace ear {

ImageKernels kernels_sse4() {
  return {Kernels::sse4, sse4::align_position,   sse4::align_affine,  sse4::compare, sse4::compare_along, sse4::capture,
          sse4::moments, sse4::position_moments, sse4::corner_scores, sse4::texture, sse4::halve};
}

}  // namespace ear
