// estimate.tum and states.csv of a live process, as `ear run` writes them.
#pragma once

#include <filesystem>
#include <memory>

#include "src/live/live_estimator.h"
#include "src/recording/writers.h"

namespace ear::live {

class EstimateFiles {
 public:
  /// Creates the folder and the files; nothing where `folder` is empty. Throws InputError.
  explicit EstimateFiles(const std::filesystem::path& folder);

  /// By the estimator's thread. A full disk ends the files, not the estimate, and is logged.
  void take(const LiveFrame& frame);

 private:
  std::unique_ptr<TumWriter> trajectory_;
  std::unique_ptr<StatesWriter> states_;
};

}  // namespace ear::live
