#include "filter/common_estimator.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/propagation.h"
#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"
#include "filter/sources/ground/ground_rows.h"

namespace ear {
namespace {

/// From where the body was at one frame to where it is at the next.
RelativeMotion motion_between(const Pose& T_WB0, const NavState& next) {
  RelativeMotion motion;
  motion.R_B1B0 = next.q_WB.toRotationMatrix().transpose() * T_WB0.R;
  motion.p_B0B1 = T_WB0.R.transpose() * (next.p_WB - T_WB0.p);
  motion.rotation_known = motion.translation_known = true;
  return motion;
}

/// Do cameras or wheels point elsewhere in the body than the calibration says and its standard deviations allow?
bool mounting_refuted(const PriorConfig& prior, const Calibration& given, const Ekf& ekf) {
  if (!ekf.running()) return false;
  const auto refuted = [](const Eigen::Matrix3d& turn, double sigma) {
    return log_so3(turn).lpNorm<Eigen::Infinity>() > kClear * sigma;
  };
  const State& x = ekf.state();
  return refuted(x.camera.T_BC0.R * camera_state(given).T_BC0.R.transpose(), prior.camera_rotation) ||
         refuted(odometer_state(given).T_BO.R.transpose() * x.odometer.T_BO.R, odometer_rotation_sigma(prior, given));
}

}  // namespace

CommonEstimator::CommonEstimator(const FilterConfig& config, const Calibration& calibration)
    : config_(config),
      calibration_(calibration),
      ingest_(config, calibration),
      ekf_(config, calibration),
      sources_(config, calibration),
      start_(config, calibration),
      consistency_check_(config.anomaly),
      health_(calibration, sources_.uses_wheels(), config.odometer.model == OdometerModel::terrain) {
  if (calibration.lasers) laser_.range.reserve(calibration.lasers->beams.size());
}

void CommonEstimator::succeed(CommonEstimator& before, TimeNs t_ns, TimeNs clock_shift) {
  before.ingest_.restart();
  ingest_ = std::move(before.ingest_);
  start_.succeed(before.start_);
  health_.succeed(before.health_, t_ns);
  alignment_ = before.alignment_;
  last_good_ = std::move(before.last_good_);
  if (last_good_) last_good_->state.t_ns += clock_shift;
  report_tracks(before.records_.outcomes);
}

void CommonEstimator::forget_state() {
  ekf_.reset();
  sources_.reset();
  ingest_.drop_readings();
  ingest_.interruption() = ImuInterruption{};
}

void CommonEstimator::start_at(const GivenStart& start) {
  if (status() == Status::tracking) throw std::invalid_argument("start: there is an estimate already");
  start_.give(checked(start));
}

// ---- Samples in: ingest judges them, health and contact see them, and readings wait for the state to pass them

void CommonEstimator::add_imu(const ImuSample& sample) {
  ingest_.imu_clock().add(sample);
  take_imu();
}

void CommonEstimator::hear(ImuClock::Stream stream, TimeNs stamp_ns) {
  ingest_.imu_clock().observe(stream, stamp_ns);
  take_imu();
}

/// The samples that do not wait any more for a verdict on their clock.
void CommonEstimator::take_imu() {
  while (const std::optional<ImuSample> sample = ingest_.imu_clock().next()) {
    const ImuVerdict verdict = ingest_.judge(*sample, ekf_.running());
    if (!verdict.accepted) {
      if (!verdict.repeated) health_.add_refused_imu();
      continue;
    }
    if (verdict.begins_anew) restart(sample->t_ns, verdict.clock_shift);
    health_.add_imu(sample->t_ns, verdict);
    const std::optional<TimeNs> due_ns = ingest_.imu_due();
    if (due_ns && ekf_.running()) make_room(*due_ns);
    health_.report_imu_fault(ingest_.store(*sample, verdict), sample->t_ns);
    note(sources_.watch_contact(ingest_.imu().newest(), ekf_));
  }
  const bool corrected = ingest_.imu_clock().take_correction();
  if (corrected && !ingest_.imu().empty()) health_.report_imu_fault({true, true}, ingest_.imu().newest().t_ns);
}

void CommonEstimator::add_encoder(const EncoderSample& given) {
  if (!sources_.uses_wheels()) return;
  EncoderSample sample = given;
  sample.t_ns = later_by(calibration_.encoder->time_offset, given.t_ns);
  hear(ImuClock::Stream::encoder, sample.t_ns);
  const Ingest::Encoders taken = ingest_.take(sample, time_of(ekf_));
  if (!ingest_.imu().empty()) health_.add_encoder(taken.verdict, ingest_.imu().newest().t_ns);
  if (taken.verdict != Verdict::accepted || !taken.increment) return;
  note(sources_.watch_contact(*taken.increment, ekf_));
  sources_.watch_wheels(*taken.increment);
  if (!ekf_.running() && sources_.ground().flies_at(taken.increment->from_ns)) {
    ingest_.drop_readings();  // a start takes in those that wait, as of wheels that roll
  } else if (const auto due_ns = ingest_.push(*taken.increment, ekf_.running())) {
    make_room(*due_ns);
  }
}

void CommonEstimator::add_laser(const LaserSample& given) {
  if (!sources_.uses_wheels() || !has_beams(calibration_)) return;
  const TimeNs t_ns = later_by(calibration_.lasers->time_offset, given.t_ns);
  hear(ImuClock::Stream::laser, t_ns);  // all may begin anew, this sample too
  LaserSample& sample = laser_;
  sample.t_ns = t_ns;
  sample.range.assign(given.range.begin(), given.range.end());
  const Verdict verdict = ingest_.judge(sample, time_of(ekf_));
  if (verdict == Verdict::accepted) note(sources_.watch_contact(sample, ekf_));
  if (!ingest_.imu().empty()) {
    const TimeNs newest_ns = ingest_.imu().newest().t_ns;
    const std::bitset<kMaxBeams> stuck = sources_.ground().beams_that(&BeamRepeats::stuck);
    health_.add_laser(sample, verdict, *calibration_.lasers, stuck, newest_ns);
  }
  if (verdict != Verdict::accepted) return;
  const BeamRanges ranges(sample, *calibration_.lasers, sources_.ground().beams_that(&BeamRepeats::repeats));
  if (const auto due_ns = ingest_.push(ranges, ekf_.running())) make_room(*due_ns);
}

std::optional<TimeNs> CommonEstimator::common_stamp(TimeNs camera_stamp_ns) {
  hear(ImuClock::Stream::camera, camera_stamp_ns);
  if (!is_time(camera_stamp_ns)) return camera_stamp_ns;
  const std::optional<TimeNs> stamp = ingest_.camera_stamp(camera_stamp_ns);
  if (!stamp) health_.report_camera_fault(ingest_.imu().newest().t_ns);
  return stamp;
}

void CommonEstimator::refuse_frame() {
  if (!ingest_.imu().empty()) health_.add_refused_frame(ingest_.imu().newest().t_ns);
}

// ---- A frame

TimeNs CommonEstimator::begin_frame(const FeatureFrame& frame) {
  last_frame_ns_ = frame.t_ns;
  consistency_ = Consistency{};
  if (records_.outcomes != nullptr) records_.outcomes->clear();
  records_.log.start_frame();
  records_.statistics = FrameStatistics{};
  records_.statistics.tracks = static_cast<int>(frame.features.size());
  records_.statistics.stereo = static_cast<int>(std::count_if(frame.features.begin(), frame.features.end(),
                                                              [](const FeatureObservation& f) { return f.has_right; }));
  records_.statistics.on_ground = sources_.on_ground();
  const TimeNs t_ns = imu_time(frame.t_ns, ekf_.state().camera);
  sources_.look_at(frame, t_ns, ingest_, ekf_);
  return t_ns;
}

std::optional<Estimate> CommonEstimator::make_estimate(bool ground_known, const UnseenScales& scales) const {
  if (!ekf_.running()) return std::nullopt;
  const State& x = ekf_.state();
  const NavState here = nav_state(x.imu);
  Estimate estimate;
  estimate.state = alignment_.to_world(here);
  estimate.covariance = alignment_.to_world(ekf_.ordinary_covariance(scales), here);
  estimate.frame = records_.statistics;
  estimate.consistency = consistency_;
  if (ground_known) {
    const Slope seen = slope(x.imu.R_WB * x.odometer.T_BO.R.col(1), x.ground.n_W);  // (4)
    const std::array<int, 5> entries = {err::theta, err::theta + 1, err::theta + 2, err::normal, err::normal + 1};
    const Eigen::Matrix<double, 5, 5> P = ekf_.covariance().matrix()(entries, entries);
    const Eigen::Matrix2d P_slope = seen.J * P * seen.J.transpose();
    estimate.terrain = {true, seen.along, seen.across, std::sqrt(P_slope(0, 0)), std::sqrt(P_slope(1, 1))};
  }
  return estimate;
}

HealthMonitor::Frame CommonEstimator::health_frame(bool image, const FrameAgreement& seen,
                                                   const std::optional<Estimate>& estimate) const {
  HealthMonitor::Frame frame;
  frame.t_ns = imu_time(*last_frame_ns_, ekf_.state().camera);
  frame.image = image;
  frame.running = ekf_.running();
  frame.waits_for = start_.waits_for();
  frame.agreement = seen;
  frame.statistics = records_.statistics;
  frame.misaligned =
      (sources_.wheels() && sources_.wheels()->misaligned()) || mounting_refuted(config_.prior, calibration_, ekf_);
  frame.lifted = sources_.wheels() && sources_.wheels()->lifting(frame.t_ns);
  if (!estimate) return frame;
  frame.possible = ekf_.possible();
  if (!frame.possible) return frame;
  const auto variance = estimate->covariance.diagonal().cwiseMax(0.0);
  frame.speed = ekf_.state().imu.v_W.norm();
  // As the vehicle sees it, without that of the heading.
  frame.velocity_sigma = std::sqrt(ekf_.covariance().matrix().diagonal().segment<3>(err::nu).cwiseMax(0.0).maxCoeff());
  frame.horizontal_sigma = std::sqrt(variance.segment<2>(estimate_error::position).maxCoeff());
  frame.vertical_sigma = std::sqrt(variance(estimate_error::position + 2));
  return frame;
}

std::optional<Estimate> CommonEstimator::give(std::optional<Estimate> estimate) {
  if (!estimate || !ekf_.running() || !health_.usable()) return std::nullopt;
  estimate->health = health_.health();
  // The first one, whatever carries it, tells the user where the world begins.
  if (estimate->health.aiding != Aiding::none || !last_good_) last_good_ = estimate;
  return estimate;
}

// ---- Questions

std::optional<RelativeMotion> CommonEstimator::motion_to(TimeNs t_ns) const {
  const std::optional<LastImage>& last = sources_.cameras().last_image();
  if (!is_time(t_ns) || !last || ingest_.imu().empty() || t_ns <= last->t_ns) return std::nullopt;
  const CameraState& camera = ekf_.state().camera;
  const TimeNs to_ns = imu_time(t_ns, camera);
  if (const std::optional<Pose> before = sources_.cameras().image_pose(ekf_.state())) {
    return motion_between(*before, nav_state(integrate_to(to_ns, ekf_.state().imu, ingest_.imu())));
  }
  RelativeMotion motion;
  const TimeNs from_ns = imu_time(last->t_ns, camera);
  motion.rotation_known = ekf_.running();
  const Eigen::Vector3d b_g = motion.rotation_known ? ekf_.state().imu.b_g : Eigen::Vector3d::Zero();
  motion.R_B1B0 = gyro_rotation(from_ns, to_ns, b_g, ingest_.imu()).transpose();
  return motion;
}

std::optional<NavState> CommonEstimator::predict(TimeNs t_ns) const {
  if (!ekf_.running() || !health_.usable() || !is_time(t_ns)) return std::nullopt;
  if (seconds_between(ingest_.imu().newest().t_ns, t_ns) > kStale) return std::nullopt;
  return alignment_.to_world(nav_state(integrate_to(t_ns, ekf_.state().imu, ingest_.imu())));
}

}  // namespace ear
