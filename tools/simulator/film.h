// A simulated drive with its pictures, in memory.
#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "ear/types.h"
#include "tools/simulator/simulation.h"

namespace ear::simulator {

struct Film {
  Simulation simulation;
  std::vector<std::array<cv::Mat, 2>> pictures;  ///< left and right, one pair per frame

  /// Renders all pictures; feature tracks, which take time too, are not made.
  explicit Film(Options options);

  /// Points at the pictures.
  [[nodiscard]] StereoFrame frame(std::size_t i) const;
};

}  // namespace ear::simulator
