#include "tools/estimator_view.h"

#include <array>
#include <cstdio>

namespace ear::tools {

EstimatorView::EstimatorView(const ViewArguments& args, const view::Description& description)
    : feed_(description), server_({args.address, args.port, args.token}, feed_) {
  const std::string query = args.token.empty() ? "" : "?token=" + args.token;
  std::fprintf(stderr, "view: http://%s:%d/%s\n", args.address.c_str(), server_.port(), query.c_str());
}

view::Moment EstimatorView::moment(TimeNs t_ns, const std::optional<Estimate>& estimate,
                                   const Odometry& odometry) const {
  view::Moment moment;
  moment.t_ns = t_ns;
  moment.estimate = estimate;
  moment.health = odometry.health();
  moment.counts = odometry.input_counts();
  moment.stages = odometry.stage_times();
  moment.ranges = tap_->ranges();
  return moment;
}

void EstimatorView::add_images(const StereoFrame& frame, std::shared_ptr<const void> pixels,
                               view::Moment& moment) const {
  moment.left = frame.left;
  moment.right = frame.right;
  moment.pixels = std::move(pixels);
  moment.features = tap_->features();
}

std::string EstimatorView::counts() const {
  const view::ServerCounts counts = server_.counts();
  std::array<char, 200> line{};
  std::snprintf(
      line.data(), line.size(),
      "view: %llu requests answered, %llu refused, %llu connections too many, %llu cut off; %llu moments dropped",
      static_cast<unsigned long long>(counts.answered), static_cast<unsigned long long>(counts.refused),
      static_cast<unsigned long long>(counts.crowded), static_cast<unsigned long long>(counts.cut_off),
      static_cast<unsigned long long>(feed_.dropped()));
  return line.data();
}

}  // namespace ear::tools
