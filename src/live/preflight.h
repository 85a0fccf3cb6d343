// A check by hand before the first flight: the vehicle is lifted, pushed, turned and rolled, with a rest between two
// movements, and the sensors must tell the same of each.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "src/live/live_estimator.h"

namespace ear::live {

/// One thing that must be right.
struct PreflightItem {
  enum class Result { missing, right, wrong } result = Result::missing;
  std::string name;
  std::string words;  ///< what was measured; what to do, while it is missing
};

/// Looks at pairs of rests, and at what the sensors say of the movement between them. Each sensor's thread may add. The
/// estimates it is given should rest on cameras and inertial sensors alone, so that wheels and beams are compared with
/// something else.
class Preflight {
 public:
  explicit Preflight(const Calibration& calibration);

  void add(const ImuSample& sample);
  void add(const EncoderSample& sample);
  void add(const QueuedOdometry::Ranges& ranges);
  /// `learned`: the calibration in use, of which the camera's time offset is looked at.
  void add(const LiveFrame& frame, const Calibration& learned);

  /// All of them, in the order in which they are best done.
  [[nodiscard]] std::vector<PreflightItem> items() const;
  /// Those that changed since it was asked last.
  [[nodiscard]] std::vector<PreflightItem> news();

 private:
  /// Half a second in which nothing moved.
  struct Rest {
    Eigen::Vector3d accel_B = Eigen::Vector3d::Zero();
    Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();  ///< the bias, then
    std::array<double, 2> wheel{};                     ///< [m] rolled since the beginning
    std::array<double, QueuedOdometry::kMaxBeams> range{};
    std::optional<NavState> state;
  };
  /// What is summed up over half a second.
  struct Window {
    int samples = 0;
    TimeNs begin_ns = 0;
    Eigen::Vector3d accel = Eigen::Vector3d::Zero(), gyro = Eigen::Vector3d::Zero();
    double accel_squares = 0.0, gyro_squares = 0.0;
  };

  void close_window();
  void judge(const Rest& from, const Rest& to);
  void judge_rest(const Rest& rest);
  void judge_lift(const Rest& from, const Rest& to);
  void judge_push(const Rest& from, const Rest& to);
  void judge_turn(const Rest& from, const Rest& to);
  void judge_roll(const Rest& from, const Rest& to);
  void set(const std::string& name, bool right, const std::string& words);

  Calibration calibration_;
  mutable std::mutex mutex_;  ///< of all that follows
  std::vector<PreflightItem> items_;
  std::vector<bool> changed_;
  Window window_;
  std::optional<TimeNs> last_ns_;
  Eigen::Matrix3d R_rest_ = Eigen::Matrix3d::Identity();  ///< body now to body at the last rest
  std::optional<Rest> rest_;                              ///< the last one
  Rest now_;                                              ///< the newest values of all sensors
  std::optional<EncoderSample> first_count_;
};

}  // namespace ear::live
