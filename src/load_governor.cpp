#include "src/load_governor.h"

#include <algorithm>

namespace ear {
namespace {

constexpr int kMean = 8;            // frames whose mean decides
constexpr double kEasy = 0.6;       // of the budget: below it the step before might do
constexpr int kFirstWait = 48;      // frames below it until that is tried
constexpr int kLongestWait = 1536;  // the same after it was tried in vain

}  // namespace

void LoadGovernor::add(double cost) {
  if (!(budget_ > 0.0)) return;
  sum_ += cost;
  ++since_back_;
  ++frames_;
  if (frames_ < kMean && sum_ <= kMean * budget_) return;  // whatever follows would change nothing
  const double mean = sum_ / frames_;
  sum_ = 0.0;
  frames_ = 0;
  if (mean > budget_) {
    if (was_back_ && since_back_ <= wait_frames_) wait_frames_ = std::min(2 * wait_frames_, kLongestWait);
    was_back_ = false;
    go_to(std::min(step_ + 1, kLastStep));
    return;
  }
  easy_frames_ = mean < kEasy * budget_ ? easy_frames_ + kMean : 0;
  if (step_ == 0 || easy_frames_ < wait_frames_) {
    if (was_back_ && since_back_ > wait_frames_) {  // the last step back was right
      was_back_ = false;
      wait_frames_ = kFirstWait;
    }
    return;
  }
  was_back_ = true;
  since_back_ = 0;
  go_to(step_ - 1);
}

void LoadGovernor::go_to(int step) {
  step_ = step;
  easy_frames_ = 0;
  wait_frames_ = std::max(wait_frames_, kFirstWait);
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
