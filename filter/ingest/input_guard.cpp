#include "filter/ingest/input_guard.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "filter/ingest/limits.h"
#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

/// The limits of the possible: no sound sensor delivers more.
struct Limits {
  double rate = 100.0;    ///< [rad/s] data sheets: of a gyroscope
  double force = 1000.0;  ///< [m/s^2] data sheets: of an accelerometer, 100 g
  double turn = 500.0;    ///< [rad/s] chosen: of a wheel, 25 m/s with a radius of 5 cm
  double range = 1000.0;  ///< [m] chosen: of a laser; more is a wrong unit
  double view = 100.0;    ///< chosen: tan of the angle off a camera's axis, nothing is seen at 89.4 deg
};
constexpr Limits kPossible = {};

}  // namespace

InputGuard::InputGuard(const Calibration& calibration)
    : imu_interval_(1.0 / calibration.imu.rate_hz),
      stereo_(calibration.cameras.size() > 1),
      beam_count_(calibration.lasers ? calibration.lasers->beams.size() : 0) {
  ids_.reserve(kFeatureCapacity);
  plausible_frame_.features.reserve(kFeatureCapacity);
}

ImuVerdict InputGuard::judge(const ImuSample& sample) {
  StreamCounts& counts = counts_.imu;
  ImuVerdict verdict;
  if (!sample.gyro_B.allFinite() || !sample.accel_B.allFinite()) {
    ++counts.not_finite;
    return verdict;
  }
  if (!is_time(sample.t_ns) || sample.gyro_B.cwiseAbs().maxCoeff() > kPossible.rate ||
      sample.accel_B.cwiseAbs().maxCoeff() > kPossible.force) {
    ++counts.implausible;
    return verdict;
  }
  const bool later = !imu_stamps_.newest() || sample.t_ns > *imu_stamps_.newest();
  if (later && imu_repeats_.repeats(sample)) {
    ++counts.repeated;
    verdict.repeated = true;
    return verdict;
  }
  const double step = imu_stamps_.newest() ? seconds_between(*imu_stamps_.newest(), sample.t_ns) : 0.0;
  const double refused = imu_stamps_.refused();
  const Stamp stamp = imu_stamps_.judge(sample.t_ns);
  if (stamp == Stamp::not_later || stamp == Stamp::far_ahead) {
    ++(stamp == Stamp::not_later ? counts.not_later : counts.far_ahead);
    return verdict;
  }
  ++counts.accepted;
  if (step > kMissed * imu_interval_) ++counts.gaps;
  verdict.accepted = true;
  verdict.interval = imu_interval_;
  verdict.unseen = is_clock_jump(step - imu_interval_) ? step : 0.0;
  verdict.refused = refused;
  verdict.gap = step > longest_silence(imu_interval_);
  const double intervals = std::min(std::max(1.0, step / imu_interval_), static_cast<double>(kCapacity));
  verdict.lost = static_cast<int>(std::lround(intervals)) - 1;
  const double change = 1.0 + 1.0 / std::min(static_cast<double>(counts.accepted), 1.0 * kToKnow);
  if (step > 0.0) imu_interval_ *= step > imu_interval_ ? change : 1.0 / change;
  verdict.begins_anew = stamp == Stamp::set_back || step > kLostAfter;
  if (stamp == Stamp::set_back) verdict.clock_shift = imu_stamps_.clock_shift();
  return verdict;
}

/// Is a reading of another sensor later than the one before, and near the inertial samples? Where the one before lies
/// far ahead of these, its own stamp was false, and it does not count.
bool InputGuard::takes_stamp(TimeNs t_ns, std::optional<TimeNs> state_ns, std::optional<TimeNs>& last_ns,
                             StreamCounts& counts) const {
  const auto far_ahead = [newest_ns = imu_stamps_.newest()](TimeNs stamp_ns) {
    return newest_ns && seconds_between(*newest_ns, stamp_ns) > kStale;
  };
  if (last_ns && far_ahead(*last_ns)) last_ns.reset();
  if (far_ahead(t_ns)) {
    ++counts.far_ahead;
  } else if (last_ns && t_ns <= *last_ns) {
    ++counts.not_later;
  } else if (state_ns && seconds_between(t_ns, *state_ns) > kSilent) {
    ++counts.too_late;
  } else {
    if (last_ns && seconds_between(*last_ns, t_ns) > kStreamGap) ++counts.gaps;
    last_ns = t_ns;
    return true;
  }
  return false;
}

Verdict InputGuard::judge(const EncoderSample& sample, std::optional<TimeNs> state_ns, EncoderReader& reader) {
  StreamCounts& counts = counts_.encoder;
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max() / 2;  // differences must not overflow
  const auto counter = [](std::int64_t n) { return n > -most && n < most; };
  if (!is_time(sample.t_ns) || !counter(sample.left_count) || !counter(sample.right_count)) {
    ++counts.implausible;
    return Verdict::impossible;
  }
  if (!takes_stamp(sample.t_ns, state_ns, last_encoder_ns_, counts)) return Verdict::mistimed;
  if (reader.last()) {
    const double dt = seconds_between(reader.last()->t_ns, sample.t_ns);
    if (dt <= 0.0 || dt > reader.longest_interval()) {  // not later than a reading whose stamp was false, or a gap
      reader.clear();
    } else if (reader.largest_angle(sample) > kPossible.turn * (dt + kClockJump)) {  // or the counter was set anew
      reader.clear();
      static_cast<void>(reader.add(sample));
      ++counts.implausible;
      return Verdict::impossible;
    }
  }
  ++counts.accepted;
  return Verdict::accepted;
}

Verdict InputGuard::refuse_encoder() {
  ++counts_.encoder.far_ahead;
  return Verdict::impossible;
}

Verdict InputGuard::judge(const LaserSample& sample, std::optional<TimeNs> state_ns) {
  StreamCounts& counts = counts_.laser;
  const auto any = [&sample](const auto& condition) {
    return std::any_of(sample.range.begin(), sample.range.end(), condition);
  };
  if (any([](double range) { return std::isinf(range); })) {
    ++counts.not_finite;
    return Verdict::impossible;
  }
  if (!is_time(sample.t_ns) || sample.range.size() != beam_count_ ||
      any([](double range) { return range < 0.0 || range > kPossible.range; })) {
    ++counts.implausible;
    return Verdict::impossible;
  }
  if (!takes_stamp(sample.t_ns, state_ns, last_laser_ns_, counts)) return Verdict::mistimed;
  ++counts.accepted;
  return Verdict::accepted;
}

const FeatureFrame& InputGuard::plausible(const FeatureFrame& frame) {
  const auto visible = [](const Eigen::Vector2d& uv) {  // false for NaN
    return std::abs(uv.x()) < kPossible.view && std::abs(uv.y()) < kPossible.view;
  };
  const auto possible = [&](const FeatureObservation& f) {
    return visible(f.left) && (!f.has_right || (stereo_ && visible(f.right)));
  };
  ids_.clear();
  for (const FeatureObservation& feature : frame.features) ids_.push_back(feature.id);
  std::sort(ids_.begin(), ids_.end());
  const bool twice = std::adjacent_find(ids_.begin(), ids_.end()) != ids_.end();
  if (!twice && std::all_of(frame.features.begin(), frame.features.end(), possible)) return frame;

  plausible_frame_ = frame;
  std::vector<FeatureObservation>& features = plausible_frame_.features;
  const auto refused = [&](const FeatureObservation& f) {
    const auto [first, end] = std::equal_range(ids_.begin(), ids_.end(), f.id);
    return !possible(f) || end - first > 1;
  };
  features.erase(std::remove_if(features.begin(), features.end(), refused), features.end());
  counts_.features_rejected += frame.features.size() - features.size();
  return plausible_frame_;
}

void InputGuard::restart() {
  last_encoder_ns_.reset();
  last_laser_ns_.reset();
}

}  // namespace ear
