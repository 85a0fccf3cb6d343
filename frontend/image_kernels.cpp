#include "frontend/image_kernels.h"

#include <algorithm>
#include <stdexcept>

namespace ear {

#if defined(EAR_KERNELS_X86)

ImageKernels kernels_sse2();
ImageKernels kernels_sse4();
ImageKernels kernels_avx2();

std::vector<ImageKernels> image_kernels() {
  std::vector<ImageKernels> all{kernels_sse2()};
  if (__builtin_cpu_supports("sse4.1")) all.push_back(kernels_sse4());
  if (__builtin_cpu_supports("avx2")) all.push_back(kernels_avx2());
  return all;
}

#else

ImageKernels kernels_baseline();

std::vector<ImageKernels> image_kernels() { return {kernels_baseline()}; }

#endif

ImageKernels image_kernels(Kernels kind) {
  const std::vector<ImageKernels> all = image_kernels();
  if (kind == Kernels::best) return all.back();
  const auto found = std::find_if(all.begin(), all.end(), [&](const ImageKernels& k) { return k.kind == kind; });
  if (found == all.end())
    throw std::invalid_argument("frontend: this processor does not have the kernels " + name_of(kind));
  return *found;
}

std::string name_of(Kernels kind) {
  switch (kind) {
    case Kernels::best:
      return "best";
    case Kernels::sse2:
      return "sse2";
    case Kernels::sse4:
      return "sse4";
    case Kernels::avx2:
      return "avx2";
    case Kernels::neon:
      return "neon";
    case Kernels::plain:
      return "plain";
  }
  return "unknown";
}

Kernels kernels_named(const std::string& name) {
  for (const Kernels kind :
       {Kernels::best, Kernels::sse2, Kernels::sse4, Kernels::avx2, Kernels::neon, Kernels::plain}) {
    if (name == name_of(kind)) return kind;
  }
  throw std::invalid_argument("no kernels are called \"" + name + "\"; there are best, sse2, sse4, avx2, neon, plain");
}

}  // namespace ear
