// The filter's kernels for processors of which a build knows one kind only: NEON on 64-bit Arm, else plain C++.
#define EAR_VARIANT baseline
#include "filter/kernels/kernels_body.h"

namespace ear {

FilterKernels filter_kernels_baseline() {
#if defined(__aarch64__)
  return baseline::kernels(Kernels::neon);
#else
  return baseline::kernels(Kernels::plain);
#endif
}

}  // namespace ear
