// A text file of rows and fields that remembers where everything stood, so that every error can say it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ear/types.h"

namespace ear::evaluation {

/// One row of fields with the line it stood on.
struct Row {
  std::size_t line = 0;  ///< counted from 1
  std::vector<std::string> fields;
};

/// The rows of a text file: fields separated by commas where the line has one, else by blanks. Empty lines and those
/// that start with '#' are no rows; nor is a line without any number before the first row. The header is the last of
/// these before the first row that has as many fields as that row; the others are comments. Above rows of fewer
/// than eight fields, a header that no row is as wide as is a comment too.
class TextTable {
 public:
  /// Throws if the file cannot be read, has no rows, or has a row with another number of fields than the first.
  explicit TextTable(std::filesystem::path path);

  [[nodiscard]] bool has_commas() const { return has_commas_; }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] std::size_t columns() const { return rows_.front().fields.size(); }

  /// Position of the column with this name in the header.
  [[nodiscard]] std::optional<std::size_t> column(const std::string& name) const;

  /// The same; throws if there is none.
  [[nodiscard]] std::size_t required_column(const std::string& name) const;

  /// A field as a finite number; `name` is for the error only.
  [[nodiscard]] double number(const Row& row, std::size_t column, const std::string& name) const;

  /// The same, but an empty field or "nan" is a value that is not known.
  [[nodiscard]] std::optional<double> optional_number(const Row& row, std::size_t column,
                                                      const std::string& name) const;

  /// A field that is 0 or 1.
  [[nodiscard]] bool flag(const Row& row, std::size_t column, const std::string& name) const;

  /// A field of decimal digits as integer nanoseconds: the field's value times 10^`exponent` (0: it is in nanoseconds,
  /// 9: in seconds), rounded to the nearest, with no floating point in between.
  [[nodiscard]] TimeNs time(const Row& row, std::size_t column, const std::string& name, int exponent) const;

  /// Throws: "file:line: field 'name' (column n): what".
  [[noreturn]] void fail(const Row& row, std::size_t column, const std::string& name, const std::string& what) const;

  /// Throws: "file:1: what".
  [[noreturn]] void fail(const std::string& what) const;

 private:
  void check_widths() const;

  std::filesystem::path path_;
  bool has_commas_ = false;
  std::vector<std::string> header_;
  std::vector<Row> rows_;
};

}  // namespace ear::evaluation
