#include "tools/view_options.h"

#include <algorithm>
#include <cctype>
#include <string>

#include <CLI/CLI.hpp>

namespace ear::tools {

CLI::Option* add_view_options(CLI::App& command, ViewArguments& args) {
  constexpr int kLargestPort = 65535;
  CLI::Option* view =
      command.add_option("--view", args.port, "Show it in a browser: http://localhost:PORT (docs/view.md)")
          ->type_name("PORT")
          ->check(CLI::Range(0, kLargestPort));
  command.add_option("--view-address", args.address, "Where the view listens; others reach it with --view-token only")
      ->needs(view)
      ->capture_default_str();
  command.add_option("--view-token", args.token, "What a viewer must know: letters, digits, - and _")
      ->needs(view)
      ->check([](const std::string& token) {
        const auto fits = [](char c) {
          return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
        };
        constexpr std::size_t kShortest = 8;
        const bool good = token.size() >= kShortest && std::all_of(token.begin(), token.end(), fits);
        return good ? std::string() : std::string("at least 8 letters, digits, - and _");
      });
  return view;
}

void add_options(CLI::App& command, RunViewArguments& args) {
  CLI::Option* const view = add_view_options(command, args.server);
  command.add_option("--view-hold", args.hold, "How long the view stays when the recording has ended [s]")
      ->needs(view)
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--real-time", args.real_time, "With --view: as fast as the recording was made")->needs(view);
}

}  // namespace ear::tools
