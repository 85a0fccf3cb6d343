// The normal of the ground in the body, from the lasers alone while the wheels stand on it: no attitude is needed for
// it. What the odometer's pre-integration takes its direction from: the paper's R_oI (2), (3), beam by beam.
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/gate.h"
#include "filter/ekf/records.h"
#include "filter/ekf/state.h"
#include "filter/ingest/beam_ranges.h"

namespace ear::smoother {

class GroundNormal {
 public:
  GroundNormal(const OdometerConfig& config, const Calibration& calibration, double gate_probability);

  /// The wheels left the ground, or met it.
  void forget() { known_ = false; }

  /// The body turned by R_B0B1 while the wheels rolled so far [m].
  void move(const Eigen::Matrix3d& R_B0B1, double distance);

  /// Of beams that hang on the body as in `odometer`. Each is gated by itself and written down; where nothing is known,
  /// the plane through the hits is the start. Did it show anything?
  bool add(const BeamRanges& ranges, const OdometerState& odometer, Records& records);

  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] const Eigen::Vector3d& n_B() const { return n_B_; }
  /// Of its tilt about the columns of tangent_basis(n_B()) [rad^2].
  [[nodiscard]] const Eigen::Matrix2d& covariance() const { return P_; }
  /// Standard deviation of what the last reading alone shows [rad]. Errors of the normal last over several readings; a
  /// path along it errs as if each reading had an error of its own, of this size.
  [[nodiscard]] double reading_sigma() const { return reading_sigma_; }

 private:
  OdometerConfig config_;
  LaserCalibration lasers_;
  Gate gate_;
  bool known_ = false;
  Eigen::Vector3d n_B_ = Eigen::Vector3d::UnitZ();
  Eigen::Matrix2d P_ = Eigen::Matrix2d::Identity();
  double reading_sigma_ = 0.0;
};

}  // namespace ear::smoother
