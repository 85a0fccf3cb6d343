#include "src/load_governor.h"

#include <algorithm>

namespace ear {
namespace {

constexpr int kMean = 8;                          // frames whose mean decides
constexpr double kEasy = 0.6;                     // of the budget: below it the step before might do
constexpr TimeNs kFirstWait = 1'600'000'000;      // [ns] below it until that is tried
constexpr TimeNs kLongestWait = 51'200'000'000;   // [ns] the same after it was tried in vain
constexpr TimeNs kLongestInterval = 250'000'000;  // [ns] between frames, that counts: longer ones are outages

}  // namespace

void LoadGovernor::add(double cost, TimeNs t_ns) {
  if (!(budget_ > 0.0)) return;
  const TimeNs interval = std::clamp(last_ns_ ? duration_ns(*last_ns_, t_ns) : 0, TimeNs{0}, kLongestInterval);
  last_ns_ = t_ns;
  sum_ += cost;
  ++frames_;
  duration_ += interval;
  since_back_ += interval;
  if (frames_ < kMean && sum_ <= kMean * budget_) return;  // whatever follows would change nothing
  const double mean = sum_ / frames_;
  const TimeNs duration = duration_;
  const TimeNs half = interval / 2;  // times are compared to the nearest frame
  sum_ = 0.0;
  frames_ = 0;
  duration_ = 0;
  if (mean > budget_) {
    if (was_back_ && since_back_ - half <= wait_) wait_ = std::min(2 * wait_, kLongestWait);
    was_back_ = false;
    go_to(std::min(step_ + 1, kLastStep));
    return;
  }
  easy_ = mean < kEasy * budget_ ? easy_ + duration : 0;
  if (step_ == 0 || easy_ + half < wait_) {
    if (was_back_ && since_back_ - half > wait_) {  // the last step back was right
      was_back_ = false;
      wait_ = kFirstWait;
    }
    return;
  }
  was_back_ = true;
  since_back_ = 0;
  go_to(step_ - 1);
}

void LoadGovernor::go_to(int step) {
  step_ = step;
  easy_ = 0;
  wait_ = std::max(wait_, kFirstWait);
}

LoadLimits LoadGovernor::limits() const {
  LoadLimits limits = full_;
  if (step_ >= 1) limits.max_features = std::max(1, 2 * full_.max_features / 3);
  if (step_ >= 2) limits.max_features = std::max(1, full_.max_features / 2);
  if (step_ >= 3) limits.window = std::max(3, 2 * full_.window / 3);
  if (step_ >= 4) limits.stereo_every = 2;
  if (step_ >= 5) limits.frame_every = 2;
  if (step_ >= 6) limits.frame_every = 3;
  if (step_ >= 7) limits.frame_every = 4;
  return limits;
}

}  // namespace ear
