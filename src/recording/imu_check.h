// What the values of an IMU show of the sensor: does it clip, does it hang, how much noise does it have at rest?
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "ear/types.h"

namespace ear {

/// Continuous-time white noise measured at rest.
struct StandingNoise {
  double gyro = 0.0;        ///< [rad/s/sqrt(Hz)]
  double accel = 0.0;       ///< [m/s^2/sqrt(Hz)]
  std::size_t windows = 0;  ///< seconds of rest that it was measured on
};

struct ImuReport {
  std::size_t clipped = 0;                      ///< samples where an axis stays at its extreme value
  std::size_t repeated = 0;                     ///< samples whose six values equal those before
  std::optional<StandingNoise> standing_noise;  ///< nothing where the vehicle was never seen to stand
};

/// Looks at every sample once, in constant memory.
class ImuCheck {
 public:
  void add(const ImuSample& sample);

  /// Did the vehicle stand from begin to end? The IMU alone is as quiet at constant speed.
  using Stood = std::function<bool(TimeNs begin_ns, TimeNs end_ns)>;

  /// Without `stood` nothing is said of the noise at rest.
  [[nodiscard]] ImuReport report(const Stood& stood = {}) const;

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  // The run of samples at one end of an axis' range.
  struct Extreme {
    double value = 0.0;
    std::size_t run = 0;      // samples in a row, now
    std::size_t clipped = 0;  // samples in all runs that are long enough
  };

  // A second in which little changed.
  struct QuietSecond {
    TimeNs begin_ns = 0;
    TimeNs end_ns = 0;
    double gyro = 0.0;  // density, as StandingNoise
    double accel = 0.0;
  };

  void follow_extreme(Extreme& extreme, double value, double floor);
  void follow_rest(const ImuSample& sample);
  void close_window();

  std::array<Extreme, 12> extremes_;  // both ends of six axes
  std::size_t repeated_ = 0;
  std::optional<ImuSample> last_;

  // One second of samples.
  TimeNs window_start_ns_ = 0;
  std::size_t window_count_ = 0;
  Vector6 sum_ = Vector6::Zero();
  Vector6 sum_of_squares_ = Vector6::Zero();
  Vector6 sum_of_steps_ = Vector6::Zero();  // squared differences between neighbours
  double window_s_ = 0.0;
  std::vector<QuietSecond> quiet_;
};

}  // namespace ear
