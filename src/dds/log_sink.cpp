#include "src/dds/log_sink.h"

#include <dds/ddsrt/log.h>

#include <utility>

namespace ear::dds {
namespace {

void take_line(void* sink, const dds_log_data_t* line) {
  std::string text(line->message, line->size);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  (*static_cast<const std::function<void(const std::string&)>*>(sink))(text);
}

}  // namespace

LogSink::LogSink(std::function<void(const std::string&)> take) : take_(std::move(take)) {
  dds_set_log_sink(&take_line, &take_);
}
LogSink::~LogSink() { dds_set_log_sink(nullptr, nullptr); }

}  // namespace ear::dds
