#include "filter/health_monitor.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr double kLongest = 0.25;    // [s] that one piece of evidence may count
constexpr double kMajority = 0.5;    // of the measurements of a wheel or beam
constexpr double kSomeOff = 0.1;     // of the features off their place: a camera is in doubt
constexpr double kManyOff = 0.3;     // it carries the estimate no more
constexpr double kMostOff = 0.5;     // and contradicts the state
constexpr double kNoisy = 1.5;       // times the usual noise of a feature: as little
constexpr double kFewStereo = 0.25;  // of the features: less are seen by the right camera
constexpr int kFewTracks = 10;
constexpr double kSparse = 0.4;         // of the usual number of features: less are seen
constexpr double kTracksMemory = 20.0;  // [s]
constexpr double kSilent = 0.12;        // [s] without a frame, and kMissedFrames of its intervals
constexpr double kMissedFrames = 2.5;
constexpr double kStale = 0.5;          // [s] after which what the last frame said holds no more
constexpr double kTick = 0.03;          // [s] between two looks at silent sensors
constexpr int kRepeated = 15;           // equal ranges in a row, while the vehicle moves: a beam that is stuck
constexpr double kClippedAccel = 25.0;  // [m/s^2] equal values in a row beyond this are the end of a range
constexpr double kClippedGyro = 6.0;    // [rad/s]
constexpr double kTurnOff = 0.012;      // [rad/s] between gyroscope and cameras
constexpr double kTurnSigmas = 4.0;
constexpr double kTurnMemory = 0.25;    // [s]
constexpr double kScatterMemory = 2.0;  // [s]
constexpr double kMostScatter = 0.1;    // [rad/s]
constexpr double kMisled = 1.5;         // [s] after wheels that did not fit
constexpr int kStampsToKnow = 20;
constexpr double kLongestDelay = 0.1;  // [s] that may be usual
constexpr double kStampOff = 0.06;     // [s] off the usual
constexpr double kStampSpreads = 6.0;
constexpr double kStampMemory = 1000.0;  // stamps
constexpr double kUnaided = 2.0;         // [s] that inertia alone may carry the estimate
constexpr double kWorstVelocity = 1.0;   // [m/s] standard deviation of a velocity that is known,
constexpr double kWorstDirection = 0.2;  // [rad] or of its direction, if more: one that is fast need not know it better
constexpr double kContradicted = 1.0;    // [s]

/// Left and right exchanged: what both see lies behind them.
bool crossed(const FrameAgreement& seen) { return seen.behind > kMajority; }

}  // namespace

void Trust::add(bool wrong, TimeNs t_ns) {
  const double dt = last_ns_ ? std::clamp(seconds_between(*last_ns_, t_ns), 0.0, kLongest) : 0.0;
  last_ns_ = t_ns;
  if (wrong && !doubted_) onset_ns_ = t_ns;
  doubted_ = wrong || doubt_ > 0.0;
  doubt_ = std::clamp(doubt_ + (wrong ? dt / kDistrustAfter : -dt / kTrustAfter), 0.0, 1.0);
  if (doubt_ > 1.0 - 1e-9) trusted_ = false;
  if (doubt_ <= 0.0 && !wrong) {
    trusted_ = true;
    doubted_ = false;
  }
}

void Trust::accuse(TimeNs t_ns) {
  if (!doubted_) onset_ns_ = t_ns;
  doubted_ = true;
  doubt_ = 1.0;
  trusted_ = false;
  last_ns_ = t_ns;
}

void Trust::excuse(TimeNs t_ns) {
  doubt_ = 0.0;
  doubted_ = false;
  trusted_ = true;
  last_ns_ = t_ns;
}

bool StampWatch::add(TimeNs stamp_ns, TimeNs imu_ns) {
  const double ahead = seconds_between(imu_ns, stamp_ns);
  if (count_ == 0) usual_ = std::clamp(ahead, -kLongestDelay, kLongestDelay);  // the first one may be false
  const double off = std::abs(ahead - usual_);
  const double share = std::max(1.0 / kStampMemory, 1.0 / (count_ + 1));
  const bool unusual = count_ >= kStampsToKnow && off > std::max(kStampOff, kStampSpreads * spread_);
  const double counted = std::min(off, kStampOff);  // what is usual changes slowly
  usual_ += share * std::clamp(ahead - usual_, -counted, counted);
  spread_ += share * (counted - spread_);
  ++count_;
  return unusual;
}

HealthMonitor::HealthMonitor(const Calibration& calibration, bool uses_wheels, bool uses_beams)
    : cameras_(calibration.cameras.size()),
      beams_(uses_beams && calibration.lasers ? calibration.lasers->beams.size() : 0),
      wheels_(uses_wheels) {}

void HealthMonitor::accuse(std::initializer_list<Source> sources, TimeNs t_ns) {
  for (const Source source : sources) trust(source).accuse(t_ns);
}

void HealthMonitor::succeed(const HealthMonitor& before, TimeNs t_ns) {
  started_ = before.started_;
  health_.reset_counter = before.health_.reset_counter;
  accuse({Source::gyroscope, Source::accelerometer}, t_ns);
  decide(t_ns);
  health_.since_ns = t_ns;
}

void HealthMonitor::add_refused_imu() {
  if (!last_imu_) return;
  accuse({Source::gyroscope, Source::accelerometer}, last_imu_->t_ns);
  decide(last_imu_->t_ns);
}

void HealthMonitor::add_imu(const ImuSample& sample, double max_gap) {
  const TimeNs t_ns = sample.t_ns;
  const bool gap = last_imu_ && seconds_between(last_imu_->t_ns, sample.t_ns) > max_gap;
  if (gap) accuse({Source::gyroscope, Source::accelerometer}, t_ns);
  if (last_imu_) {
    const auto clipped = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double least) {
      for (int axis = 0; axis < 3; ++axis) {
        if (a(axis) == b(axis) && std::abs(b(axis)) > least) return true;
      }
      return false;
    };
    if (clipped(last_imu_->gyro_B, sample.gyro_B, kClippedGyro)) accuse({Source::gyroscope}, t_ns);
    if (clipped(last_imu_->accel_B, sample.accel_B, kClippedAccel)) accuse({Source::accelerometer}, t_ns);
  }
  last_imu_ = sample;
  if (seconds_between(last_tick_ns_, t_ns) < kTick) return;
  last_tick_ns_ = t_ns;
  note_silence(t_ns);
}

void HealthMonitor::accuse_imu(bool gyro, bool accel, TimeNs t_ns) {
  if (gyro) accuse({Source::gyroscope}, t_ns);
  if (accel) accuse({Source::accelerometer}, t_ns);
}

void HealthMonitor::accuse_cameras(TimeNs t_ns) {
  accuse_images(t_ns);
  decide(t_ns);
}

void HealthMonitor::accuse_images(TimeNs t_ns) {
  for (std::size_t camera = 0; camera < cameras_; ++camera) trust_[camera].accuse(t_ns);
  carrying_.accuse(t_ns);
}

void HealthMonitor::add_encoder(const EncoderSample& sample, Verdict verdict, TimeNs imu_ns) {
  last_encoder_ns_ = imu_ns;
  if (verdict == Verdict::impossible || encoder_stamps_.add(sample.t_ns, imu_ns))
    accuse({Source::wheel_left, Source::wheel_right}, imu_ns);
}

void HealthMonitor::add_laser(const LaserSample& sample, Verdict verdict, const LaserCalibration& lasers,
                              TimeNs imu_ns) {
  last_laser_ns_ = imu_ns;
  const bool unusual = verdict == Verdict::impossible || laser_stamps_.add(sample.t_ns, imu_ns);
  for (std::size_t beam = 0; beam < std::min(beams_, sample.range.size()); ++beam) {
    const double range = sample.range[beam];
    no_return_[beam] = !(range >= lasers.range_min && range <= lasers.range_max);
    const bool moves = health_.aiding != Aiding::standing;
    repeated_[beam] = !no_return_[beam] && range == last_range_[beam] && moves ? repeated_[beam] + 1 : 0;
    last_range_[beam] = range;
    if (unusual || repeated_[beam] >= kRepeated) trust(beam_source(beam)).accuse(imu_ns);
  }
}

/// Whose clock is wrong? Where the inertial samples went on since the last refusal, it is not theirs.
void HealthMonitor::add_refused_frame(TimeNs imu_ns) {
  const bool imu_goes_on = last_refused_imu_ns_ && imu_ns > *last_refused_imu_ns_;
  last_refused_imu_ns_ = imu_ns;
  if (!imu_goes_on) {
    accuse({Source::gyroscope, Source::accelerometer}, imu_ns);
  } else {
    accuse_cameras(imu_ns);
  }
  decide(imu_ns);
}

/// Sensors that say nothing are as little to be trusted as those that lie.
void HealthMonitor::note_silence(TimeNs t_ns) {
  if (!any_frame_ || images_come(t_ns)) return;
  for (std::size_t camera = 0; camera < cameras_; ++camera) trust_[camera].add(true, t_ns);
  carrying_.add(true, t_ns);
  for (const Source source : {Source::gyroscope, Source::accelerometer}) trust(source).add(false, t_ns);
  decide(t_ns);
}

void HealthMonitor::add_frame(const Frame& frame, const std::array<SourceRecord, kSourceCount>& records) {
  const TimeNs t_ns = frame.t_ns;
  any_frame_ = true;
  const Frame before = last_;
  last_ = frame;
  if (!frame.image && images_come(t_ns)) {  // between two images: what the last one showed holds
    last_.statistics.tracks = before.statistics.tracks;
    last_.statistics.stereo = before.statistics.stereo;
    last_.agreement = before.agreement;
  }
  last_refused_imu_ns_.reset();
  if (frame.image) {
    if (last_frame_ns_) {
      const double interval = std::min(seconds_between(*last_frame_ns_, t_ns), 0.5);
      frame_interval_ += (frame_interval_ == 0.0 ? 1.0 : 0.1) * (interval - frame_interval_);
    }
    last_frame_ns_ = t_ns;
    last_arrival_ns_ = last_imu_ ? std::max(t_ns, last_imu_->t_ns) : t_ns;
    judge_cameras(frame);
    late_ = camera_stamps_unusual_ && !camera_stamps_wrong_ && frame.agreement.matches > 0 &&
            frame.agreement.left < kManyOff;
    if (camera_stamps_unusual_) accuse_images(t_ns);
  }
  judge_turn(frame);
  if (wheels_) judge_ground(frame, records);
  for (const Source source : {Source::gyroscope, Source::accelerometer}) {
    trust(source).add(source == Source::gyroscope && turns_otherwise_, t_ns);
  }

  health_.sources = records;
  health_.horizontal_sigma = frame.horizontal_sigma;
  health_.vertical_sigma = frame.vertical_sigma;
  decide(t_ns);
  health_.quality = quality(last_);
}

bool HealthMonitor::check_image(const FrameAgreement& agreement, TimeNs t_ns, TimeNs newest_imu_ns) {
  camera_stamps_unusual_ = camera_stamps_.add(t_ns, newest_imu_ns);
  const bool elsewhere = agreement.matches > 0 && agreement.left > kManyOff;
  camera_stamps_wrong_ = camera_stamps_unusual_ && (camera_stamps_wrong_ || elsewhere);
  return !agreement.frozen && !crossed(agreement) && !camera_stamps_wrong_;
}

void HealthMonitor::judge_cameras(const Frame& frame) {
  if (cameras_ == 0) return;
  const TimeNs t_ns = frame.t_ns;
  const FrameAgreement& seen = frame.agreement;
  const bool known = frame.running && seen.matches > 0;
  const int tracks = frame.statistics.tracks;
  const bool blind = tracks < kFewTracks;
  const bool poor = blind || tracks < kSparse * usual_tracks_ || seen.noise > kNoisy;
  const double share = std::max(frame_interval_ / kTracksMemory, 1.0 / (1.0 + frames_counted_));
  usual_tracks_ += share * (tracks - usual_tracks_);
  ++frames_counted_;
  carrying_.add(blind || (known && seen.left > kManyOff), t_ns);
  trust(Source::camera_left).add(poor || (known && seen.left > kSomeOff), t_ns);
  if (cameras_ == 2 && frame.right) {
    const bool one_eyed = frame.statistics.stereo < kFewStereo * tracks;
    trust(Source::camera_right).add(poor || one_eyed || (known && seen.right > kSomeOff), t_ns);
  }
  if (seen.frozen || crossed(seen)) accuse_images(t_ns);
}

/// Wheels and beams have something to say on the ground only.
void HealthMonitor::judge_ground(const Frame& frame, const std::array<SourceRecord, kSourceCount>& records) {
  if (!frame.running || !frame.statistics.on_ground) {
    for (std::size_t i = index_of(Source::wheel_left); i < index_of(Source::gyroscope); ++i)
      trust_[i].excuse(frame.t_ns);
    return;
  }
  const auto judge = [&](Source source, bool silent) {
    const SourceRecord& record = records[index_of(source)];
    const int heard = record.used + record.rejected;
    if (heard > 0) {
      trust(source).add(record.rejected > kMajority * heard, frame.t_ns);
    } else if (silent) {
      trust(source).add(true, frame.t_ns);
    }
  };
  const TimeNs now_ns = last_imu_ ? last_imu_->t_ns : frame.t_ns;
  const bool no_reading = seconds_between(last_encoder_ns_, now_ns) > kSilent;
  const bool no_range = seconds_between(last_laser_ns_, now_ns) > kSilent;
  if (!frame.lifted) {
    for (const Source wheel : {Source::wheel_left, Source::wheel_right}) judge(wheel, no_reading);
  }
  for (std::size_t beam = 0; beam < beams_; ++beam) judge(beam_source(beam), no_range || no_return_[beam]);
}

/// How the cameras turn against the gyroscope, over the last moments.
void HealthMonitor::judge_turn(const Frame& frame) {
  const FrameAgreement& seen = frame.agreement;
  if (!frame.image || !frame.running || !frame.possible || frame_interval_ <= 0.0) return;
  const double share = 1.0 - std::exp(-frame_interval_ / kTurnMemory);
  // A velocity that wheels led astray looks like a turn as well.
  if (frame.statistics.wheel_rows_rejected > 0) misled_ns_ = frame.t_ns;
  const bool misled = misled_ns_ && seconds_between(*misled_ns_, frame.t_ns) < kMisled;
  const bool known = !misled && seen.turn_sigma > 0.0 && seen.left < kManyOff && !seen.frozen;
  const Eigen::Vector3d rate = known ? Eigen::Vector3d(seen.turn / frame_interval_) : Eigen::Vector3d::Zero();
  // What the rates scatter, vibration and timing included, and what is left of it in their mean.
  const double off = std::min((rate - turn_rate_).norm(), kMostScatter);
  const double scatter_share = 1.0 - std::exp(-frame_interval_ / kScatterMemory);
  turn_scatter_ += scatter_share * (off * off - turn_scatter_);
  turn_rate_ += share * (rate - turn_rate_);
  feigned_turn_ += share * (seen.feigned_turn - feigned_turn_);
  const double by_chance = kTurnSigmas * std::sqrt(0.5 * share * turn_scatter_);
  turns_otherwise_ = known && turn_rate_.norm() > std::max(kTurnOff, by_chance) + feigned_turn_;
}

/// Did one come in not long ago?
bool HealthMonitor::images_come(TimeNs t_ns) const {
  return cameras_ > 0 && last_frame_ns_ &&
         seconds_between(last_arrival_ns_, t_ns) < std::max(kSilent, kMissedFrames * frame_interval_);
}

bool HealthMonitor::velocity_known() const {
  return last_.velocity_sigma < std::max(kWorstVelocity, kWorstDirection * last_.speed);
}

void HealthMonitor::decide(TimeNs t_ns) {
  if (!started_ && last_.running && velocity_known()) {
    started_ = true;
    aided_ns_ = fitting_ns_ = t_ns;
  }
  const FrameStatistics frame = seconds_between(last_.t_ns, t_ns) < kStale ? last_.statistics : FrameStatistics{};
  const bool cameras = images_come(t_ns) && frame.tracks >= kFewTracks && (carrying_.trusted() || late_);
  const bool wheels = wheels_ && frame.on_ground && (trusted(Source::wheel_left) || trusted(Source::wheel_right)) &&
                      frame.wheel_rows_used > 0;
  health_.aiding = frame.standing      ? Aiding::standing
                   : cameras && wheels ? Aiding::cameras_and_wheels
                   : cameras           ? Aiding::cameras
                   : wheels            ? Aiding::wheels
                                       : Aiding::none;
  if (health_.aiding != Aiding::none) aided_ns_ = t_ns;
  const bool off = images_come(t_ns) && frame.tracks >= kFewTracks && last_.agreement.left > kMostOff;
  if (!off || wheels) fitting_ns_ = t_ns;
  contradicted_ = last_.running && seconds_between(fitting_ns_, t_ns) > kContradicted;

  health_.faulty.reset();
  for (std::size_t source = 0; source < kSourceCount; ++source) {
    if (trust_[source].trusted()) continue;
    health_.faulty.set(source);
    health_.onset_ns[source] = trust_[source].onset_ns();
  }
  const bool usable = last_.running && last_.possible && seconds_between(aided_ns_, t_ns) < kUnaided &&
                      velocity_known() && !contradicted_;
  const HealthStatus status = !started_              ? HealthStatus::initialising
                              : !usable              ? HealthStatus::lost
                              : health_.faulty.any() ? HealthStatus::degraded
                                                     : HealthStatus::tracking;
  if (status != health_.status) health_.since_ns = t_ns;
  if (health_.status == HealthStatus::lost && status != HealthStatus::lost) ++health_.reset_counter;
  health_.status = status;
  if (status == HealthStatus::lost || status == HealthStatus::initialising) health_.quality = 0;
}

/// Two for each feature, 40 for wheels, all for a vehicle that stands; half at most where something is missing.
int HealthMonitor::quality(const Frame& frame) const {
  if (health_.status == HealthStatus::lost || health_.status == HealthStatus::initialising) return 0;
  int points = 0;
  switch (health_.aiding) {
    case Aiding::standing:
      points = 100;
      break;
    case Aiding::cameras_and_wheels:
      points = 40 + 2 * frame.statistics.tracks;
      break;
    case Aiding::cameras:
      points = 2 * frame.statistics.tracks;
      break;
    case Aiding::wheels:
      points = 40;
      break;
    case Aiding::none:
      points = 10;
      break;
  }
  return std::clamp(points, 1, health_.status == HealthStatus::degraded ? 60 : 100);
}

}  // namespace ear
