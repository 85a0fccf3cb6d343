// ear: localisation of a vehicle that drives and flies, from recordings. `ear SUBCOMMAND --help` explains each.
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include "src/log/log.h"
#include "tools/commands.h"
#include "tools/log_options.h"
#include "tools/version.h"

namespace {

// What stands where a subcommand should and is none: CLI11 would only say that a subcommand is required.
void refuse_unknown_subcommand(const CLI::App& app) {
  const std::vector<std::string> unknown = app.remaining();
  if (unknown.empty() || !app.get_subcommands().empty()) return;
  std::string known;
  for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
    known += (known.empty() ? "" : ", ") + subcommand->get_name();
  }
  throw std::invalid_argument("no subcommand \"" + unknown.front() + "\"; there are " + known);
}

int run_subcommand(int argc, char** argv) {
  CLI::App app{"ear: where a vehicle that drives and flies is, from cameras, IMU, wheels and lasers"};
  app.require_subcommand(1);
  app.set_version_flag("--version", ear::tools::version_text);
  ear::tools::add_run_command(app);
  ear::tools::add_live_command(app);
  ear::tools::add_simulate_command(app);
  ear::tools::add_evaluate_command(app);
  ear::tools::add_check_command(app);
  ear::tools::add_bench_command(app);
  ear::tools::add_export_command(app);
  ear::tools::add_experiments_command(app);
#ifdef EAR_WITH_CALIBRATION
  ear::tools::add_calibrate_command(app);
#endif
  ear::tools::add_log_options(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {  // also --help
    refuse_unknown_subcommand(app);
    return app.exit(error);
  }
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_subcommand(argc, argv);
  } catch (const std::exception& error) {
    ear::log_error(error.what());
    return EXIT_FAILURE;
  }
}
