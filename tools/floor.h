// What tracking through a stereo frame costs at least, with the usual library calls: the yardstick of `ear bench`.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "ear/types.h"

namespace ear::tools {

/// Two image pyramids, one temporal and one stereo pass of pyramidal Lucas-Kanade: 15x15 window, 3 levels above the
/// base, at most 10 iterations. Choosing the points is not part of it.
class Floor {
 public:
  explicit Floor(int points) : points_(points) {}

  /// CPU time of the calling thread for one frame [s]. The first frame has no temporal pass; its time means nothing.
  double measure(const StereoFrame& frame);

 private:
  int points_;
  cv::Mat last_left_;
  std::vector<cv::Mat> last_pyramid_;
};

}  // namespace ear::tools
