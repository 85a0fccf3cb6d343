#include "filter/sources/cameras/parallax.h"

#include <Eigen/Geometry>
#include <limits>

#include "filter/ingest/median.h"

namespace ear {
namespace {
constexpr double kCommonShare = 0.5;  // of a frame's features, that its elder must have seen
}

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
  if (static_cast<double>(scratch.size()) < kCommonShare * static_cast<double>(seen) || scratch.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  return upper_median(scratch);
}

}  // namespace ear
