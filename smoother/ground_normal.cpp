#include "smoother/ground_normal.h"

#include <Eigen/LU>
#include <cmath>

#include "filter/sources/ground/ground_rows.h"

namespace ear::smoother {

GroundNormal::GroundNormal(const OdometerConfig& config, const Calibration& calibration, double gate_probability)
    : config_(config), lasers_(calibration.lasers.value_or(LaserCalibration{})), gate_(gate_probability, 1) {}

void GroundNormal::move(const Eigen::Matrix3d& R_B0B1, double distance) {
  if (!known_) return;
  const Eigen::Matrix<double, 3, 2> B0 = tangent_basis(n_B_);
  n_B_ = (R_B0B1.transpose() * n_B_).normalized();
  const Eigen::Matrix2d M = tangent_basis(n_B_).transpose() * R_B0B1.transpose() * B0;
  P_ = M * P_ * M.transpose();
  P_.diagonal().array() += config_.normal_walk * config_.normal_walk * std::abs(distance);
}

bool GroundNormal::add(const BeamRanges& ranges, const OdometerState& odometer, Records& records) {
  const std::array<double, kMaxBeams>& range = ranges.range;
  if (!known_) {
    const Eigen::Vector3d hits(range[0], range[1], range[2]);
    const std::optional<GroundPlane> plane = plane_through_hits(lasers_.beams, hits, odometer.T_BO.p);
    if (!plane) return false;
    n_B_ = plane->n_B;
    P_ = config_.normal_prior * config_.normal_prior * Eigen::Matrix2d::Identity();
    known_ = true;
  }
  State x;  // whose world is the body
  x.ground.n_W = n_B_;
  x.odometer = odometer;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();  // of the reading alone
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  const auto take = [&](double residual, const Eigen::RowVector2d& h, double sigma) {
    const double variance = (h * P_ * h.transpose()).value() + sigma * sigma;
    const Innovation innovation = Innovation::of(residual, variance, gate_.quantile(1));
    if (innovation.fits) {
      A += h.transpose() * h / (sigma * sigma);
      b += h.transpose() * residual / (sigma * sigma);
    }
    return innovation;
  };
  int used = 0;
  const double sigma = std::hypot(lasers_.noise, config_.unevenness);
  for (std::size_t i = 0; i < lasers_.beams.size(); ++i) {
    if (std::isnan(range[i])) continue;
    const BeamPrediction z = predict_range(x, I, lasers_.beams[i], 0.0);
    const Innovation innovation = take(range[i] - z.range, z.H_normal, sigma);
    records.log.add(beam_source(i), innovation, ranges.t_ns);
    ++(innovation.fits ? records.statistics.beams_used : records.statistics.beams_rejected);
    used += innovation.fits ? 1 : 0;
  }
  const LeanPrediction axle = predict_lean(x, I, OdometerAxis::left);
  take(-axle.lean, axle.H_normal, std::sqrt(2.0) * config_.unevenness / odometer.track_width);

  const double vague = 1.0 / (config_.normal_prior * config_.normal_prior);
  reading_sigma_ = std::sqrt(0.5 * (A + vague * Eigen::Matrix2d::Identity()).inverse().trace());
  const Eigen::Matrix2d P = (P_.inverse() + A).inverse();
  const Eigen::Vector2d correction = P * b;
  const Eigen::Matrix<double, 3, 2> B0 = tangent_basis(n_B_);
  n_B_ = (exp_so3(B0 * correction) * n_B_).normalized();
  P_ = 0.5 * (P + P.transpose());
  return used > 0;
}

}  // namespace ear::smoother
