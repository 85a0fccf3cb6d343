#include "src/live/estimate_files.h"

#include "src/health_text.h"
#include "src/log/log.h"

namespace ear::live {

EstimateFiles::EstimateFiles(const std::filesystem::path& folder) {
  if (folder.empty()) return;
  std::filesystem::create_directories(folder);
  trajectory_ = std::make_unique<TumWriter>(folder / "estimate.tum");
  states_ = std::make_unique<StatesWriter>(folder / "states.csv");
}

void EstimateFiles::take(const LiveFrame& frame) {
  if (!trajectory_ || !frame.estimate) return;
  try {
    trajectory_->write(*frame.estimate);
    states_->write(*frame.estimate, to_text(frame.estimate->health));
  } catch (const std::exception& error) {
    log_error(std::string(error.what()) + ": no more is written");
    trajectory_.reset();
  }
}

}  // namespace ear::live
