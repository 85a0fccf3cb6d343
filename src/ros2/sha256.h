// SHA-256, as FIPS 180-4 has it.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace ear::ros2 {

[[nodiscard]] std::array<std::uint8_t, 32> sha256(const std::string& message);

}  // namespace ear::ros2
