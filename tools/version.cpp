#include "tools/version.h"

#include "frontend/image_kernels.h"
#include "tools/program_config.h"

namespace ear::tools {

std::string kernels_here(const Config& config) { return name_of(image_kernels(config.frontend.kernels).kind); }

std::string version_text() {
  std::string text = "ear " EAR_VERSION ", commit " + commit() + "\nkernels: ";
  text += kernels_here(program_config({})) + " (here are";
  for (const ImageKernels& kernels : image_kernels()) text += " " + name_of(kernels.kind);
  const std::string parts = EAR_PARTS;
  return text + ")\noptional parts:" + (parts.empty() ? " none" : parts);
}

}  // namespace ear::tools
