// Which clone goes when the window is full. docs/filter.md, "Window".
#pragma once

#include <optional>

#include "ear/filter_config.h"
#include "filter/ekf/state.h"
#include "filter/sources/cameras/tracks.h"

namespace ear {

class WindowRule {
 public:
  /// `focal_px`: pixels per unit of normalized image coordinates.
  WindowRule(const FilterConfig& config, double focal_px);

  /// Keeps no more than so many clones from now on, at least 3 and at most FilterConfig::window.
  void set_size(int clones);
  [[nodiscard]] std::size_t size() const { return size_; }

  /// The index of the clone to marginalise; nothing while there is room.
  [[nodiscard]] std::optional<std::size_t> to_marginalise(const State& x, const TrackTable& tracks) const;

  /// So many features updated the state at `t_ns`.
  void add_updates(int features, TimeNs t_ns);
  /// The state is as well known as if features had updated it: it stands, or the oldest clone went.
  void set_updated(TimeNs t_ns) { updated_ns_ = t_ns; }
  void reset();

 private:
  [[nodiscard]] double parallax_px(const Clone& from, const Clone& to, const State& x, const TrackTable& tracks) const;

  int max_size_;
  double keyframe_parallax_px_;
  double focal_px_;
  std::size_t size_ = 0;
  std::optional<TimeNs> updated_ns_;  ///< when features last showed enough of where the vehicle is
  int features_ = 0;                  ///< used since then
};

}  // namespace ear
