#include "tools/version.h"

#include "frontend/image_kernels.h"
#include "tools/program_config.h"

namespace ear::tools {

std::string version_text() {
  std::string text = "ear " EAR_VERSION ", commit " + commit() + "\nkernels: ";
  text += name_of(image_kernels(program_config({}).frontend.kernels).kind) + " (here are";
  for (const ImageKernels& kernels : image_kernels()) text += " " + name_of(kernels.kind);
  const std::string parts = EAR_PARTS;
  return text + ")\noptional parts:" + (parts.empty() ? " none" : parts);
}

}  // namespace ear::tools
