// The samples of one csv file, in strictly growing time. Rows that cannot be used are left out and counted.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "ear/types.h"
#include "src/recording/csv.h"
#include "src/recording/input_error.h"
#include "src/recording/sample_order.h"
#include "src/recording/warnings.h"

namespace ear {

/// Why a row gives no sample. Thrown by row parsers, handled by SampleStream.
struct RowError {
  enum class Kind { malformed, not_finite } kind;
  std::string field;    ///< the column's name
  std::string message;  ///< what is wrong with it
};

/// Reads a file of samples. `Sample` has a member t_ns.
///
/// A file whose first row is malformed is not what it should be: InputError. Later on, rows that are malformed or not
/// finite are counted and left out, and so are stamps that repeat, run backward, or jump ahead of the row that follows.
template <typename Sample>
class SampleStream {
 public:
  /// Makes a sample of a row, or throws RowError.
  using ParseRow = std::function<Sample(const CsvRow&)>;

  /// `name` ("imu0") begins the kind of every warning.
  SampleStream(const std::filesystem::path& file, std::string name, ParseRow parse_row)
      : csv_(file), name_(std::move(name)), parse_row_(std::move(parse_row)), order_(file, name_) {}

  /// The next good sample, or nothing at the end of the file. Throws InputError (see above).
  [[nodiscard]] std::optional<Sample> next(Warnings& warnings) {
    return order_.next([this](Warnings& w) { return read(w); }, warnings);
  }

  [[nodiscard]] const std::filesystem::path& file() const { return csv_.file(); }

 private:
  using Numbered = typename SampleOrder<Sample>::Numbered;

  std::optional<Numbered> read(Warnings& warnings) {
    while (const CsvRow* row = csv_.next()) {
      try {
        if (columns_ > 0 && row->fields.size() != columns_) {
          throw RowError{RowError::Kind::malformed, "line",
                         std::to_string(row->fields.size()) + " fields, not " + std::to_string(columns_)};
        }
        Numbered numbered{parse_row_(*row), row->line};
        columns_ = row->fields.size();
        return numbered;
      } catch (const RowError& error) {
        report(*row, error, warnings);
      }
    }
    return std::nullopt;
  }

  void report(const CsvRow& row, const RowError& error, Warnings& warnings) {
    const std::string where = located(csv_.file(), row.line, error.field, error.message);
    if (error.kind == RowError::Kind::not_finite) {
      columns_ = row.fields.size();
      warnings.add(name_ + ": value is not finite", where);
    } else if (columns_ == 0) {
      throw InputError(where);
    } else if (!row.terminated) {
      warnings.add(name_ + ": torn last line", where);
    } else {
      warnings.add(name_ + ": malformed line", where);
    }
  }

  CsvReader csv_;
  std::string name_;
  ParseRow parse_row_;
  SampleOrder<Sample> order_;
  std::size_t columns_ = 0;  // of the first row; all others must agree
};

}  // namespace ear
