// The log: warnings and events of src/ and of the ear program, for people. What a program acts on it gets as values.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace ear {

enum class LogLevel {
  debug,
  info,     ///< events: started, degraded, carried on
  warning,  ///< something was refused, left out, or is lost
  error     ///< the end of what was asked for
};

/// Writes one line to spdlog's logger "ear". A program that embeds the library registers a logger of this name, with
/// its own sinks and level; without one, lines go to standard error from level warning on. Any thread; never throws.
void log(LogLevel level, const std::string& message) noexcept;

inline void log_info(const std::string& message) noexcept { log(LogLevel::info, message); }
inline void log_warning(const std::string& message) noexcept { log(LogLevel::warning, message); }
inline void log_error(const std::string& message) noexcept { log(LogLevel::error, message); }

struct LogOptions {
  LogLevel level = LogLevel::warning;  ///< of standard error
  std::filesystem::path file;          ///< also here, with times, from level info on; empty: nowhere else
  std::size_t most_bytes = 0;   ///< of the file: then it begins anew, and older ones are kept as file.1, ...; 0: any
  std::size_t older_files = 3;  ///< so many
};

/// Makes the logger "ear" anew. Where standard error goes to systemd's journal, lines begin with the level as it reads
/// it (sd-daemon(3)). Throws std::runtime_error, naming the file, if that cannot be written.
void set_up_log(const LogOptions& options);

}  // namespace ear
