// The features of the window: which clone saw which feature where.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ear/types.h"

namespace ear {

/// One feature seen from one clone, in normalized coordinates.
struct TrackObservation {
  std::uint64_t frame = 0;  ///< Clone::frame of the clone that saw it
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  bool has_right = false;
};

/// Clones that must have seen a feature: fewer show no parallax.
inline constexpr std::size_t kMinObservations = 2;

struct Track {
  std::uint64_t id = 0;
  std::vector<TrackObservation> observations;  ///< oldest first
};

/// A frame, and camera 0's rotation in it.
struct FrameRotation {
  std::uint64_t frame = 0;
  Eigen::Matrix3d R_WC0 = Eigen::Matrix3d::Identity();
};

/// All tracks of the window, by id. Memory of ended tracks is used again.
class TrackTable {
 public:
  /// Takes the memory for so many tracks of so many observations each. More than that make it grow.
  explicit TrackTable(std::size_t tracks = 0, std::size_t observations = 0);

  /// Appends the frame's observations; features not seen before start a track. Ids within a frame are distinct.
  void add(std::uint64_t frame, const std::vector<FeatureObservation>& features);

  /// Drops all observations of that frame; tracks without any left end.
  void forget_frame(std::uint64_t frame);

  /// Keeps the tracks for which `keep(track)` is true.
  template <typename Predicate>
  void keep_if(const Predicate& keep) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!keep(static_cast<const Track&>(tracks_[i]))) continue;
      if (kept != i) std::swap(tracks_[kept], tracks_[i]);
      ++kept;
    }
    size_ = kept;
  }

  /// How far features moved from one frame to another beyond what the rotation alone does: the median over the common
  /// ones, in normalized coordinates. Infinite where they are few: a frame that most of the other's features never saw
  /// is no elder of theirs, however little the vehicle moved.
  [[nodiscard]] double median_parallax(const FrameRotation& from, const FrameRotation& to) const;

  void clear() { size_ = 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const Track& operator[](std::size_t i) const { return tracks_[i]; }
  [[nodiscard]] Track& operator[](std::size_t i) { return tracks_[i]; }
  [[nodiscard]] const Track* begin() const { return tracks_.data(); }
  [[nodiscard]] const Track* end() const { return tracks_.data() + size_; }

 private:
  std::vector<Track> tracks_;  ///< the first size_ are alive, ids ascending
  std::size_t size_ = 0;
  mutable std::vector<double> parallax_;  // memory that is used again
};

}  // namespace ear
