// From light to grey levels: exposure, vignetting, noise, eight bits.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear::simulator {

/// How one frame is exposed; both cameras alike.
struct Exposure {
  double seconds = 0.006;  ///< how long the shutter is open, centred on the stamp
  double gain = 1.0;       ///< brightness relative to the room's own
};

/// Slow changes, as automatic exposure and passing clouds make them: gain 0.75 to 1.25, 5 to 8 ms. `t` [s], any origin.
[[nodiscard]] Exposure exposure_at(double t, std::uint64_t seed);

/// Brightness towards the corners: 1 in the middle, about 0.75 in the corners. One float per pixel.
[[nodiscard]] cv::Mat vignetting(const CameraCalibration& camera);

/// A number that names one picture, from which its noise follows: the same picture gets the same noise on any thread.
[[nodiscard]] std::uint64_t picture_key(std::uint64_t seed, TimeNs t_ns, std::size_t camera);

/// Standard deviation of the noise at a grey level: about 1.5 in the dark and 3 in the light, as of shot and read
/// noise.
[[nodiscard]] double noise_sigma(double grey);

/// Turns grey levels into bytes. Const: threads may share one.
class ImageSensor {
 public:
  ImageSensor();

  /// Grey levels (float) with noise, as bytes. `key` from picture_key().
  [[nodiscard]] cv::Mat read(const cv::Mat& grey, std::uint64_t key) const;

 private:
  std::vector<float> quantiles_;  // of the normal distribution, equally likely
  std::vector<float> sigmas_;     // per grey level
};

}  // namespace ear::simulator
