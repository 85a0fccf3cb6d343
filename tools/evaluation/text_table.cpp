#include "tools/evaluation/text_table.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace ear::evaluation {
namespace {

constexpr std::string_view kBlanks = " \t\r";
constexpr std::size_t kPoseColumns = 8;  // a row with fewer holds no pose

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string> split_at_commas(std::string_view text) {
  std::vector<std::string> fields;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    fields.emplace_back(trimmed(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

std::vector<std::string> split_at_blanks(std::string_view text) {
  std::vector<std::string> fields;
  for (std::size_t begin = text.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, begin), text.size());
    fields.emplace_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kBlanks, end);
  }
  return fields;
}

std::vector<std::string> split(std::string_view text, bool at_commas) {
  return at_commas ? split_at_commas(text) : split_at_blanks(text);
}

/// The whole text as a number, "nan" and "inf" included.
std::optional<double> as_number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

struct Decimal {
  bool negative = false;
  std::string digits;  ///< all digits, without the point
  int point = 0;       ///< how many of them stand before it, with the exponent applied
};

/// Takes apart "-12.5e3". Empty digits: it was no number.
Decimal take_apart(std::string_view text) {
  Decimal result;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    result.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  const std::size_t mantissa_end = std::min(text.find_first_of("eE"), text.size());
  const std::string_view mantissa = text.substr(0, mantissa_end);
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  int exponent = 0;
  if (mantissa_end < text.size()) {
    std::string_view tail = text.substr(mantissa_end + 1);
    if (!tail.empty() && tail.front() == '+') tail.remove_prefix(1);
    const auto [end, error] = std::from_chars(tail.data(), tail.data() + tail.size(), exponent);
    // The bound keeps the sum below from overflowing; no time has such an exponent.
    if (error != std::errc{} || end != tail.data() + tail.size() || std::abs(exponent) > 100) return {};
  }
  result.digits = std::string(mantissa.substr(0, point));
  result.point = static_cast<int>(point) + exponent;
  if (point < mantissa.size()) result.digits += mantissa.substr(point + 1);
  const bool all_digits = std::all_of(result.digits.begin(), result.digits.end(),
                                      [](unsigned char digit) { return std::isdigit(digit) != 0; });
  return all_digits ? result : Decimal{};
}

/// Digits before position `point` as an integer, rounded by the digit there. Nothing beyond kLargestStamp.
std::optional<TimeNs> rounded(const Decimal& number, int point) {
  std::string whole = "0";
  for (int i = 0; i < point; ++i)
    whole += i < static_cast<int>(number.digits.size()) ? number.digits[static_cast<std::size_t>(i)] : '0';
  TimeNs value = 0;
  const auto [end, error] = std::from_chars(whole.data(), whole.data() + whole.size(), value);
  if (error != std::errc{} || end != whole.data() + whole.size() || value > kLargestStamp) return std::nullopt;
  const bool up = point >= 0 && point < static_cast<int>(number.digits.size()) &&
                  number.digits[static_cast<std::size_t>(point)] >= '5';
  return (number.negative ? -1 : 1) * (value + (up ? 1 : 0));
}

/// Which of the lines above the first row names the columns: the last that is as wide as that row; where the row is
/// torn, the last that names a time. Nothing: all are comments.
std::vector<std::string> header_among(const std::vector<std::vector<std::string>>& lines, std::size_t columns) {
  const auto names_time = [](const std::vector<std::string>& fields) {
    constexpr std::array kNames{"t_ns", "timestamp", "timestamp [ns]"};
    return std::find_first_of(fields.begin(), fields.end(), kNames.begin(), kNames.end()) != fields.end();
  };
  const auto fits = [columns](const std::vector<std::string>& fields) { return fields.size() == columns; };
  auto header = std::find_if(lines.rbegin(), lines.rend(), fits);
  if (header == lines.rend()) header = std::find_if(lines.rbegin(), lines.rend(), names_time);
  return header == lines.rend() ? std::vector<std::string>{} : *header;
}

bool none_as_wide(const std::vector<Row>& rows, std::size_t width) {
  return std::none_of(rows.begin(), rows.end(), [width](const Row& row) { return row.fields.size() == width; });
}

}  // namespace

TextTable::TextTable(std::filesystem::path path) : path_(std::move(path)) {
  std::ifstream file(path_);
  if (!file || std::filesystem::is_directory(path_)) throw std::runtime_error(path_.string() + ": cannot be read");

  std::vector<std::vector<std::string>> before;  // lines above the first row: comments, and a header somewhere
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    const std::string_view text = trimmed(line);
    if (text.empty()) continue;
    const bool commas = text.find(',') != std::string_view::npos;
    if (text.front() == '#') {
      if (rows_.empty()) before.push_back(split(trimmed(text.substr(1)), commas));
      continue;
    }
    std::vector<std::string> fields = split(text, commas);
    const bool has_numbers = std::any_of(fields.begin(), fields.end(), as_number);
    if (rows_.empty() && !has_numbers) {
      before.push_back(std::move(fields));
      continue;
    }
    if (rows_.empty()) has_commas_ = commas;
    rows_.push_back({number, std::move(fields)});
  }
  if (rows_.empty()) throw std::runtime_error(path_.string() + ": holds no rows of numbers");
  header_ = header_among(before, columns());
  if (!header_.empty() && columns() < kPoseColumns && rows_.size() > 1 && none_as_wide(rows_, header_.size()))
    header_.clear();  // a sentence with commas in it, above positions
  check_widths();
}

void TextTable::check_widths() const {
  const bool header_counts = has_commas_ && header_.size() > 1;  // a TUM file's comment is not a list of columns
  const std::size_t expected = header_counts ? header_.size() : columns();
  for (const Row& row : rows_) {
    if (row.fields.size() == expected) continue;
    throw std::runtime_error(path_.string() + ":" + std::to_string(row.line) + ": " +
                             std::to_string(row.fields.size()) + " fields where " + std::to_string(expected) +
                             " are expected: the line is torn");
  }
}

std::optional<std::size_t> TextTable::column(const std::string& name) const {
  const auto found = std::find(header_.begin(), header_.end(), name);
  if (found == header_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - header_.begin());
}

std::size_t TextTable::required_column(const std::string& name) const {
  const std::optional<std::size_t> found = column(name);
  if (!found) fail("the header has no column '" + name + "'");
  return *found;
}

double TextTable::number(const Row& row, std::size_t column, const std::string& name) const {
  const std::string& text = row.fields[column];
  const std::optional<double> value = as_number(text);
  if (!value) fail(row, column, name, "'" + text + "' is no number");
  if (!std::isfinite(*value)) fail(row, column, name, "'" + text + "' is not finite");
  return *value;
}

std::optional<double> TextTable::optional_number(const Row& row, std::size_t column, const std::string& name) const {
  if (row.fields[column].empty() || row.fields[column] == "nan") return std::nullopt;
  return number(row, column, name);
}

bool TextTable::flag(const Row& row, std::size_t column, const std::string& name) const {
  const std::string& text = row.fields[column];
  if (text != "0" && text != "1") fail(row, column, name, "'" + text + "' is neither 0 nor 1");
  return text == "1";
}

TimeNs TextTable::time(const Row& row, std::size_t column, const std::string& name, int exponent) const {
  const std::string& text = row.fields[column];
  const Decimal decimal = take_apart(text);
  if (decimal.digits.empty()) fail(row, column, name, "'" + text + "' is no time");
  const std::optional<TimeNs> value = rounded(decimal, decimal.point + exponent);
  if (!value) fail(row, column, name, "'" + text + "' is more than 142 years from zero");
  return *value;
}

void TextTable::fail(const Row& row, std::size_t column, const std::string& name, const std::string& what) const {
  throw std::runtime_error(path_.string() + ":" + std::to_string(row.line) + ": field '" + name + "' (column " +
                           std::to_string(column + 1) + "): " + what);
}

void TextTable::fail(const std::string& what) const { throw std::runtime_error(path_.string() + ":1: " + what); }

}  // namespace ear::evaluation
