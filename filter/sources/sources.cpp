#include "filter/sources/sources.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/imu_displacement.h"
#include "filter/ekf/initial_state.h"
#include "filter/ingest/limits.h"
#include "filter/sources/ground/ground_rows.h"

namespace ear {
namespace {

constexpr double kTakeoffVelocity = 0.05;  // [m/s] chosen: what the wheels were wrong by before a take-off was noticed
constexpr double kGapAccel = 1.0;          // [m/s^2] chosen: while nothing was measured
constexpr double kGapRate = 0.3;           // [rad/s] chosen: the same
// A vehicle that stood begins to shake, and the biases of MEMS sensors are others then (vibration rectification).
constexpr double kShakenGyro = 5e-4;  // [rad/s] measured: 4.7e-4 when the drone of euroc_mh01_mono took off

std::optional<Standstill::GyroBias> gyro_bias(const Ekf& ekf) {
  if (!ekf.running()) return std::nullopt;
  return Standstill::GyroBias{ekf.state().imu.b_g,
                              std::sqrt(ekf.covariance().matrix().diagonal().segment<3>(err::b_g).maxCoeff())};
}

}  // namespace

Sources::Sources(const FilterConfig& config, const Calibration& calibration)
    : imu_(calibration.imu),
      imu_score_(config.odometer.scores, imu_limits(config.prior)),
      ground_(config, calibration),
      cameras_(config, calibration),
      standstill_(config.standstill, focal_length(calibration), config.window) {
  if (!ear::uses_wheels(config, calibration)) return;
  wheels_.emplace(config.odometer, calibration, has_beams(calibration));
  normal_walk_ = config.odometer.normal_walk;
}

/// The wheels held the vehicle on the ground while it rose. By what it climbs faster, as beams see, its velocity is
/// off, and position and clones by what that came to. Then the beams' climb is measured.
void Sources::inflate_after_takeoff(Ekf& ekf) const {
  ekf.inflate_motion(0.0, kTakeoffVelocity, kTakeoffVelocity * kSilent);  // for so long unnoticed
  const GroundTracker& plane = *ground_.plane();                          // without beams nothing takes off
  const Eigen::Vector3d n_W = ekf.state().ground.n_W;
  const ClimbPrediction predicted = predict_climb(ekf.state());
  const double climb = plane.climb();
  const double held = climb > 0.0 ? std::max(0.0, climb - predicted.speed) : 0.0;
  const double rose_for = climb > 0.0 ? 2.0 * std::max(0.0, plane.height()) / climb : 0.0;  // by a constant force
  ekf.inflate_held(held * n_W, 0.5 * rose_for * std::min(held, climb) * n_W, rose_for);
  if (held <= 0.0) return;
  GroundRows z;
  z.count = 1;
  z.H.block<1, 3>(0, ground_column(err::nu)) = predicted.H_velocity;
  z.H.block<1, 2>(0, ground_column(err::normal)) = predicted.H_normal;
  z.residual(0) = held;
  z.sigma(0) = plane.climb_sigma();
  ekf.apply(z, 1.0, CameraUpdate::considered);
}

void Sources::look_at(const FeatureFrame& frame, TimeNs t_ns, const Ingest& ingest, Ekf& ekf) {
  const bool stood = standstill_.stands();
  cameras_.measure_noise(frame, ekf.state().camera);
  const ImuStatistics recent = standstill_.recent(ingest.imu(), t_ns);
  standstill_.update({frame, t_ns, recent, gyro_bias(ekf), on_ground()});
  if (standstill_.stands()) imu_score_.add_rest(recent, imu_);
  ground_.set_gyro_bias(ekf.state().imu.b_g);
  if (stood && !standstill_.stands() && ekf.running()) ekf.inflate(err::b_g, bias_sigma(kShakenGyro, kShakenAccel));
}

Displacements Sources::displacements(const FeatureFrame& frame, TimeNs t_ns, const Ingest& ingest, const Ekf& ekf,
                                     bool ground_known) {
  motion_ = imu_motion(ekf.state().imu, ingest.imu(), t_ns, imu_);
  Displacements result;
  result[index_of(MotionSensor::imu)] = imu_displacement(motion_, ekf.covariance());
  if (rolls_at(ekf.state().imu.t_ns)) {
    result[index_of(MotionSensor::odometer)] =
        wheels_->displacement(ekf, ingest.increments(), ingest.imu(), t_ns, ground_known);
  }
  result[index_of(MotionSensor::camera)] = cameras_.displacement(frame, t_ns, motion_, ekf);
  return result;
}

ImuExcess Sources::score_imu(const FeatureFrame& frame, const Ekf& ekf, Records& records) {
  const std::optional<StereoMotion>& seen = cameras_.seen();
  imu_score_.start_frame();
  if (!seen) return {};
  const State& x = ekf.state();
  const std::optional<Innovation> turn = imu_score_.add(motion_, *seen, x, ekf.covariance(), frame.t_ns);
  if (turn) records.log.add(Source::gyroscope, *turn, x.imu.t_ns);
  return imu_score_.take_excess(ekf.covariance());
}

void Sources::advance(TimeNs t_ns, const Advice& advice, Ingest& ingest, Ekf& ekf, Records& records) {
  if (cameras_.count() == 0) {
    imu_score_.set_unseen_accel(std::max(ingest.white_accel(), wheels_ ? wheels_->accel_noise() : 1.0));
  }
  while (const std::optional<Measurement> z = ingest.next(t_ns, ekf.state().odometer.time_offset)) {
    propagate(z->t_ns, advice, ingest, ekf);
    const bool bridge_ahead =
        cameras_.count() > 1 && cameras_.last_image() && ingest.interruption().waits_for_images(ekf.state().imu.t_ns);
    if (bridge_ahead) continue;
    if (!z->increment) {
      ground_.update(z->ranges, ingest.imu(), camera_update_, ekf, records);
    } else if (rolls_at(z->increment->from_ns)) {
      wheels_->update(*z->increment,
                      {ingest.imu(), ground_.known(), advice.of(MotionSensor::odometer), camera_update_,
                       imu_score_.noise().gyro, standstill_.stands(), standstill_.wheels_rest(z->t_ns)},
                      ekf, records);
      ground_.stand(*z->increment, ingest.imu(), camera_update_, ekf);
    }
  }
  propagate(t_ns, advice, ingest, ekf);
  const ImuNoiseFactors noise = imu_noise(advice);
  records.log.set_score(Source::gyroscope, 1.0 / noise.gyro);
  records.log.set_score(Source::accelerometer, 1.0 / noise.accel);
}

ImuNoiseFactors Sources::imu_noise(const Advice& advice) const {
  ImuNoiseFactors noise = imu_score_.noise();
  noise.accel /= advice.of(MotionSensor::imu);  // (15)
  return noise;
}

/// Where samples are missing, they may be lost, or the clock jumped: the vehicle went on meanwhile, or it did not.
void Sources::propagate(TimeNs t_ns, const Advice& advice, Ingest& ingest, Ekf& ekf) const {
  if (t_ns <= ekf.state().imu.t_ns) return;
  ImuInterruption& interruption = ingest.interruption();
  const std::optional<TimeNs> uncertain_ns = ekf.propagate(ingest.imu(), t_ns, imu_noise(advice), normal_walk_);
  if (uncertain_ns) interruption.add_uncertain(*uncertain_ns);
  const ImuInterruption::Unseen unseen = interruption.take_unseen(t_ns);
  if (unseen.time > 0.0) {
    ekf.inflate_time(unseen.time);
    ekf.inflate_motion(unseen.unmeasured * kGapRate, unseen.unmeasured * kGapAccel, 0.0);
  }
}

FrameAgreement Sources::check(const FeatureFrame& frame, Ingest& ingest, Ekf& ekf) {
  FrameAgreement seen;
  if (ekf.running()) {
    if (ingest.interruption().take_uncertain() && cameras_.bridge(frame, ekf)) {
      camera_update_ = CameraUpdate::considered;
      ingest.interruption().set_bridged(ekf.state().imu.t_ns);
    }
    seen = cameras_.compare(frame, ekf);
  }
  seen.right_skipped = frame.right_skipped;
  return seen;
}

/// A vehicle that moves on without an image leaves no clone.
void Sources::update(const FeatureFrame* image, bool stands, const Advice& advice, Ekf& ekf, Records& records) {
  const bool holds = stands && clone_is_here_ && !ekf.state().clones.empty();  // which a bridge may have dropped
  clone_is_here_ = image != nullptr || stands;
  if (holds) {
    hold(ekf, records);
  } else if (clone_is_here_) {
    camera_update_ = advice.cameras_sound ? CameraUpdate::learned : CameraUpdate::considered;
    const double weight = advice.of(MotionSensor::camera);
    if (image != nullptr) {
      cameras_.update(*image, weight, camera_update_, ekf, records);
    } else {
      cameras_.clone_without_image(weight, ekf);
    }
  }
  records.statistics.clones = static_cast<int>(ekf.state().clones.size());
}

void Sources::hold(Ekf& ekf, Records& records) {
  camera_update_ = CameraUpdate::considered;
  records.statistics.standing = true;
  cameras_.set_updated(ekf.state().imu.t_ns);
  standstill_.hold(ekf);
}

void Sources::reset() {
  if (wheels_) wheels_->reset();
  ground_.reset();
  cameras_.reset();
  clone_is_here_ = false;
}

}  // namespace ear
