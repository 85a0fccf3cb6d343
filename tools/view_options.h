// What `ear run --view` and `ear live --view` are asked for (docs/view.md).
#pragma once

#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's name
class App;
class Option;
}  // namespace CLI

namespace ear::tools {

struct ViewArguments {
  int port = -1;  ///< below 0: no view
  std::string address = "127.0.0.1";
  std::string token;
};

/// Adds --view, which it returns, --view-address and --view-token.
CLI::Option* add_view_options(CLI::App& command, ViewArguments& args);

struct RunViewArguments {
  ViewArguments server;
  bool real_time = false;
  double hold = 0.0;  ///< [s] that it stays when the run has ended
};

/// Those, --view-hold and --real-time.
void add_options(CLI::App& command, RunViewArguments& args);

}  // namespace ear::tools
