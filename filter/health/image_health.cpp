#include "filter/health/image_health.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/evidence.h"
#include "filter/ingest/silence.h"
#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

constexpr double kSomeOff = 0.1;        // chosen: of the features off their place; a camera may be faulty
constexpr double kSparse = 0.4;         // chosen: of the usual number of features, or of the left camera's
constexpr double kTracksMemory = 20.0;  // [s] chosen

/// Left and right are exchanged: the stereo features seem to be behind the cameras.
bool crossed(const FrameAgreement& seen) { return seen.behind > kMajority; }

}  // namespace

bool ImageHealth::check(const FrameAgreement& seen, TimeNs t_ns, TimeNs newest_imu_ns) {
  stamps_unusual_ = stamps_.add(t_ns, newest_imu_ns);
  const bool elsewhere = seen.matches > 0 && seen.left > kMajority;
  stamps_wrong_ = stamps_unusual_ && (stamps_wrong_ || elsewhere);
  return !seen.frozen && !crossed(seen) && !stamps_wrong_;
}

void ImageHealth::add(const Image& image) {
  if (arrival_ns_) {
    const double interval = std::min(seconds_between(last_ns_, image.t_ns), kStale);
    interval_ += (interval_ == 0.0 ? 1.0 : 1.0 / kToKnow) * (interval - interval_);
  }
  last_ns_ = image.t_ns;
  arrival_ns_ = std::max(image.t_ns, image.newest_imu_ns);
  if (cameras_ > 0) judge(image);
  late_ = stamps_unusual_ && !stamps_wrong_ && image.seen.matches > 0 && image.seen.left < kMajority;
  if (stamps_unusual_) report(image.t_ns);
}

void ImageHealth::judge(const Image& image) {
  const FrameAgreement& seen = image.seen;
  const bool known = image.running && seen.matches > 0;
  const int tracks = image.statistics.tracks;
  const bool blind = tracks < kFewFeatures;
  const bool poor = blind || tracks < kSparse * usual_tracks_ || seen.noise > 1.0;
  const double share = std::max(interval_ / kTracksMemory, 1.0 / (1.0 + counted_));
  usual_tracks_ += share * (tracks - usual_tracks_);
  ++counted_;
  const double kept = std::exp(-interval_ / kFitMemory);
  used_ = kept * used_ + image.statistics.features_used;
  rejected_ = kept * rejected_ + image.statistics.features_rejected;
  carrying_.add(blind || misfit() || (known && seen.left > kMajority), image.t_ns);
  left_.add(poor || misfit() || (known && seen.left > kSomeOff), image.t_ns);
  if (cameras_ == 2 && !seen.right_skipped) {
    const bool one_eyed = image.statistics.stereo < kSparse * tracks;
    right_.add(poor || one_eyed || (known && seen.right > kSomeOff), image.t_ns);
  }
  if (seen.frozen || crossed(seen)) report(image.t_ns);
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

bool ImageHealth::misfit() const { return rejected_ > used_ && used_ + rejected_ >= kFewFeatures; }

bool ImageHealth::come(TimeNs t_ns) const {
  return cameras_ > 0 && arrival_ns_ && seconds_between(*arrival_ns_, t_ns) < longest_silence(interval_);
}

}  // namespace ear
