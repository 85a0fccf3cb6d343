#include "filter/sources/ground/ground.h"

#include <cmath>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/propagation.h"
#include "filter/ingest/limits.h"
#include "filter/sources/ground/ground_rows.h"

namespace ear {
namespace {

/// The next row, not yet counted.
void add_lean(GroundRows& z, const LeanPrediction& predicted, double sigma) {
  z.H.row(z.count).segment<2>(ground_column(err::normal)) = predicted.H_normal;
  z.H.row(z.count).segment<3>(ground_column(err::odometer)) = predicted.H_odometer;
  z.residual(z.count) = -predicted.lean;
  z.sigma(z.count) = sigma;
}

}  // namespace

Ground::Ground(const FilterConfig& config, const Calibration& calibration)
    : config_(config.odometer), level_off_(config.contact.confirmed_height), contact_(config, calibration) {
  if (has_beams(calibration) && config.odometer.model == OdometerModel::terrain) lasers_ = calibration.lasers;
}

/// After a change of the ground under the wheels nothing is known of it.
ContactEvent Ground::note(ContactEvent event) {
  if (event != ContactEvent::none) running_ = Running{};
  return event;
}

bool Ground::carries_at(TimeNs t_ns, double settled) const {
  const std::optional<TimeNs> since_ns = contact_.since_ns();
  return carries() && (!since_ns || seconds_between(*since_ns, t_ns) > settled);
}

bool Ground::rolls_at(TimeNs t_ns) const { return carries_at(t_ns, kLanding); }

void Ground::update(const BeamRanges& reading, const ImuBuffer& imu, CameraUpdate calibration, Ekf& ekf,
                    Records& records) {
  if (!lasers_ || !carries_at(reading.t_ns, 0.0)) return;
  const Eigen::Matrix3d R_WB = motion_at(reading.t_ns, ekf.state().imu, imu).R_WB;
  if (!known() && !restart(reading, R_WB, ekf)) return;
  const State& x = ekf.state();
  static_assert(kMaxBeams + 1 <= GroundRows::size);
  GroundRows z;
  for (std::size_t beam = 0; beam < lasers_->beams.size(); ++beam) {
    const double range = reading.range[beam];
    if (std::isnan(range)) continue;
    const BeamPrediction predicted =
        predict_range(x, R_WB, lasers_->beams[beam], x.odometer.beam_offset(static_cast<int>(beam)));
    z.H.row(z.count).segment<2>(ground_column(err::normal)) = predicted.H_normal;
    z.H.row(z.count).segment<3>(ground_column(err::axle)) = predicted.H_axle;
    z.H(z.count, ground_column(err::beams) + static_cast<int>(beam)) = 1.0;
    z.residual(z.count) = range - predicted.range;
    z.sigma(z.count) = std::hypot(lasers_->noise, config_.unevenness);
    const Innovation innovation = weigh(z, running_.beam[beam], reading.t_ns, ekf);
    ++z.count;
    records.log.add(beam_source(beam), innovation, reading.t_ns);
    ++(innovation.fits ? records.statistics.beams_used : records.statistics.beams_rejected);
  }
  LeanPrediction axle = predict_lean(x, R_WB, OdometerAxis::left);
  axle.H_odometer.setZero();  // the ground is uneven under the wheels, where no beam sees it, by far more
  add_lean(z, axle, std::sqrt(2.0) * config_.unevenness / x.odometer.track_width);
  weigh(z, running_.axle, reading.t_ns, ekf);
  ++z.count;
  ekf.apply(z, 1.0, calibration);
}

/// What is wrong with the direction in which the wheels seem to point turns with the body, the ground does not: this is
/// how a vehicle that turns on the spot finds out. It sways while it stands there.
void Ground::stand(const WheelIncrement& increment, const ImuBuffer& imu, CameraUpdate calibration, Ekf& ekf) {
  if (lasers_ || config_.model != OdometerModel::terrain) return;
  const State& x = ekf.state();
  const Eigen::Matrix3d R_WB = motion_at(middle_of(increment), x.imu, imu).R_WB;
  if (!running_.stands) ekf.restart_normal(R_WB * x.odometer.T_BO.R.col(2));
  running_.stands = true;
  // The middle of the axle goes as far as the vehicle does, the wheels turn about it.
  const Eigen::Vector2d rims = x.odometer.wheel_radius.cwiseProduct(increment.angle);
  const double turned = 0.5 * std::abs(rims(1) - rims(0));
  const Eigen::Vector2d walk = Eigen::Vector2d::Constant(config_.normal_walk * std::sqrt(turned));
  ekf.inflate(err::normal, walk);
  GroundRows z;
  for (const OdometerAxis axis : {OdometerAxis::forward, OdometerAxis::left}) {
    add_lean(z, predict_lean(x, R_WB, axis), config_.body_pitch / std::sqrt(increment.duration()));
    ++z.count;
  }
  ekf.apply(z, 1.0, calibration);
}

/// The noise of the row at hand, not yet counted, grows with what did not fit. Nothing else shows the ground: where all
/// beams contradict it, it is the plane that is wrong, and what pull they keep brings it back.
Innovation Ground::weigh(GroundRows& z, NoiseScore& score, TimeNs t_ns, const Ekf& ekf) const {
  double& sigma = z.sigma(z.count);
  Innovation innovation = gate_test(ekf, z.H.row(z.count), z.residual(z.count), sigma);
  sigma *= std::sqrt(score.add(innovation, sigma, config_.scores, t_ns));
  innovation.score = score.weight();
  return innovation;
}

/// Where nothing is known of the ground, the plane through the hits is where the linearisation starts (2), (3). The
/// wheels stand on it: a plane that is elsewhere is none, one of the beams hit something else. False: with this reading
/// nothing can be begun. If it does not get better, the ground is taken for level, and the gates have to find out.
bool Ground::restart(const BeamRanges& reading, const Eigen::Matrix3d& R_WB, Ekf& ekf) {
  const OdometerState& o = ekf.state().odometer;
  const Eigen::Vector3d range(reading.range[0], reading.range[1], reading.range[2]);
  const std::optional<GroundPlane> plane = plane_through_hits(lasers_->beams, range, o.T_BO.p);
  if (!plane) return true;
  const bool carries = std::abs(plane->height - o.wheel_radius.mean()) < level_off_ &&
                       std::abs(plane->n_B.dot(o.T_BO.R.col(1))) < kSlope;
  if (!running_.misplaced_since_ns) running_.misplaced_since_ns = reading.t_ns;
  if (!carries && seconds_between(*running_.misplaced_since_ns, reading.t_ns) < kStale) return false;
  ekf.restart_normal(carries ? Eigen::Vector3d((R_WB * plane->n_B).normalized()) : Eigen::Vector3d::UnitZ());
  running_.misplaced_since_ns.reset();
  running_.known = true;
  return true;
}

}  // namespace ear
