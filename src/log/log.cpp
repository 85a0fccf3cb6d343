#include "src/log/log.h"

#include <spdlog/details/os.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <stdexcept>

namespace ear {
namespace {

constexpr const char* kName = "ear";
constexpr const char* kClearLine = "\r\033[K";  // a line of progress may stand there

spdlog::level::level_enum level_of(LogLevel level) {
  switch (level) {
    case LogLevel::debug:
      return spdlog::level::debug;
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    case LogLevel::error:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

/// Is standard error the stream that systemd named in JOURNAL_STREAM, as "device:inode"?
bool writes_to_journal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat status {};
  if (stream == nullptr || ::fstat(fileno(stderr), &status) != 0) return false;
  return std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino) == stream;
}

/// "<4>warning: text": the journal takes the number for the line's priority.
class JournalFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    const std::string_view level = priority(message.level);
    line.append(level.data(), level.data() + level.size());
    line.append(message.payload.begin(), message.payload.end());
    line.push_back('\n');
  }
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JournalFormatter>();
  }

 private:
  static std::string_view priority(spdlog::level::level_enum level) {
    if (level >= spdlog::level::err) return "<3>";
    if (level == spdlog::level::warn) return "<4>";
    return level == spdlog::level::info ? "<6>" : "<7>";
  }
};

spdlog::sink_ptr make_file_sink(const LogOptions& options) {
  if (options.most_bytes == 0) return std::make_shared<spdlog::sinks::basic_file_sink_mt>(options.file.string());
  return std::make_shared<spdlog::sinks::rotating_file_sink_mt>(options.file.string(), options.most_bytes,
                                                                options.older_files);
}

std::shared_ptr<spdlog::logger> make_logger(const LogOptions& options) {
  const auto terminal = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  const bool shows_progress = spdlog::details::os::in_terminal(stderr);
  terminal->set_pattern(std::string(shows_progress ? kClearLine : "") + "ear: %l: %v");
  if (writes_to_journal()) terminal->set_formatter(std::make_unique<JournalFormatter>());
  terminal->set_level(level_of(options.level));
  auto logger = std::make_shared<spdlog::logger>(kName, terminal);
  logger->set_level(terminal->level());
  if (!options.file.empty()) {
    const spdlog::sink_ptr file = make_file_sink(options);
    file->set_pattern("%Y-%m-%d %H:%M:%S.%e %l: %v");
    file->set_level(std::min(terminal->level(), spdlog::level::info));
    logger->sinks().push_back(file);
    logger->set_level(file->level());
  }
  logger->flush_on(spdlog::level::trace);  // lines are few, and the last ones before an end count
  return logger;
}

std::shared_ptr<spdlog::logger> logger() {
  if (auto known = spdlog::get(kName)) return known;
  auto made = make_logger({});
  try {
    spdlog::register_logger(made);
  } catch (const spdlog::spdlog_ex&) {  // another thread was faster
    if (auto known = spdlog::get(kName)) return known;
  }
  return made;
}

}  // namespace

void log(LogLevel level, const std::string& message) noexcept {
  try {
    logger()->log(level_of(level), message);
  } catch (...) {  // what cannot be logged must not stop what it is about
  }
}

void set_up_log(const LogOptions& options) {
  try {
    const auto made = make_logger(options);
    spdlog::drop(kName);
    spdlog::register_logger(made);
  } catch (const spdlog::spdlog_ex& error) {
    throw std::runtime_error(options.file.string() + ": cannot be written: " + error.what());
  }
}

}  // namespace ear
