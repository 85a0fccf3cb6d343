#include "filter/sources/cameras/window_rule.h"

#include <algorithm>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr int kLeastWindow = 3;          // chosen: clones, one pair with parallax and the newest
constexpr double kWithoutUpdates = 0.6;  // [s] measured, docs/decisions: the state may do without for so long

}  // namespace

WindowRule::WindowRule(const FilterConfig& config, double focal_px)
    : max_size_(config.window), keyframe_parallax_px_(config.keyframe_parallax_px), focal_px_(focal_px) {
  set_size(max_size_);
}

void WindowRule::set_size(int clones) { size_ = static_cast<std::size_t>(std::clamp(clones, kLeastWindow, max_size_)); }

void WindowRule::add_updates(int features, TimeNs t_ns) {
  features_ += features;
  if (features_ < kFewFeatures) return;
  features_ = 0;
  updated_ns_ = t_ns;
}

void WindowRule::reset() {
  updated_ns_.reset();
  features_ = 0;
}

/// The clone before the newest goes if it shows little that its elder does not; else the oldest. Turning on the spot
/// thus fills no window with copies. Where all of the window shows one place, as while a vehicle shakes on its legs,
/// there is nothing to keep, and the oldest goes: tracks are only used when they end or it goes. Neither may happen for
/// long where a vehicle sways to and fro and sees the same all the time: then the oldest goes too.
std::optional<std::size_t> WindowRule::to_marginalise(const State& x, const TrackTable& tracks) const {
  const std::size_t n = x.clones.size();
  if (n <= size_) return std::nullopt;
  const auto same_place = [&](const Clone& a, const Clone& b) {
    return parallax_px(a, b, x, tracks) < keyframe_parallax_px_;
  };
  const bool copy = same_place(x.clones[n - 3], x.clones[n - 2]);
  const bool without_updates = !updated_ns_ || seconds_between(*updated_ns_, x.imu.t_ns) > kWithoutUpdates;
  return copy && !without_updates && !same_place(x.clones.front(), x.clones.back()) ? n - 2 : 0;
}

double WindowRule::parallax_px(const Clone& from, const Clone& to, const State& x, const TrackTable& tracks) const {
  const Eigen::Matrix3d& R_BC0 = x.camera.T_BC0.R;
  return focal_px_ * tracks.median_parallax({from.frame, from.T_WB.R * R_BC0}, {to.frame, to.T_WB.R * R_BC0});
}

}  // namespace ear
