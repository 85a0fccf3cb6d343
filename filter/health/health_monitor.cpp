#include "filter/health/health_monitor.h"

#include <algorithm>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kWorstVelocity = 1.0;   // [m/s] chosen: standard deviation of a velocity that is known,
constexpr double kWorstDirection = 0.2;  // [rad] chosen: or of its direction, if more; a fast one may be less exact
constexpr double kPreciseEnough = 0.1;   // [m] chosen: or this, if more than kPrecise of the path

constexpr int kWheelQuality = 40;     // chosen: of 100; Health::quality
constexpr int kTrackQuality = 2;      // chosen: for each feature
constexpr int kInertialQuality = 10;  // chosen
constexpr int kDegradedQuality = 60;  // chosen: at most, where a sensor is missing

/// Health::quality of an estimate that may be used.
int quality(const Health& health, int tracks) {
  int points = 0;
  switch (health.aiding) {
    case Aiding::standing:
      points = 100;
      break;
    case Aiding::cameras_and_wheels:
      points = kWheelQuality + kTrackQuality * tracks;
      break;
    case Aiding::cameras:
      points = kTrackQuality * tracks;
      break;
    case Aiding::wheels:
      points = kWheelQuality;
      break;
    case Aiding::none:
      points = kInertialQuality;
      break;
  }
  return std::clamp(points, 1, health.status == HealthStatus::degraded ? kDegradedQuality : 100);
}

bool wheels_fit(const FrameStatistics& frame) {
  return frame.on_ground && frame.wheel_rows_used > frame.wheel_rows_rejected;
}

}  // namespace

HealthMonitor::HealthMonitor(const Calibration& calibration, bool uses_wheels, bool uses_beams)
    : beams_(uses_beams && calibration.lasers ? calibration.lasers->beams.size() : 0),
      wheels_(uses_wheels),
      images_(calibration.cameras.size()) {}

const FaultState& HealthMonitor::fault_of(Source source) const {
  if (source == Source::camera_left) return images_.left();
  if (source == Source::camera_right) return images_.right();
  return faults_[index_of(source)];
}

void HealthMonitor::report(std::initializer_list<Source> sources, TimeNs t_ns) {
  for (const Source source : sources) faults_[index_of(source)].report(t_ns);
}

void HealthMonitor::succeed(const HealthMonitor& before, TimeNs t_ns) {
  life_.started = before.life_.started;
  health_.reset_counter = before.health_.reset_counter;
  report({Source::gyroscope, Source::accelerometer}, t_ns);
  decide(t_ns);
  health_.since_ns = t_ns;
}

void HealthMonitor::add_refused_imu() {
  if (!arrivals_.imu_ns) return;
  report({Source::gyroscope, Source::accelerometer}, *arrivals_.imu_ns);
  decide(*arrivals_.imu_ns);
}

void HealthMonitor::add_imu(TimeNs t_ns, const ImuVerdict& verdict) {
  const bool refused = verdict.refused > 0.0;
  if ((verdict.gap || refused) && arrivals_.imu_ns) report({Source::gyroscope, Source::accelerometer}, t_ns);
  arrivals_.imu_ns = t_ns;
  images_.hear_imu(t_ns, verdict.lost > 0 || refused);
  note_silence(t_ns);
}

void HealthMonitor::report_imu_fault(const ImuFault& fault, TimeNs t_ns) {
  if (fault.gyro) report({Source::gyroscope}, t_ns);
  if (fault.accel) report({Source::accelerometer}, t_ns);
}

void HealthMonitor::report_camera_fault(TimeNs t_ns) {
  images_.report(t_ns);
  decide(t_ns);
}

void HealthMonitor::add_encoder(Verdict verdict, TimeNs imu_ns) {
  const double since = arrivals_.encoder_ns ? seconds_between(*arrivals_.encoder_ns, imu_ns) : kStale;
  arrivals_.encoder_interval = std::min(since, kStale);
  arrivals_.encoder_ns = imu_ns;
  if (verdict == Verdict::impossible) report({Source::wheel_left, Source::wheel_right}, imu_ns);
}

void HealthMonitor::add_laser(const LaserSample& sample, Verdict verdict, const LaserCalibration& lasers,
                              const std::bitset<kMaxBeams>& stuck, TimeNs imu_ns) {
  arrivals_.laser_ns = imu_ns;
  const bool moves = health_.aiding != Aiding::standing;
  for (std::size_t beam = 0; beam < std::min(beams_, sample.range.size()); ++beam) {
    const double range = sample.range[beam];
    no_return_[beam] = !is_return(range, lasers);
    if (verdict == Verdict::impossible || (stuck[beam] && moves && !no_return_[beam]))
      report({beam_source(beam)}, imu_ns);
  }
}

/// Whose clock is wrong? Where the inertial samples do not go on, it is theirs.
void HealthMonitor::add_refused_frame(TimeNs imu_ns) {
  if (!images_.add_ahead()) report({Source::gyroscope, Source::accelerometer}, imu_ns);
  decide(imu_ns);
}

/// Sensors that are silent count as little as those that are wrong.
void HealthMonitor::note_silence(TimeNs t_ns) {
  if (!life_.any_frame || images_.come(t_ns)) return;
  images_.add_silence(t_ns);
  for (const Source source : {Source::gyroscope, Source::accelerometer}) faults_[index_of(source)].add(false, t_ns);
  decide(t_ns);
}

void HealthMonitor::add_frame(const Frame& frame, const std::array<SourceRecord, kSourceCount>& records) {
  const TimeNs t_ns = frame.t_ns;
  life_.any_frame = true;
  const Frame before = last_;
  last_ = frame;
  if (!frame.image && images_.come(t_ns)) {  // between two images: what the last one showed holds
    last_.statistics.tracks = before.statistics.tracks;
    last_.statistics.stereo = before.statistics.stereo;
    last_.agreement = before.agreement;
  }
  // Wheels that are slower than the frames: what their last readings showed holds until the next are due.
  FrameStatistics& now = last_.statistics;
  if (now.wheel_rows_used + now.wheel_rows_rejected > 0) {
    arrivals_.wheel_rows_ns = t_ns;
  } else if (now.on_ground && arrivals_.wheel_rows_ns &&
             seconds_between(*arrivals_.wheel_rows_ns, t_ns) < longest_silence(arrivals_.encoder_interval)) {
    now.wheel_rows_used = before.statistics.wheel_rows_used;
    now.wheel_rows_rejected = before.statistics.wheel_rows_rejected;
  }
  if (frame.image) {
    images_.add(t_ns, frame.running, frame.agreement, frame.statistics);
  }
  if (wheels_) judge_ground(frame, records);
  for (const Source source : {Source::gyroscope, Source::accelerometer}) {
    faults_[index_of(source)].add(records[index_of(source)].rejected > 0, t_ns);
  }

  if (usable() && before.running && frame.running) life_.travelled += frame.speed * seconds_between(before.t_ns, t_ns);
  health_.sources = records;
  health_.horizontal_sigma = frame.horizontal_sigma;
  health_.vertical_sigma = frame.vertical_sigma;
  decide(t_ns);
  if (usable()) health_.quality = quality(health_, last_.statistics.tracks);
}

/// Wheels and beams have something to show on the ground only.
void HealthMonitor::judge_ground(const Frame& frame, const std::array<SourceRecord, kSourceCount>& records) {
  if (!frame.running || !frame.statistics.on_ground) {
    for (std::size_t i = index_of(Source::wheel_left); i < index_of(Source::gyroscope); ++i)
      faults_[i].clear(frame.t_ns);
    return;
  }
  const auto judge = [&](Source source, bool nothing_came) {
    const SourceRecord& record = records[index_of(source)];
    const int measured = record.used + record.rejected;
    FaultState& fault = faults_[index_of(source)];
    if (measured > 0) {
      fault.add(record.rejected > kMajority * measured, frame.t_ns);
    } else if (nothing_came) {
      fault.add(true, frame.t_ns);
    }
  };
  const TimeNs now_ns = arrivals_.imu_ns.value_or(frame.t_ns);
  const auto silent = [now_ns](const std::optional<TimeNs>& last_ns, double interval) {
    return !last_ns || seconds_between(*last_ns, now_ns) > longest_silence(interval);
  };
  const bool no_reading = silent(arrivals_.encoder_ns, arrivals_.encoder_interval);
  const bool no_range = silent(arrivals_.laser_ns, 0.0);
  if (!frame.lifted) {
    for (const Source wheel : {Source::wheel_left, Source::wheel_right}) judge(wheel, no_reading);
  }
  for (std::size_t beam = 0; beam < beams_; ++beam) judge(beam_source(beam), no_range || no_return_[beam]);
}

bool HealthMonitor::possible() const {
  const FrameStatistics& last = last_.statistics;
  const bool refuted = lost() && !images_.any() && last.wheel_rows_rejected > 0 && !wheels_fit(last);
  return last_.possible && last_.speed < kFastest && !refuted;
}

bool HealthMonitor::velocity_known() const {
  return last_.speed < kFastest && last_.velocity_sigma < std::max(kWorstVelocity, kWorstDirection * last_.speed);
}

bool HealthMonitor::wheels_carry(const FrameStatistics& frame) const {
  return wheels_ && wheels_fit(frame) &&
         (fault_of(Source::wheel_left).sound() || fault_of(Source::wheel_right).sound());
}

/// What carries the estimate, as far as the last frame is not too old.
Aiding HealthMonitor::aiding_at(TimeNs t_ns) const {
  const FrameStatistics frame = seconds_between(last_.t_ns, t_ns) < kStale ? last_.statistics : FrameStatistics{};
  if (frame.standing) return Aiding::standing;
  const bool cameras = images_.come(t_ns) && frame.tracks >= kFewFeatures && images_.carry();
  const bool wheels = wheels_carry(frame);
  if (cameras) return wheels ? Aiding::cameras_and_wheels : Aiding::cameras;
  return wheels ? Aiding::wheels : Aiding::none;
}

void HealthMonitor::decide(TimeNs t_ns) {
  if (!life_.started && last_.running && velocity_known()) {
    life_.started = true;
    life_.aided_ns = life_.fitting_ns = t_ns;
  }
  health_.aiding = aiding_at(t_ns);
  if (health_.aiding != Aiding::none) life_.aided_ns = t_ns;
  const bool fresh = seconds_between(last_.t_ns, t_ns) < kStale;
  const bool off = fresh && images_.come(t_ns) &&
                   ((last_.statistics.tracks >= kFewFeatures && last_.agreement.contradicts()) || images_.misfit());
  if (!off || (fresh && wheels_carry(last_.statistics))) life_.fitting_ns = t_ns;
  if (off || health_.aiding == Aiding::none || !last_.running) life_.unproven_ns = t_ns;
  life_.contradicted = last_.running && seconds_between(life_.fitting_ns, t_ns) > kLasting;

  health_.faulty.reset();
  for (std::size_t i = 0; i < kSourceCount; ++i) {
    const FaultState& fault = fault_of(static_cast<Source>(i));
    if (fault.sound()) continue;
    health_.faulty.set(i);
    health_.onset_ns[i] = fault.onset_ns();
  }
  // Wheels that fit again have the time to be known as sound.
  const double granted = wheels_ && fresh && wheels_fit(last_.statistics) ? 1e-9 * FaultState::kSoundAfter : 0.0;
  const bool usable = last_.running && last_.possible && velocity_known() && !life_.contradicted &&
                      seconds_between(life_.aided_ns, t_ns) < kLostAfter + granted;
  const bool proven = !lost() || duration_ns(life_.unproven_ns, t_ns) >= FaultState::kSoundAfter;
  const double sigma = std::max(health_.horizontal_sigma, health_.vertical_sigma);
  health_.imprecise = 2.0 * sigma > std::max(kPreciseEnough, kPrecise * life_.travelled);
  health_.misaligned = last_.misaligned;
  const bool sound = !health_.faulty.any() && !health_.imprecise && !health_.misaligned;
  const HealthStatus status = !life_.started       ? HealthStatus::initialising
                              : !usable || !proven ? HealthStatus::lost
                              : !sound             ? HealthStatus::degraded
                                                   : HealthStatus::tracking;
  if (status != health_.status) health_.since_ns = t_ns;
  if (health_.status == HealthStatus::lost && status != HealthStatus::lost) ++health_.reset_counter;
  health_.status = status;
  health_.reason = reason(t_ns);
  if (status == HealthStatus::lost || status == HealthStatus::initialising) health_.quality = 0;
}

/// Why there is no estimate, by the status that was decided.
Reason HealthMonitor::reason(TimeNs t_ns) const {
  if (usable()) return Reason::none;
  if (!last_.running) return !life_.any_frame && life_.started ? Reason::clock_or_gap : last_.waits_for;
  if (!life_.started) return Reason::vague_velocity;
  if (!last_.possible) return Reason::not_a_number;
  if (life_.contradicted) return Reason::images_contradict;
  if (seconds_between(life_.aided_ns, t_ns) >= kLostAfter) return Reason::inertia_alone;
  return velocity_known() ? Reason::proving : Reason::velocity_lost;
}

}  // namespace ear
