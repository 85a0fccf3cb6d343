// ear: localisation of a vehicle that drives and flies, from recordings. `ear SUBCOMMAND --help` explains each.
#include <cstdlib>
#include <exception>
#include <iostream>

#include "tools/commands.h"

namespace {

int run_subcommand(int argc, char** argv) {
  CLI::App app{"ear: where a vehicle that drives and flies is, from cameras, IMU, wheels and lasers"};
  app.require_subcommand(1);
  ear::tools::add_run_command(app);
  ear::tools::add_simulate_command(app);
  ear::tools::add_evaluate_command(app);
  ear::tools::add_check_command(app);
  ear::tools::add_bench_command(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {  // also --help
    return app.exit(error);
  }
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_subcommand(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "ear: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
