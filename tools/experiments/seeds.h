// Seeds as they are written on a command line.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ear::experiments {

/// "501..505", "7" -> the numbers, in this order. Throws std::invalid_argument for what is no number.
[[nodiscard]] std::vector<std::uint64_t> parse_seeds(const std::vector<std::string>& texts);

}  // namespace ear::experiments
