#include "tools/log_options.h"

#include <map>
#include <memory>
#include <string>

#include "src/log/log.h"

namespace ear::tools {

void add_log_options(CLI::App& app) {
  const std::map<std::string, LogLevel> levels{
      {"debug", LogLevel::debug}, {"info", LogLevel::info}, {"warning", LogLevel::warning}, {"error", LogLevel::error}};
  const auto options = std::make_shared<LogOptions>();
  app.add_option("--log-level", options->level, "What standard error shows: debug, info, warning or error")
      ->transform(CLI::CheckedTransformer(levels).description(""))
      ->type_name("LEVEL")
      ->default_str("warning");
  app.add_option("--log-file", options->file, "Also append the log to this file, with times, from level info on")
      ->type_name("FILE");
  app.parse_complete_callback([options] { set_up_log(*options); });
  for (CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) subcommand->fallthrough();
}

}  // namespace ear::tools
