// What the view shows of one instant, and of the whole run. docs/view.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/types.h"

namespace ear::view {

/// What the estimator made of a feature when it last tested what was seen of it.
enum class FeatureUse : std::uint8_t { none_yet, used, refused };

/// A feature as the cameras see it.
struct SeenFeature {
  std::uint64_t id = 0;
  Eigen::Vector2d left = Eigen::Vector2d::Zero();   ///< normalized coordinates
  Eigen::Vector2d right = Eigen::Vector2d::Zero();  ///< the same, where both cameras see it
  int age = 0;                                      ///< frames since it was seen first
  bool stereo = false;                              ///< seen by both cameras
  FeatureUse use = FeatureUse::none_yet;
  bool ended = false;  ///< it is not in this frame any more; this is where it was in the one before
};

/// One instant. All is copied but the images, which `pixels` keeps.
struct Moment {
  TimeNs t_ns = 0;                   ///< of the frame
  std::optional<Estimate> estimate;  ///< nothing before the start, and while lost
  Health health;                     ///< also where there is no estimate
  InputCounts counts;
  StageTimes stages;                     ///< of this frame [s]
  std::vector<double> ranges;            ///< last ones of the lasers [m]
  std::optional<Eigen::Vector3d> truth;  ///< position, in the world of the estimate [m]
  std::vector<SeenFeature> features;
  ImageView left, right;
  std::shared_ptr<const void> pixels;
};

/// What stays the same over a run.
struct Description {
  std::string title;  ///< the recording, or the vehicle
  Calibration calibration;
  bool has_truth = false;
  bool live = false;
};

}  // namespace ear::view
