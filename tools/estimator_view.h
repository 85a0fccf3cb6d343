// An estimator that is shown in a browser, whether a recording or a vehicle feeds it (docs/view.md).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "ear/odometry.h"
#include "src/view/feature_tap.h"
#include "src/view/feed.h"
#include "src/view/server.h"
#include "tools/view_options.h"

namespace ear::tools {

/// All but finish() and the constructor on the estimator's thread.
class EstimatorView {
 public:
  /// Serves from now on, and prints where. Throws std::invalid_argument and std::runtime_error as view::Server does.
  EstimatorView(const ViewArguments& args, const view::Description& description);

  /// The estimator that the view can look into: the same estimates, bit for bit.
  [[nodiscard]] MakeEstimator tapped(MakeEstimator make) const { return view::tapped(std::move(make), tap_); }

  /// Is it time for another moment? Ask before making one.
  [[nodiscard]] bool due() const { return feed_.due(); }
  /// All but truth, images and features.
  [[nodiscard]] view::Moment moment(TimeNs t_ns, const std::optional<Estimate>& estimate,
                                    const Odometry& odometry) const;
  /// Of the frame that the estimator saw last.
  void add_images(const StereoFrame& frame, std::shared_ptr<const void> pixels, view::Moment& moment) const;
  void offer(view::Moment moment) { feed_.offer(std::move(moment)); }

  /// Nothing comes any more; the page stays.
  void finish() { feed_.finish(); }
  /// One line about what came.
  [[nodiscard]] std::string counts() const;

 private:
  std::shared_ptr<view::FeatureTap> tap_ = std::make_shared<view::FeatureTap>();
  view::Feed feed_;
  view::Server server_;  ///< last: its threads read the feed
};

}  // namespace ear::tools
