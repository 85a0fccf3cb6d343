// The messages of Cyclone DDS, which else goes to standard error.
#pragma once

#include <functional>
#include <string>

namespace ear::dds {

/// Takes Cyclone's warnings and errors for as long as it lives; one at a time in a process.
class LogSink {
 public:
  /// `take` gets one line each, by any thread, and must not call Cyclone.
  explicit LogSink(std::function<void(const std::string&)> take);
  ~LogSink();
  LogSink(const LogSink&) = delete;
  LogSink& operator=(const LogSink&) = delete;
  LogSink(LogSink&&) = delete;
  LogSink& operator=(LogSink&&) = delete;

 private:
  std::function<void(const std::string&)> take_;
};

}  // namespace ear::dds
