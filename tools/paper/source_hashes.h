// What this program was built from: the file that defines these is made by cmake/source_hashes.cmake.
#pragma once

#include <string>

namespace ear::paper {

/// 16 hexadecimal digits: of all that an estimate and its figures depend on.
[[nodiscard]] std::string estimator_sources();

/// The same of all that a simulated recording depends on.
[[nodiscard]] std::string simulator_sources();

}  // namespace ear::paper
