// A replay that is shown in a browser (docs/view.md).
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "ear/odometry.h"
#include "src/odometry_factory.h"
#include "src/recording/recording.h"
#include "tools/replay.h"
#include "tools/view_options.h"

namespace ear::tools {

class RunView {
 public:
  /// Serves from now on, and prints where. Throws InputError where this program has no view, std::invalid_argument and
  /// std::runtime_error as view::Server does.
  RunView(const RunViewArguments& args, const std::filesystem::path& recording, const Recording& opened);
  ~RunView();
  RunView(const RunView&) = delete;
  RunView& operator=(const RunView&) = delete;
  RunView(RunView&&) = delete;
  RunView& operator=(RunView&&) = delete;

  /// The estimator that the view can look into: the same estimates, bit for bit.
  [[nodiscard]] MakeEstimator tapped(MakeEstimator make) const;

  /// Call before each sample is handed to `odometry`: in real time it waits until it is time for it.
  void before_sample(const Sample& sample);

  /// Call with the outcome of each frame.
  void after_frame(const ReplayedFrame& frame, const Odometry& odometry);

  /// The run has ended: stays for as long as was asked for. One line about what came.
  [[nodiscard]] std::string finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ear::tools
