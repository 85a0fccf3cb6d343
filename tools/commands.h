// The subcommands of the ear program, one file each. Each adds itself to the command line.
#pragma once

#include <CLI/CLI.hpp>

namespace ear::tools {

void add_run_command(CLI::App& app);
void add_simulate_command(CLI::App& app);
void add_evaluate_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_bench_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_experiments_command(CLI::App& app);
void add_live_command(CLI::App& app);
void add_calibrate_command(CLI::App& app);  ///< where Ceres was found

}  // namespace ear::tools
