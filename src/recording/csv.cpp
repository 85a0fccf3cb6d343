#include "src/recording/csv.h"

#include <charconv>
#include <utility>

#include "src/recording/input_error.h"

namespace ear {
namespace {

constexpr std::size_t kBufferSize = 1 << 16;
constexpr std::streamoff kTail = 4096;  // holds several of the longest rows (truth: about 300 characters)

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

void split(std::string_view text, std::vector<std::string_view>& fields) {
  fields.clear();
  while (true) {
    const std::size_t comma = text.find(',');
    fields.push_back(trimmed(text.substr(0, comma)));
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  if (fields.size() > 1 && fields.back().empty()) fields.pop_back();  // a comma at the end of the line
}

template <typename Number>
std::optional<Number> parse(std::string_view field) {
  if (field.size() > 1 && field.front() == '+') field.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size()) return std::nullopt;
  return value;
}

}  // namespace

CsvReader::CsvReader(std::filesystem::path file) : file_(std::move(file)), buffer_(kBufferSize) {
  stream_.rdbuf()->pubsetbuf(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  if (std::filesystem::is_regular_file(file_)) stream_.open(file_, std::ios::binary);
  if (!stream_.is_open()) throw InputError(located(file_, 0, "", "no such file, or it cannot be read"));
}

const CsvRow* CsvReader::next() {
  while (std::getline(stream_, text_)) {
    ++line_;
    const std::string_view content = trimmed(text_);
    if (content.empty() || content.front() == '#') continue;
    row_.line = line_;
    row_.terminated = !stream_.eof();
    split(content, row_.fields);
    const bool heading = std::exchange(in_heading_, false) && !parse_double(row_.fields.front());
    if (!heading) return &row_;
  }
  return nullptr;
}

std::optional<double> parse_double(std::string_view field) { return parse<double>(field); }

std::optional<std::int64_t> parse_integer(std::string_view field) { return parse<std::int64_t>(field); }

std::optional<std::int64_t> last_stamp(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) return std::nullopt;
  const std::streamoff start = std::max<std::streamoff>(0, static_cast<std::streamoff>(stream.tellg()) - kTail);
  stream.seekg(start);
  std::string text;
  if (start > 0) std::getline(stream, text);  // the rest of a line that began earlier
  std::optional<std::int64_t> last;
  while (std::getline(stream, text)) {
    const std::string_view line = text;
    const std::size_t comma = line.find(',');
    if (comma == std::string_view::npos) continue;
    if (const auto stamp = parse_integer(trimmed(line.substr(0, comma)))) last = stamp;
  }
  return last;
}

}  // namespace ear
