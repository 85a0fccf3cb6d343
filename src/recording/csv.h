// Csv files line by line, in constant memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ear {

/// One row: views into its reader's buffer, valid until the reader's next call.
struct CsvRow {
  std::size_t line = 0;                  ///< 1 is the first line of the file
  std::vector<std::string_view> fields;  ///< without the spaces around them
  bool terminated = true;                ///< false: the file ends before the line does
};

/// Reads rows of comma-separated fields. Skips empty lines, comments (#) and a heading without #; accepts \r\n, spaces
/// around fields and a comma at the end of a line.
class CsvReader {
 public:
  /// Throws InputError if the file cannot be opened.
  explicit CsvReader(std::filesystem::path file);

  /// The next row, or nullptr at the end of the file.
  [[nodiscard]] const CsvRow* next();

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  std::vector<char> buffer_;
  std::ifstream stream_;
  std::string text_;
  CsvRow row_;
  std::size_t line_ = 0;
  bool in_heading_ = true;
};

/// The number that fills the whole field, "nan" and "inf" included; nothing if it is none.
[[nodiscard]] std::optional<double> parse_double(std::string_view field);

/// The integer that fills the whole field; nothing if it is none.
[[nodiscard]] std::optional<std::int64_t> parse_integer(std::string_view field);

/// The first field of the last complete row whose first field is an integer: a csv's last stamp, without reading all of
/// it. Nothing if there is none in the file's last kilobytes.
[[nodiscard]] std::optional<std::int64_t> last_stamp(const std::filesystem::path& file);

}  // namespace ear
