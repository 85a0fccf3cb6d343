// What every program of this folder does around its work.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <exception>
#include <iostream>

namespace ear::tools {

/// Reads the command line, then works. What goes wrong is one line on stderr, and the exit code.
template <typename Work>
int run_program(CLI::App& app, int argc, char** argv, const Work& work) {
  try {
    app.parse(argc, argv);
    work();
  } catch (const CLI::ParseError& error) {  // also --help
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << app.get_name() << ": " << error.what() << '\n';
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}

}  // namespace ear::tools
