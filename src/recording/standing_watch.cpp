#include "src/recording/standing_watch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ear {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLeastPath = 0.005;  // [m] by which a wheel turns at rest: springs, play of the gears
constexpr double kMostSigmas = 6.0;   // standard deviations of one reading
constexpr double kSlack = 0.1;        // [s] at both ends of a second: sensors do not begin together
constexpr double kGap = 0.5;          // [s] without a reading: nobody saw what happened
constexpr int kBlock = 16;            // [px] of an image
constexpr float kChange = 5.0F;       // [grey levels] of a block's mean, more than the change of all
constexpr double kChangedShare =
    0.05;  // of the blocks: motors that idle shake less, a frame of motion changes half of them
constexpr float kLeastContrast = 5.0F;  // [grey levels] among the blocks: a covered lens sees no motion

// Does [from, to] hold [begin, end], but for the slack?
bool covers(TimeNs begin_ns, TimeNs end_ns, TimeNs from_ns, TimeNs to_ns) {
  return seconds_between(begin_ns, from_ns) <= kSlack && seconds_between(to_ns, end_ns) <= kSlack;
}

// Counts between two readings of a wheel, in either direction.
double distance(std::int64_t a, std::int64_t b, const EncoderCalibration& wheels) {
  const double counts = std::abs(static_cast<double>(a) - static_cast<double>(b));
  return wheels.wraps ? std::abs(std::remainder(counts, static_cast<double>(wheels.resolution))) : counts;
}

// Means of the blocks that lie within the image as a whole.
void to_blocks(const ImageView& image, std::vector<float>& blocks) {
  blocks.clear();
  for (int v = 0; v + kBlock <= image.height; v += kBlock) {
    for (int u = 0; u + kBlock <= image.width; u += kBlock) {
      int sum = 0;
      for (int row = v; row < v + kBlock; ++row) {
        const std::uint8_t* const pixels = image.data + row * image.stride + u;
        for (int i = 0; i < kBlock; ++i) sum += pixels[i];
      }
      blocks.push_back(static_cast<float>(sum) / static_cast<float>(kBlock * kBlock));
    }
  }
}

// Of values that are not empty; reorders them.
float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool has_contrast(const std::vector<float>& blocks) {
  if (blocks.empty()) return false;
  float mean = 0.0F;
  for (const float block : blocks) mean += block / static_cast<float>(blocks.size());
  float variance = 0.0F;
  for (const float block : blocks) variance += (block - mean) * (block - mean) / static_cast<float>(blocks.size());
  return variance >= kLeastContrast * kLeastContrast;
}

}  // namespace

void StandingWatch::Witness::see(TimeNs t_ns, bool changed) {
  const bool gap = whole && seconds_between(whole->end_ns, t_ns) > kGap;
  if (gap) gaps.push_back({whole->end_ns, t_ns});
  if (!whole) whole = Interval{t_ns, t_ns};
  whole->end_ns = t_ns;
  if (changed || gap || rests.empty()) {
    // Most rests last for one reading only, while the vehicle moves.
    if (!rests.empty() && rests.back().begin_ns == rests.back().end_ns) rests.pop_back();
    rests.push_back({t_ns, t_ns});
  }
  rests.back().end_ns = t_ns;
}

bool StandingWatch::Witness::saw(TimeNs begin_ns, TimeNs end_ns) const {
  if (!whole || end_ns <= whole->begin_ns || begin_ns >= whole->end_ns) return false;
  return std::none_of(gaps.begin(), gaps.end(),
                      [&](const Interval& gap) { return gap.begin_ns <= begin_ns && end_ns <= gap.end_ns; });
}

bool StandingWatch::Witness::rested(TimeNs begin_ns, TimeNs end_ns) const {
  return std::any_of(rests.begin(), rests.end(),
                     [&](const Interval& rest) { return covers(begin_ns, end_ns, rest.begin_ns, rest.end_ns); });
}

void StandingWatch::add(const EncoderSample& sample, const EncoderCalibration& wheels) {
  const auto turned = [&](std::int64_t now, std::int64_t before, double radius) {
    const double counts = distance(now, before, wheels);
    const double path = counts / static_cast<double>(wheels.resolution) * 2.0 * kPi * radius;
    return counts > kMostSigmas * wheels.noise_counts && !(path < kLeastPath);
  };
  const bool changed = !still_ || turned(sample.left_count, still_->left_count, wheels.wheel_radius[0]) ||
                       turned(sample.right_count, still_->right_count, wheels.wheel_radius[1]);
  if (changed) still_ = sample;
  wheels_.see(sample.t_ns, changed);
}

void StandingWatch::add(TimeNs t_ns, const ImageView& image) {
  to_blocks(image, blocks_);
  bool changed = blocks_.size() != reference_.size() || !has_contrast(blocks_);
  if (!changed) {
    changes_.clear();
    for (std::size_t i = 0; i < blocks_.size(); ++i) changes_.push_back(blocks_[i] - reference_[i]);
    sorted_ = changes_;
    const float common = median(sorted_);  // the exposure
    const auto count = std::count_if(changes_.begin(), changes_.end(),
                                     [common](float change) { return std::abs(change - common) > kChange; });
    changed = static_cast<double>(count) > kChangedShare * static_cast<double>(changes_.size());
  }
  if (changed) reference_ = blocks_;
  images_.see(t_ns, changed);
}

bool StandingWatch::stood(TimeNs begin_ns, TimeNs end_ns) const {
  const bool wheels = wheels_.saw(begin_ns, end_ns);
  const bool images = images_.saw(begin_ns, end_ns);
  return (wheels || images) && (!wheels || wheels_.rested(begin_ns, end_ns)) &&
         (!images || images_.rested(begin_ns, end_ns));
}

}  // namespace ear
