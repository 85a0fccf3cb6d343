#include "filter/health/image_health.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"
#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

constexpr double kSomeOff = 0.1;        // chosen: of the features off their place; a camera may be faulty
constexpr double kTracksMemory = 20.0;  // [s] chosen

/// Are clearly more than kSomeOff of so many features off their place? `share`: those that are.
bool some_off(double share, int features) {
  return share > kSomeOff + kClear * std::sqrt(kSomeOff * (1.0 - kSomeOff) / features);
}

/// Left and right are exchanged: the stereo features seem to be behind the cameras.
bool crossed(const FrameAgreement& seen) { return seen.behind > kMajority; }

}  // namespace

void StampWatch::add(TimeNs stamp_ns) {
  const TimeNs imu_ns = imu_ns_.value_or(stamp_ns);
  const double passed = std::clamp(seconds_between(came_ns_, imu_ns) / kSlopeMemory, 0.0, 1.0);
  const double share = std::max(passed, 1.0 / (count_ + 1));
  came_ns_ = imu_ns;
  const double off = seconds_between(imu_ns, stamp_ns) - usual_;
  const double limit = std::max(kClockJump, kClear * std::sqrt(variance_)) + imu_step_;
  unusual_ = count_ >= kToKnow && std::abs(off) > limit;
  if (unusual_ && stamp_ns > imu_ns) add_ahead();
  const double counted = std::clamp(off, -kClockJump, kClockJump);  // what is usual changes slowly
  usual_ += share * counted;
  variance_ += share * (counted * counted - variance_);
  ++count_;
}

bool StampWatch::add_imu(TimeNs t_ns, bool after_loss) {
  imu_step_ = imu_ns_ ? seconds_between(*imu_ns_, t_ns) : 0.0;
  imu_ns_ = t_ns;
  return !std::exchange(ahead_, false) || after_loss;
}

bool ImageHealth::check(const FrameAgreement& seen, TimeNs t_ns) {
  stamps_.add(t_ns);
  const bool elsewhere = seen.matches > 0 && seen.left > kMajority;
  stamps_wrong_ = stamps_.unusual() && (stamps_wrong_ || elsewhere);
  return !crossed(seen) && !stamps_wrong_;
}

void ImageHealth::add(TimeNs t_ns, bool running, const FrameAgreement& seen, const FrameStatistics& statistics) {
  if (arrival_ns_) {
    const double interval = std::min(seconds_between(last_ns_, t_ns), kStale);
    interval_ += (interval_ == 0.0 ? 1.0 : 1.0 / kToKnow) * (interval - interval_);
  }
  last_ns_ = t_ns;
  arrival_ns_ = std::max(t_ns, stamps_.newest_imu().value_or(t_ns));
  if (cameras_ > 0) judge(t_ns, running, seen, statistics);
  late_ = stamps_.unusual() && !stamps_wrong_ && seen.matches > 0 && seen.left < kMajority;
  if (stamps_.late()) report(t_ns);
}

void ImageHealth::hear_imu(TimeNs t_ns, bool after_loss) {
  if (!stamps_.add_imu(t_ns, after_loss)) report(t_ns);
}

void ImageHealth::judge(TimeNs t_ns, bool running, const FrameAgreement& seen, const FrameStatistics& statistics) {
  const bool known = running && seen.matches > 0;
  const int tracks = statistics.tracks;
  const bool blind = tracks < kFewFeatures;
  const bool poor = blind || tracks < kMajority * usual_.tracks || seen.noise > 1.0;
  const double share = std::max(interval_ / kTracksMemory, 1.0 / (1.0 + usual_.images));
  usual_.tracks += share * (tracks - usual_.tracks);
  ++usual_.images;
  const double kept = statistics.standing ? 0.0 : std::exp(-interval_ / kLasting);  // at rest the images show rest
  used_ = kept * used_ + statistics.features_used;
  rejected_ = kept * rejected_ + statistics.features_rejected;
  carrying_.add(blind || misfit() || (known && seen.left > kMajority), t_ns);
  left_.add(poor || misfit() || (known && some_off(seen.left, seen.matches)), t_ns);
  if (cameras_ == 2 && !seen.right_skipped) {
    const bool one_eyed = statistics.stereo < std::max<double>(kFewFeatures, kMajority * usual_.stereo * tracks);
    usual_.stereo += share * (static_cast<double>(statistics.stereo) / std::max(1, tracks) - usual_.stereo);
    right_.add(poor || one_eyed || (known && some_off(seen.right, seen.matches)), t_ns);
  }
  if (crossed(seen)) report(t_ns);
}

void ImageHealth::add_silence(TimeNs t_ns) {
  if (cameras_ > 0) left_.add(true, t_ns);
  if (cameras_ > 1) right_.add(true, t_ns);
  carrying_.add(true, t_ns);
}

void ImageHealth::report(TimeNs t_ns) {
  if (cameras_ > 0) left_.report(t_ns);
  if (cameras_ > 1) right_.report(t_ns);
  carrying_.report(t_ns);
}

bool ImageHealth::misfit() const { return refuses_most(used_, rejected_); }

bool ImageHealth::come(TimeNs t_ns) const {
  return cameras_ > 0 && arrival_ns_ && seconds_between(*arrival_ns_, t_ns) < longest_silence(interval_);
}

}  // namespace ear
