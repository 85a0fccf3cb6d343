// Does the vehicle stand or roll on the ground, or does it fly? The beams decide: contact is when the plane they hit
// passes the wheel radius below the axle. A strike only makes the decision faster.
// docs/filter.md, "Contact".
#pragma once

#include <Eigen/Core>
#include <bitset>
#include <cstdint>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ekf/state.h"
#include "filter/ingest/wheel_increment.h"
#include "filter/sources/ground/ground_tracker.h"

namespace ear {

enum class ContactMode : std::uint8_t {
  unknown,  ///< no evidence yet, or no wheels that could touch the ground
  ground,   ///< the wheels touch it
  air
};

/// [s] chosen: so long after a touchdown its strike may come, and the wheels do not roll yet.
inline constexpr double kLanding = 0.1;

enum class ContactEvent : std::uint8_t { none, touchdown, takeoff };

/// Samples of all sensors in time order. A vehicle with wheels and without lasers is always on the ground.
class ContactDetector {
 public:
  ContactDetector(const FilterConfig& config, const Calibration& calibration);

  /// Each returns whether the mode has just changed. The first mode after `unknown` is no event.
  ContactEvent add_imu(const ImuSample& sample);
  ContactEvent add_wheels(const WheelIncrement& increment);
  ContactEvent add_laser(const LaserSample& sample);

  /// What to take off the gyroscope's rates [rad/s]; zero is good enough while all beams see the ground.
  void set_gyro_bias(const Eigen::Vector3d& b_g) { b_g_ = b_g; }

  [[nodiscard]] ContactMode mode() const { return mode_; }
  /// When the wheels last left the ground or met it; nothing if that was not seen.
  [[nodiscard]] std::optional<TimeNs> since_ns() const { return since_ns_; }
  /// The plane that the beams see; nothing without wheels or beams.
  [[nodiscard]] const std::optional<GroundTracker>& plane() const { return ground_; }
  /// Of which beams this is true: BeamRepeats::repeats, BeamRepeats::stuck.
  [[nodiscard]] std::bitset<kMaxBeams> beams_that(BeamRepeats::Property property) const {
    return ground_ ? ground_->beams_that(property) : std::bitset<kMaxBeams>{};
  }

 private:
  ContactEvent change(ContactMode mode, TimeNs t_ns);
  ContactEvent look_for_strike(TimeNs t_ns);
  [[nodiscard]] bool lasts(bool holds, TimeNs t_ns, double duration);
  [[nodiscard]] bool height_known() const;
  [[nodiscard]] bool airborne(int agreeing) const;
  [[nodiscard]] bool stands() const;
  void roll(const WheelIncrement& increment);

  ContactConfig config_;
  Eigen::Vector3d y_B_ = Eigen::Vector3d::UnitY();          ///< along the axle, to the left
  std::optional<GroundTracker> ground_;                     ///< none without wheels or lasers
  Eigen::Vector2d wheel_radius_ = Eigen::Vector2d::Zero();  ///< left, right [m]
  Eigen::Vector3d b_g_ = Eigen::Vector3d::Zero();

  ContactMode mode_ = ContactMode::unknown;
  std::optional<TimeNs> since_ns_;
  std::optional<TimeNs> holds_since_ns_;  ///< first reading in a row that speaks for a change
  std::optional<TimeNs> seen_ns_;         ///< last reading that agreed with the plane tracked
  std::optional<TimeNs> last_imu_ns_;
  std::optional<TimeNs> strike_ns_;
  double body_angle_ = 0.0;       ///< about the axle since the last increment [rad], nose-down positive
  double recent_distance_ = 0.0;  ///< rolled just now [m]
  double level_ = 0.0;            ///< height of standing wheels over the plane, which the ground's shape explains [m]
};

}  // namespace ear
