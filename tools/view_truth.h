// The truth beside an estimate as it comes: in the estimate's world, aligned once, at the first estimate.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>

#include "ear/estimate.h"
#include "tools/evaluation/trajectory.h"

namespace ear::tools {

class ViewTruth {
 public:
  /// Of a recording's folder; there is none where the recording has none. Throws as evaluation::read_truth() does.
  explicit ViewTruth(const std::filesystem::path& recording);

  [[nodiscard]] bool known() const { return !poses_.empty(); }

  /// The true position at the state's time, in the world of the estimate [m]; nothing outside of the truth's time. The
  /// first call with a truth aligns position and yaw.
  [[nodiscard]] std::optional<Eigen::Vector3d> at(const NavState& state);

 private:
  [[nodiscard]] std::optional<evaluation::Pose> pose_at(TimeNs t_ns) const;

  evaluation::Trajectory poses_;
  std::optional<Eigen::Isometry3d> T_ET_;  ///< the truth's world in the estimate's
};

}  // namespace ear::tools
