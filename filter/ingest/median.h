#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace ear {

/// The middle one; of an even number the larger of the two. Changes the order of `values`, which must not be empty.
[[nodiscard]] inline double upper_median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace ear
