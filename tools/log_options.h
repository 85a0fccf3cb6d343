// --log-level and --log-file of the ear program.
#pragma once

#include <CLI/CLI.hpp>

namespace ear::tools {

/// Adds both to the program, for all subcommands, before or after these. The log is set up before a subcommand begins.
void add_log_options(CLI::App& app);

}  // namespace ear::tools
