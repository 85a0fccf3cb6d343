#include "filter/sources/cameras/tracks.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "filter/ingest/median.h"
#include "filter/sources/cameras/frame_agreement.h"

namespace ear {

TrackTable::TrackTable(std::size_t tracks, std::size_t observations) : tracks_(tracks) {
  parallax_.reserve(tracks);
  for (Track& track : tracks_) track.observations.reserve(observations);
}

void TrackTable::add(std::uint64_t frame, const std::vector<FeatureObservation>& features) {
  const std::size_t known = size_;
  for (const FeatureObservation& feature : features) {
    Track* const end = tracks_.data() + known;
    Track* track =
        std::lower_bound(tracks_.data(), end, feature.id, [](const Track& t, std::uint64_t id) { return t.id < id; });
    if (track == end || track->id != feature.id) {
      if (size_ == tracks_.size()) tracks_.emplace_back();
      track = &tracks_[size_++];
      track->id = feature.id;
      track->observations.clear();
    }
    track->observations.push_back({frame, feature.left, feature.right, feature.has_right});
  }
  const auto at = [this](std::size_t i) { return tracks_.begin() + static_cast<std::ptrdiff_t>(i); };
  const auto by_id = [](const Track& a, const Track& b) { return a.id < b.id; };
  std::sort(at(known), at(size_), by_id);
  // A feature that was lost in the window and comes back under its old number stands before the newest: rare, so
  // sorted.
  if (!std::is_sorted(at(known == 0 ? 0 : known - 1), at(size_), by_id)) std::sort(at(0), at(size_), by_id);
}

void TrackTable::forget_frame(std::uint64_t frame) {
  for (std::size_t i = 0; i < size_; ++i) {
    auto& observations = tracks_[i].observations;
    observations.erase(std::remove_if(observations.begin(), observations.end(),
                                      [&](const TrackObservation& o) { return o.frame == frame; }),
                       observations.end());
  }
  keep_if([](const Track& track) { return !track.observations.empty(); });
}

double TrackTable::median_parallax(const FrameRotation& from, const FrameRotation& to) const {
  const Eigen::Matrix3d R_to_from = to.R_WC0.transpose() * from.R_WC0;
  parallax_.clear();
  std::size_t seen = 0;  // features in `to`
  for (const Track& track : *this) {
    const TrackObservation* a = nullptr;
    const TrackObservation* b = nullptr;
    for (const TrackObservation& o : track.observations) {
      if (o.frame == from.frame) a = &o;
      if (o.frame == to.frame) b = &o;
    }
    seen += b != nullptr ? 1 : 0;
    if (a == nullptr || b == nullptr) continue;
    const Eigen::Vector3d turned = R_to_from * a->left.homogeneous();
    parallax_.push_back((b->left - turned.hnormalized()).norm());
  }
  if (static_cast<double>(parallax_.size()) < kMajority * static_cast<double>(seen) || parallax_.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  return upper_median(parallax_);
}

}  // namespace ear
