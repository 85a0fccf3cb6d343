// The values that go into the estimator: sensor samples, image views, feature tracks.
// Times are integer nanoseconds of one clock; all else is SI. Frames: docs/design.md, section 1.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace ear {

using TimeNs = std::int64_t;

/// Stamps farther from zero than this [ns], 142 years, are no times: differences of two fit 64 bits.
inline constexpr TimeNs kLargestStamp = 4'500'000'000'000'000'000;
[[nodiscard]] constexpr bool is_time(TimeNs t_ns) { return t_ns > -kLargestStamp && t_ns < kLargestStamp; }

/// to - from; the largest or smallest number where the difference is none: stamps come from outside.
[[nodiscard]] constexpr TimeNs duration_ns(TimeNs from, TimeNs to) {
  constexpr TimeNs kLargest = std::numeric_limits<TimeNs>::max();
  constexpr TimeNs kSmallest = std::numeric_limits<TimeNs>::min();
  if (from < 0 && to > kLargest + from) return kLargest;
  if (from > 0 && to < kSmallest + from) return kSmallest;
  return to - from;
}

/// Seconds from `from` to `to`, of any two stamps. The only place where a time becomes floating point: as a difference.
[[nodiscard]] inline double seconds_between(TimeNs from, TimeNs to) {
  return 1e-9 * static_cast<double>(duration_ns(from, to));
}

/// The stamp plus `offset` [s], to the nanosecond; the largest or smallest number where the sum is none. An offset that
/// is no number, or of centuries, changes nothing.
[[nodiscard]] inline TimeNs later_by(double offset, TimeNs stamp_ns) {
  constexpr double kMost = 9e9;  // [s] that 64 bits of nanoseconds hold
  return std::abs(offset) < kMost ? duration_ns(-static_cast<TimeNs>(std::llround(1e9 * offset)), stamp_ns) : stamp_ns;
}

/// One inertial sample, in the body frame B (which is the IMU's frame).
struct ImuSample {
  TimeNs t_ns = 0;
  Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();   ///< angular rate [rad/s]
  Eigen::Vector3d accel_B = Eigen::Vector3d::Zero();  ///< specific force [m/s^2]
};

/// One reading of both wheel encoders: the wheels' angles relative to the body, growing as they roll forward.
struct EncoderSample {
  TimeNs t_ns = 0;
  std::int64_t left_count = 0;
  std::int64_t right_count = 0;
};

/// One reading of all laser beams, in the order of LaserCalibration::beams. A beam without return is NaN.
struct LaserSample {
  TimeNs t_ns = 0;
  std::vector<double> range;  ///< [m]
};

/// A view of an 8-bit grey image that belongs to the caller; it owns nothing.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next

  [[nodiscard]] bool empty() const { return data == nullptr || width <= 0 || height <= 0; }
};

/// The images of one instant, stamped at the middle of the exposure. Without a second camera, `right` is empty.
struct StereoFrame {
  TimeNs t_ns = 0;
  ImageView left;
  ImageView right;
};

/// One feature seen in one frame, in normalized image coordinates: lens removed, (x/z, y/z) in the camera's frame.
struct FeatureObservation {
  std::uint64_t id = 0;  ///< the same number as long as the feature is tracked; never used again
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  bool has_right = false;
};

/// All features of one frame: what a front end hands to the filter.
struct FeatureFrame {
  TimeNs t_ns = 0;
  std::vector<FeatureObservation> features;
  bool right_skipped = false;  ///< they were not searched in the right image, though there is a second camera
  bool repeated = false;       ///< the left image is byte for byte the one before, and the features are as they were
};

}  // namespace ear
