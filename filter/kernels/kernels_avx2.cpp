// The filter's kernels for x86-64 processors with AVX2.
#define EAR_VARIANT avx2
#include "filter/kernels/kernels_body.h"

namespace ear {

FilterKernels filter_kernels_avx2() { return avx2::kernels(Kernels::avx2); }

}  // namespace ear
