// The filter's kernels for any x86-64 processor.
#define EAR_VARIANT sse2
#include "filter/kernels/kernels_body.h"

namespace ear {

FilterKernels filter_kernels_sse2() { return sse2::kernels(Kernels::sse2); }

}  // namespace ear
