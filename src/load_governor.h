// How much is left out so that frames cost no more than they may. It reads no clock: the cost of each frame is given.
#pragma once

#include <optional>

#include "ear/types.h"

namespace ear {

/// How much work is done for a frame; all of it, unless a step leaves some out.
struct LoadLimits {
  int max_features = 0;
  int window = 0;        ///< clones kept
  int stereo_every = 1;  ///< of the frames that are used, each so-many-th has its right image looked at
  int frame_every = 1;   ///< each so-many-th frame is used
};

/// Steps in the order in which work is left out: features, clones, stereo rate, frame rate. Each keeps what those
/// before it left.
class LoadGovernor {
 public:
  static constexpr int kLastStep = 7;

  /// `budget` [s] for a frame in the mean, of those left out too; 0: no limit. `full`: the limits of step 0.
  LoadGovernor(double budget, const LoadLimits& full) : budget_(budget), full_(full) {}

  /// After each frame: what it cost [s], 0 if it was left out; its stamp. One step further where the mean of the last
  /// frames is over the budget; one step back where it was far below for long enough. A step back that has to be taken
  /// again makes the next wait twice as long.
  void add(double cost, TimeNs t_ns);

  [[nodiscard]] int step() const { return step_; }
  [[nodiscard]] LoadLimits limits() const;

 private:
  void go_to(int step);

  double budget_;
  LoadLimits full_;
  int step_ = 0;
  double sum_ = 0.0;       // of the costs since the last decision [s]
  int frames_ = 0;         // that it is of
  TimeNs duration_ = 0;    // over which these came [ns]
  TimeNs easy_ = 0;        // for how long the means are far below the budget [ns]
  TimeNs wait_ = 0;        // so long they must be, until the next step back [ns]
  TimeNs since_back_ = 0;  // since the last step back [ns]
  std::optional<TimeNs> last_ns_;
  bool was_back_ = false;  // there was one
};

}  // namespace ear
