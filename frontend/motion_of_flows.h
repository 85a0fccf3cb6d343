// A camera's motion from few flows or from many: what the consensus of flow_check.h is made of.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "frontend/flow_check.h"

namespace ear {

/// Gauss-Newton over rotation and translation from `motion` on, on the flows with depth whose flag in `used` is set:
/// `steps` at most, until one moves no flow by more than `settled` of normalized coordinates. Nothing if they diverge.
[[nodiscard]] std::optional<Transfer> refine_motion(const std::vector<Flow>& flows,
                                                    const std::vector<std::uint8_t>& used, Transfer motion, int steps,
                                                    double settled);

/// Gauss-Newton over rotation, from that of `motion` on, and direction of the translation, a unit vector, on the flows
/// whose flag in `used` is set, whatever their depths: a point stays in the plane of its ray and the translation,
/// p . (x1 x R x0) = 0. Five flows determine it. Nothing if they diverge.
[[nodiscard]] std::optional<Transfer> refine_turn(const std::vector<Flow>& flows, const std::vector<std::uint8_t>& used,
                                                  Transfer motion, int steps);

/// Translation [m] from two flows with depth and a known rotation.
[[nodiscard]] std::optional<Eigen::Vector3d> solve_translation(const std::vector<Flow>& flows, std::size_t a,
                                                               std::size_t b, const Eigen::Matrix3d& R_10);

/// Direction of the translation, a unit vector, from two flows without depth and a known rotation.
[[nodiscard]] std::optional<Eigen::Vector3d> solve_direction(const std::vector<Flow>& flows, std::size_t a,
                                                             std::size_t b, const Eigen::Matrix3d& R_10);

}  // namespace ear
