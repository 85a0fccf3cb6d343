// The ground as a source: is the vehicle on it, where is its plane, and the rows of the laser beams that see it.
// Contact is decided in contact.h, the rows are in ground_rows.h. docs/filter.md, "Ground".
#pragma once

#include <array>
#include <bitset>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/noise_score.h"
#include "filter/ekf/records.h"
#include "filter/ingest/beam_ranges.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/sources/ground/contact.h"

namespace ear {

class Ground {
 public:
  Ground(const FilterConfig& config, const Calibration& calibration);

  /// For contact: every sample, in time order. Afterwards nothing is known of the ground if the wheels left it or met
  /// it.
  ContactEvent add(const ImuSample& sample) { return note(contact_.add_imu(sample)); }
  ContactEvent add(const WheelIncrement& increment) { return note(contact_.add_wheels(increment)); }
  ContactEvent add(const LaserSample& sample) { return note(contact_.add_laser(sample)); }
  void set_gyro_bias(const Eigen::Vector3d& b_g) { contact_.set_gyro_bias(b_g); }

  /// Do the wheels carry the vehicle?
  [[nodiscard]] bool carries() const { return contact_.mode() == ContactMode::ground; }
  /// Do the wheels show how the vehicle moves? Not in the air, and not while the ground spins them up.
  [[nodiscard]] bool rolls_at(TimeNs t_ns) const;
  /// Do they not? False also while it is unknown.
  [[nodiscard]] bool flies_at(TimeNs t_ns) const { return contact_.mode() != ContactMode::unknown && !rolls_at(t_ns); }
  /// Have the lasers seen the ground since it was last touched?
  [[nodiscard]] bool known() const { return running_.known; }
  /// The plane that the beams see; nothing without wheels or beams.
  [[nodiscard]] const std::optional<GroundTracker>& plane() const { return contact_.plane(); }
  /// Of which beams this is true: BeamRepeats::repeats, BeamRepeats::stuck.
  [[nodiscard]] std::bitset<kMaxBeams> beams_that(BeamRepeats::Property property) const {
    return contact_.beams_that(property);
  }

  /// One reading of the beams: a row each (2)-(4), and one for the axle, which lies along the ground.
  void update(const BeamRanges& reading, const ImuBuffer& imu, CameraUpdate calibration, Ekf& ekf, Records& records);
  /// Without beams, at a reading of the wheels: the body stands on ground whose slope changes as they roll. Two rows.
  void stand(const WheelIncrement& increment, const ImuBuffer& imu, CameraUpdate calibration, Ekf& ekf);

  /// The state begins anew.
  void reset() { running_ = Running{}; }

 private:
  ContactEvent note(ContactEvent event);
  /// Do the wheels carry the vehicle at `t_ns`, and have they for `settled` seconds, as far as they were seen to land?
  [[nodiscard]] bool carries_at(TimeNs t_ns, double settled) const;
  bool restart(const BeamRanges& reading, const Eigen::Matrix3d& R_WB, Ekf& ekf);
  Innovation weigh(GroundRows& z, NoiseScore& score, TimeNs t_ns, const Ekf& ekf) const;

  struct Running {
    std::array<NoiseScore, kMaxBeams> beam;
    NoiseScore axle;  ///< that it lies along the ground
    bool known = false;
    bool stands = false;                       ///< on ground that no beam sees, whose normal is a state since
    std::optional<TimeNs> misplaced_since_ns;  ///< readings whose plane the wheels do not stand on
  };

  OdometerConfig config_;
  double level_off_;                        ///< [m] a plane that is farther from the wheels is not the one below them
  std::optional<LaserCalibration> lasers_;  ///< where they are used
  ContactDetector contact_;
  Running running_;
};

}  // namespace ear
