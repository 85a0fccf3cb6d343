#include "filter/sources/cameras/earlier_views.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

/// Calls both(a, b) for what has the same id in both, which are by id.
template <typename Seen, typename Function>
void for_each_common(const std::vector<Seen>& from, const std::vector<Seen>& to, const Function& both) {
  auto a = from.begin();
  for (const Seen& b : to) {
    while (a != from.end() && a->id < b.id) ++a;
    if (a == from.end()) return;
    if (a->id == b.id) both(*a, b);
  }
}

}  // namespace

EarlierViews::EarlierViews(std::size_t clones) : views_(clones) {
  for (View& view : views_) view.seen.reserve(kFeatureCapacity);
  features_.features.reserve(kFeatureCapacity);
}

void EarlierViews::add(std::uint64_t frame, const std::vector<FeatureObservation>& features) {
  if (size_ == views_.size()) views_.emplace_back();
  View& view = views_[size_++];
  view.frame = frame;
  view.seen.clear();
  for (const FeatureObservation& feature : features) view.seen.push_back({feature.id, feature.left});
  std::sort(view.seen.begin(), view.seen.end(), [](const Seen& a, const Seen& b) { return a.id < b.id; });
}

void EarlierViews::forget(std::uint64_t frame) {
  const auto end = views_.begin() + static_cast<std::ptrdiff_t>(size_);
  const auto found = std::find_if(views_.begin(), end, [frame](const View& view) { return view.frame == frame; });
  if (found == end) return;
  std::rotate(found, std::next(found), end);
  --size_;
}

void EarlierViews::clear() { size_ = 0; }

const EarlierViews::View* EarlierViews::view_of(const Clone& clone) const {
  const auto end = views_.begin() + static_cast<std::ptrdiff_t>(size_);
  const auto found = std::find_if(views_.begin(), end, [&clone](const View& v) { return v.frame == clone.frame; });
  return found == end ? nullptr : &*found;
}

/// A motion p shows in the images of n features by as much as depths over the way b do: its variance is in proportion
/// to (1 + 2 p^2 / b^2) / n (stereo_motion.cpp).
bool EarlierViews::find(const State& x, const Covariance& P, double distance) {
  if (x.clones.empty()) return false;
  const std::size_t newest = x.clones.size() - 1;
  const View* const now = view_of(x.clones[newest]);
  if (now == nullptr) return false;
  const auto camera_of = [&x](std::size_t clone) { return x.clones[clone].T_WB * x.camera.T_BC0; };
  const Pose T_WC0 = camera_of(newest);
  std::pair<const View*, std::size_t> best{nullptr, 0};
  double most = 0.0;
  for (std::size_t k = 0; k < newest; ++k) {
    const View* const view = view_of(x.clones[k]);
    if (view == nullptr) continue;
    int common = 0;
    for_each_common(view->seen, now->seen, [&](const Seen&, const Seen&) { ++common; });
    const double baseline = (camera_of(k).p - T_WC0.p).squaredNorm();
    const double worth = common * baseline / (baseline + 2.0 * distance * distance);
    if (common < kFewFeatures || !(worth > most)) continue;
    most = worth;
    best = {view, k};
  }
  if (best.first == nullptr) return false;
  features_.features.clear();
  for_each_common(best.first->seen, now->seen, [&](const Seen& a, const Seen& b) {
    features_.features.push_back({b.id, b.left, a.left, true});
  });
  const Pose T_WC1 = camera_of(best.second);
  cameras_ = x.camera;
  cameras_.T_C0C1 = T_WC0.inverse() * T_WC1;
  cameras_.lens_error[1] = cameras_.lens_error[0];
  const Eigen::Vector3d along = (T_WC1.p - T_WC0.p).normalized();
  const auto entry = [](std::size_t clone) { return err::clone(static_cast<int>(clone)); };
  const Eigen::Matrix3d of_way = P.of_way({entry(newest), T_WC0.p}, {entry(best.second), T_WC1.p});
  scale_variance_ = along.dot(of_way * along) / cameras_.T_C0C1.p.squaredNorm();
  return true;
}

}  // namespace ear
