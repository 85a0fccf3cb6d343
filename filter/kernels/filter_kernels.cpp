#include "filter/kernels/filter_kernels.h"

namespace ear {

#if defined(EAR_KERNELS_X86)

FilterKernels filter_kernels_sse2();
FilterKernels filter_kernels_sse4();
FilterKernels filter_kernels_avx2();

FilterKernels filter_kernels(Kernels kind) {
  const bool best = kind == Kernels::best || kind == Kernels::avx2;
  if (best && __builtin_cpu_supports("avx2")) return filter_kernels_avx2();
  if ((best || kind == Kernels::sse4) && __builtin_cpu_supports("sse4.1")) return filter_kernels_sse4();
  return filter_kernels_sse2();
}

#else

FilterKernels filter_kernels_baseline();

FilterKernels filter_kernels(Kernels) { return filter_kernels_baseline(); }

#endif

}  // namespace ear
