// A vehicle that is shown in a browser while it moves (docs/view.md).
#pragma once

#include <memory>
#include <string>

#include "ear/calibration.h"
#include "src/live/session.h"
#include "tools/view_options.h"

namespace ear::tools {

class LiveView {
 public:
  /// Serves from now on, and prints where. Throws InputError where this program has no view, std::invalid_argument and
  /// std::runtime_error as view::Server does.
  LiveView(const ViewArguments& args, const std::string& title, const Calibration& calibration);
  ~LiveView();
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;
  LiveView(LiveView&&) = delete;
  LiveView& operator=(LiveView&&) = delete;

  /// For a session, which this must outlive.
  [[nodiscard]] live::Onlooker onlooker();

  /// The session has stopped. One line about what came.
  [[nodiscard]] std::string finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ear::tools
