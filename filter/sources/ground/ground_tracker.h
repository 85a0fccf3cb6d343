// The plane under the vehicle as the laser beams see it, in the body frame, on the ground and in the air. A small
// filter of its own, so that whether there is contact is decided without the estimate that hangs on that decision.
//
// State: unit normal n_B, height h of the wheels above the plane, rate of climb. A beam hits the plane where
//   n_B . (p_BL + range d_B - p_BO) + r + h = 0,                   r: wheel radius, O: middle of the axle
// which is linear in n_B and h: one scalar update per beam, each gated by itself. The gyroscope turns n_B.
#pragma once

#include <Eigen/Core>
#include <bitset>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ingest/beam_ranges.h"
#include "filter/sources/ground/beam_repeats.h"

namespace ear {

/// [rad] chosen: standard deviation of the ground's slopes, and so of its normal before anything shows it.
inline constexpr double kSlope = 0.2;
/// [m/s] chosen: of a vehicle in flight, up, down, and over the ground.
inline constexpr double kFlightSpeed = 1.0;

class GroundTracker {
 public:
  GroundTracker(const LaserCalibration& lasers, const EncoderCalibration& axle, const OdometerConfig& config);

  /// The body turned by `angle_B` [rad] in `dt` [s], and felt the specific force `accel_B` [m/s^2].
  void turn(const Eigen::Vector3d& angle_B, const Eigen::Vector3d& accel_B, double dt);
  /// The vehicle is `distance` [m] further on, over ground that has another slope.
  void move(double distance);
  /// The rate of climb may have changed at once: a strike.
  void strike();
  /// The wheels are taken to be `level` above the plane, with standard deviation `sigma` [m]. Ignored if the beams
  /// contradict it.
  void suppose_height(double level, double sigma);

  /// Readings in time order. How many beams agreed with the plane tracked so far, and updated it.
  int update(const LaserSample& sample);

  /// Of which beams this is true: BeamRepeats::repeats, BeamRepeats::stuck.
  [[nodiscard]] std::bitset<kMaxBeams> beams_that(BeamRepeats::Property property) const;
  [[nodiscard]] int beams() const { return static_cast<int>(beams_.size()); }
  [[nodiscard]] int beams_that_see() const;                    ///< that gave a range they may use, lately
  [[nodiscard]] double height() const { return x_(kHeight); }  ///< of the wheels above the plane [m]
  [[nodiscard]] double height_sigma() const;                   ///< [m]
  [[nodiscard]] double climb() const { return x_(kClimb); }    ///< [m/s]
  [[nodiscard]] double climb_sigma() const;                    ///< [m/s]
  [[nodiscard]] Eigen::Vector3d n_B() const { return x_.head<3>(); }

 private:
  static constexpr int kHeight = 3, kClimb = 4, kSize = 5;
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Matrix = Eigen::Matrix<double, kSize, kSize>;

  struct Beam {
    BeamRepeats repeats;
    int agrees = kNoChance;           ///< readings in a row; a beam that disagreed is used again after some that agree
    std::optional<TimeNs> usable_ns;  ///< when its range last was one
  };

  [[nodiscard]] bool usable(Beam& beam, double range) const;
  void predict(double dt);
  void forget();
  void widen_normal(double variance);
  bool update_with_hit(Beam& beam, const Eigen::Vector3d& d_B, const Eigen::Vector3d& hit_B);
  [[nodiscard]] bool passes(const Vector& H, double residual, double variance, double gate) const;
  void update(const Vector& H, double residual, double variance);

  LaserCalibration lasers_;
  Eigen::Vector3d p_BO_;
  double radius_;
  double normal_walk_;
  Eigen::Vector3d up_B_ = Eigen::Vector3d::Zero();  ///< against gravity, roughly; zero before the first sample
  Vector x_ = Vector::Zero();                       ///< n_B, height, climb
  Matrix P_ = Matrix::Zero();
  std::vector<Beam> beams_;
  int lost_ = 0;  ///< readings in a row of which no beam agreed
  std::optional<TimeNs> last_ns_;
};

}  // namespace ear
