// The processor that figures were measured on: for a line that can be pasted beside those of others.
#pragma once

#include <filesystem>
#include <string>

namespace ear::tools {

struct Machine {
  std::string processor;   ///< its name, or that of the board
  int cores = 1;           ///< that this process may run on
  double clock_mhz = 0.0;  ///< the highest that its governor allows, else the present one; 0: unknown
  std::string governor;    ///< of the clock; "unknown" where the system does not tell, as in virtual machines
};

/// `root`: of the file system, for tests.
[[nodiscard]] Machine this_machine(const std::filesystem::path& root = "/");

}  // namespace ear::tools
