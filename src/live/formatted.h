// Numbers in sentences.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace ear::live {

/// As printf, 240 characters at most.
template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 240> line{};
  std::snprintf(line.data(), line.size(), format, values...);
  return line.data();
}

}  // namespace ear::live
