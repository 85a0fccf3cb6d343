// What every program of this folder does around its work.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
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

/// For main(), which lets no exception out: run_program() leaves only those of options that cannot be declared.
inline int run_main(int (*parse_and_run)(int, char**), int argc, char** argv) {
  try {
    return parse_and_run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return EXIT_FAILURE;
  }
}

}  // namespace ear::tools
