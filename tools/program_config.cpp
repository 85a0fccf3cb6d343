#include "tools/program_config.h"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "frontend/image_kernels.h"
#include "src/recording/config_file.h"

namespace ear::tools {

Config with_environment(Config config) {
  const char* const kernels = std::getenv("EAR_KERNELS");  // nobody sets the environment while this program runs
  if (kernels == nullptr || *kernels == '\0') return config;
  try {
    config.frontend.kernels = config.filter.kernels = kernels_named(kernels);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("EAR_KERNELS: ") + error.what());
  }
  return config;
}

Config program_config(const std::filesystem::path& file) {
  return with_environment(file.empty() ? Config{} : load_config(file));
}

}  // namespace ear::tools
