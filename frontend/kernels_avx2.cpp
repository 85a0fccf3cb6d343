// The image kernels for x86-64 processors with AVX2.
#define EAR_VARIANT avx2
#include "frontend/kernels_body.h"

namespace ear {

ImageKernels kernels_avx2() {
  return {Kernels::avx2, avx2::align_position,   avx2::align_affine,  avx2::compare, avx2::compare_along, avx2::capture,
          avx2::moments, avx2::position_moments, avx2::corner_scores, avx2::texture, avx2::halve};
}

}  // namespace ear
