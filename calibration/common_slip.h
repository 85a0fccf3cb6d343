// Slip of both wheels alike, which their difference does not show: a wheel that pushes turns more than it rolls. A
// reference beside the drive shows it.
#pragma once

#include <optional>
#include <vector>

#include "calibration/batch.h"

namespace ear::calibration {

/// How far the wheels' way is ahead of something else that measures it, at a place along it.
struct Ahead {
  double way = 0.0;    ///< [m] from the start
  double ahead = 0.0;  ///< [m]
};

/// The random walk in it [m/sqrt(m)], beside an offset, a constant scale and white noise: the maximum of the restricted
/// likelihood. `along`: in the order of the way. 0 where white noise explains it as well; nothing where there are too
/// few.
[[nodiscard]] std::optional<double> walk_along(const std::vector<Ahead>& along);

/// Of a segment with a reference, by the batch's present values: what the wheels' way and the reference's differ by.
/// Errors of the reference that last count as slip. Nothing where there is no reference.
[[nodiscard]] std::optional<double> common_slip(const Batch& batch, std::size_t segment, const RollSetting& setting);

}  // namespace ear::calibration
