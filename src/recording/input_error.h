// The one exception for bad input from outside: its message says where to look.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace ear {

/// A file that cannot be used. what() names the file, the line and the field as far as they are known.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// "file:line: field: message"; a line of 0 and an empty field are left out.
[[nodiscard]] inline std::string located(const std::filesystem::path& file, std::size_t line, const std::string& field,
                                         const std::string& message) {
  std::string text = file.string();
  if (line > 0) text += ":" + std::to_string(line);
  if (!field.empty()) text += ": " + field;
  return text + ": " + message;
}

}  // namespace ear
