#include "filter/sources/cameras/parallax.h"

#include <Eigen/Geometry>
#include <limits>

#include "filter/ingest/median.h"
#include "filter/sources/cameras/frame_agreement.h"

namespace ear {

/// Nothing is known where the elder frame did not see most of the features.
double median_parallax(const TrackTable& tracks, const FrameRotation& from, const FrameRotation& to,
                       std::vector<double>& scratch) {
  const Eigen::Matrix3d R_to_from = to.R_WC0.transpose() * from.R_WC0;
  scratch.clear();
  std::size_t seen = 0;  // features in `to`
  for (const Track& track : tracks) {
    const TrackObservation* a = nullptr;
    const TrackObservation* b = nullptr;
    for (const TrackObservation& o : track.observations) {
      if (o.frame == from.frame) a = &o;
      if (o.frame == to.frame) b = &o;
    }
    seen += b != nullptr ? 1 : 0;
    if (a == nullptr || b == nullptr) continue;
    const Eigen::Vector3d turned = R_to_from * a->left.homogeneous();
    scratch.push_back((b->left - turned.hnormalized()).norm());
  }
  if (static_cast<double>(scratch.size()) < kMajority * static_cast<double>(seen) || scratch.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  return upper_median(scratch);
}

}  // namespace ear
