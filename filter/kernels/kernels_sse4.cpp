// The filter's kernels for x86-64 processors with SSE 4.1.
#define EAR_VARIANT sse4
#include "filter/kernels/kernels_body.h"

namespace ear {

FilterKernels filter_kernels_sse4() { return sse4::kernels(Kernels::sse4); }

}  // namespace ear
