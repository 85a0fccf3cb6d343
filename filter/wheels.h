// What the wheel encoders say about the body's velocity. The paper's (5)-(8); docs/filter.md, section 8.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/state.h"

namespace ear {

/// How far the wheels turned relative to the body between two readings.
struct WheelIncrement {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Eigen::Vector2d angle = Eigen::Vector2d::Zero();  ///< left, right, growing as the wheels roll forward [rad]

  [[nodiscard]] double duration() const { return seconds_between(from_ns, to_ns); }
};

/// Turns counts into angles: takes differences, and the wrap out.
class EncoderReader {
 public:
  explicit EncoderReader(const EncoderCalibration& calibration) : calibration_(calibration) {}

  /// The turn since the reading before; nothing for the first. A difference is taken the short way round: wheels must
  /// not turn by more than half a revolution between readings.
  [[nodiscard]] std::optional<WheelIncrement> add(const EncoderSample& sample);

  /// How far the faster wheel turned since the reading before, which must be there [rad].
  [[nodiscard]] double largest_angle(const EncoderSample& sample) const;

  [[nodiscard]] bool any() const { return any_; }
  [[nodiscard]] TimeNs last_ns() const { return last_.t_ns; }
  void clear() { any_ = false; }

 private:
  [[nodiscard]] double angle(std::int64_t from, std::int64_t to) const;

  EncoderCalibration calibration_;
  EncoderSample last_;
  bool any_ = false;
};

/// Columns of a wheel or laser row: from err::nu to the end of the beams.
inline constexpr int kGroundColumns = err::camera - err::nu;
/// Column of an entry of the error vector in such a row.
[[nodiscard]] constexpr int ground_column(int entry) { return entry - err::nu; }

/// Rows of the odometer, linearized: each predicts zero, and residual = -prediction = H e + n.
struct WheelRows {
  static constexpr int speed = 0;     ///< along the ground, wheels against velocity [m/s]
  static constexpr int side = 1;      ///< along the axle [m/s]
  static constexpr int slope = 2;     ///< through the ground [m/s]
  static constexpr int yaw_rate = 3;  ///< wheels against gyroscope [rad/s]
  static constexpr int size = 4;

  Eigen::Matrix<double, size, 1> residual;
  Eigen::Matrix<double, size, kGroundColumns> H = Eigen::Matrix<double, size, kGroundColumns>::Zero();
  Eigen::Matrix<double, size, 3> J_gyro;  ///< of the prediction by the measured rate
  double wheel_speed = 0.0;               ///< forward speed that the wheels tell [m/s]

  /// In place of the mean of both wheels, one of them and the gyroscope's yaw rate tell the speed. `lever`: where it
  /// stands on the axle, half the track width; negative for the left one [m].
  void take_one_wheel(double lever);
};

/// The odometer's rows at a state that is `v_W` and `R_WB` at the middle of the turn; `gyro_B`: mean measured rate over
/// the turn, bias included. With OdometerModel::terrain: (5) with the body's pitch rate, direction along the ground
/// (6)-(8); otherwise along the body, without it. `normal_known`: false without lasers: the ground is O's own xy-plane.
[[nodiscard]] WheelRows linearize_wheels(const State& x, const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& v_W,
                                         const WheelIncrement& turn, const Eigen::Vector3d& gyro_B, OdometerModel model,
                                         bool normal_known);

}  // namespace ear
