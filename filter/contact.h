// Does the vehicle stand or roll on the ground, or does it fly? The beams decide: contact is when the plane they hit
// passes the wheel radius below the axle. A strike or wheels that are spun up from below only make the decision faster.
// docs/filter.md, section "Contact".
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ground_tracker.h"

namespace ear {

enum class ContactMode : std::uint8_t {
  unknown,  ///< no evidence yet, or no wheels that could touch the ground
  ground,   ///< the wheels touch it
  air
};

enum class ContactEvent : std::uint8_t { none, touchdown, takeoff };

/// Samples of all sensors in time order. A vehicle with wheels and without lasers is always on the ground.
class ContactDetector {
 public:
  ContactDetector(const ContactConfig& config, const Calibration& calibration);

  /// Each says whether the mode has just changed. The first mode after `unknown` is no event.
  ContactEvent add_imu(const ImuSample& sample);
  ContactEvent add_encoder(const EncoderSample& sample);
  ContactEvent add_laser(const LaserSample& sample);

  /// What to take off the gyroscope's rates [rad/s]; zero is good enough while all beams see the ground.
  void set_gyro_bias(const Eigen::Vector3d& b_g) { b_g_ = b_g; }

  [[nodiscard]] ContactMode mode() const { return mode_; }
  /// When the mode began; nothing while it is unknown.
  [[nodiscard]] std::optional<TimeNs> since_ns() const;
  /// Height of the wheels above the ground's plane [m], if the beams tell it to 5 cm.
  [[nodiscard]] std::optional<double> height() const;
  /// Unit normal of the ground in the body frame, if the beams tell it to 5 degrees.
  [[nodiscard]] std::optional<Eigen::Vector3d> n_B() const;

 private:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::min() / 2;

  /// What the wheels tell: the way they roll, and whether something drives them.
  struct Wheels {
    std::optional<EncoderSample> last;
    double pitch = 0.0;                 ///< by which the body turned about the axle since then [rad]
    std::array<double, 2> slow_rate{};  ///< relative to the body, as it was 0.1 s ago [rad/s]
    std::array<double, 2> slow_spin{};  ///< the same relative to the world
    TimeNs spun_up_ns = kNever;         ///< when they last turned faster than they can by themselves
    double recent_way = 0.0;            ///< rolled within the last half second [m]
  };

  ContactEvent change(ContactMode mode, TimeNs t_ns);
  ContactEvent look_for_first_evidence(TimeNs t_ns);
  ContactEvent look_for_takeoff(const GroundTracker::Sighting& sighting, TimeNs t_ns);
  ContactEvent look_for_touchdown(TimeNs t_ns);
  ContactEvent look_for_confirmed_touchdown(TimeNs t_ns);
  [[nodiscard]] bool lasts(bool holds, TimeNs t_ns, double duration);
  [[nodiscard]] double tolerance(bool all_agree) const;
  void roll(double distance, double dt);

  ContactConfig config_;
  EncoderCalibration axle_;
  std::optional<GroundTracker> ground_;
  Wheels wheels_;
  Eigen::Vector3d b_g_ = Eigen::Vector3d::Zero();

  ContactMode mode_ = ContactMode::unknown;
  TimeNs since_ns_ = kNever;
  TimeNs holds_since_ns_ = kNever;  ///< first reading in a row that speaks for a change
  TimeNs seen_ns_ = kNever;         ///< last reading that agreed with the plane tracked
  TimeNs last_imu_ns_ = kNever;
  TimeNs falling_since_ns_ = kNever;
  TimeNs strike_ns_ = kNever;
  double level_ = 0.0;  ///< height of standing wheels over the plane, which the ground's shape explains [m]
};

}  // namespace ear
