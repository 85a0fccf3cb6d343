// The frames that are estimated together: a bundle adjustment over the last keyframes, (1). docs/smoother.md.
//   unknowns.h   frames and calibration       terms.h      what ties them, and the features they see
//   minimum.h    the solver, the covariance   window.h     how frames come and go, and the prior of those that went
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "ear/filter_config.h"
#include "filter/ekf/state.h"
#include "filter/sources/cameras/tracks.h"
#include "smoother/factor.h"
#include "smoother/interval.h"
#include "smoother/prior_factor.h"
#include "smoother/terms.h"
#include "smoother/unknowns.h"

namespace ear::smoother {

class Window {
 public:
  /// Begins with one frame without features: a state, its calibration, and the covariance of all that in the order of
  /// the filter's error vector (err::).
  Window(const FilterConfig& config, double focal_px, const State& x, const Eigen::Ref<const Eigen::MatrixXd>& P);

  /// Appends a frame, where the inertial samples put it.
  void add(const NewFrame& frame, const std::vector<FeatureObservation>& features);

  /// Minimises (1), and drops features that do not fit. False, and as before, if that comes to nothing.
  [[nodiscard]] bool optimize();

  /// Of the newest frame and the calibration around the present values, in the order of the filter's error vector, zero
  /// for what is no unknown here. Nothing if it cannot be computed.
  [[nodiscard]] std::optional<Eigen::MatrixXd> covariance() const;

  /// With a full window, makes a prior of the oldest frame, or drops the one before the newest.
  void make_room();

  /// What the wheels showed during the last `duration` seconds is wrong.
  void forget_wheels(double duration);

  /// The newest frame's state and the calibration; the ground's normal is none of the unknowns.
  [[nodiscard]] State newest() const;
  [[nodiscard]] std::size_t size() const { return unknowns_.size(); }
  [[nodiscard]] int features_used() const { return static_cast<int>(terms_.points().size()); }
  [[nodiscard]] int features_rejected() const { return features_rejected_; }

 private:
  [[nodiscard]] std::size_t frame_to_drop();
  [[nodiscard]] double parallax_px(std::size_t from, std::size_t to) const;
  void marginalize_oldest();
  void drop_frame(std::size_t index);
  void set_prior(std::unique_ptr<PriorFactor> prior);

  FilterConfig config_;
  double focal_px_;
  Unknowns unknowns_;
  TrackTable tracks_;
  Terms terms_;
  Factor prior_;
  int features_rejected_ = 0;
};

}  // namespace ear::smoother
