#include "calibration/first_guess.h"

#include <ceres/jet.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "calibration/bridge.h"
#include "calibration/lens.h"
#include "filter/filter.h"

namespace ear::calibration {
namespace {

constexpr double kLongestGap = 1.0;  // [s] between two states of one piece
constexpr double kBridged = 12.0;    // [s] that inertial samples alone tell how it moved: a hop without cameras
constexpr double kShortest = 5.0;    // [s] of a piece
constexpr double kWhole = 0.8;       // of a drive: a piece that is shorter was lost
constexpr TimeNs kTolerance = 5'000'000;

/// The ray that `now` sees where `given` saw `ray`: Newton's iteration on the pixel.
Eigen::Vector2d through(const CameraCalibration& given, const CameraCalibration& now, const Eigen::Vector2d& ray) {
  using Jet = ceres::Jet<double, 2>;
  const Eigen::Vector2d pixel = to_pixel<double>(given, {}, ray);
  Eigen::Vector2d result = ray;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Matrix<Jet, 2, 1> there =
        to_pixel<Jet>(now, {}, Eigen::Matrix<Jet, 2, 1>(Jet(result.x(), 0), Jet(result.y(), 1)));
    Eigen::Matrix2d J;
    J << there.x().v.transpose(), there.y().v.transpose();
    result += J.inverse() * (pixel - Eigen::Vector2d(there.x().a, there.y().a));
  }
  return result.allFinite() ? result : ray;
}

FeatureFrame through(const Calibration& given, const Calibration& now, FeatureFrame frame) {
  for (FeatureObservation& feature : frame.features) {
    feature.left = through(given.cameras[0], now.cameras[0], feature.left);
    if (feature.has_right) feature.right = through(given.cameras[1], now.cameras[1], feature.right);
  }
  return frame;
}

/// Feeds the samples in the order of time, a frame after the first inertial sample that is later.
class Feed {
 public:
  Feed(const Drive& drive, const Calibration& given, const Calibration& now, const FilterConfig& config,
       double interval)
      : drive_(drive),
        given_(given),
        now_(now),
        filter_(config, now),
        interval_ns_(static_cast<TimeNs>(std::llround(1e9 * interval))),
        encoder_offset_(now.encoder ? now.encoder->time_offset : 0.0),
        laser_offset_(now.lasers ? now.lasers->time_offset : 0.0) {}

  std::vector<GuessedState> run() {
    for (const ImuSample& sample : drive_.imu) {
      filter_.add_imu(sample);
      add_until(later_by(-encoder_offset_, sample.t_ns), drive_.encoders, encoder_,
                [&](const EncoderSample& s) { filter_.add_encoder(s); });
      add_until(later_by(-laser_offset_, sample.t_ns), drive_.lasers, laser_,
                [&](const LaserSample& s) { filter_.add_laser(s); });
      add_until(later_by(-now_.camera_time_offset, sample.t_ns), drive_.frames, frame_,
                [&](const FeatureFrame& f) { take(f); });
      if (given_.cameras.empty() && due(sample.t_ns)) {
        if (const auto estimate = filter_.process_without_image(sample.t_ns)) {
          states_.push_back({estimate->state, sample.t_ns, {}});
        }
      }
    }
    return std::move(states_);
  }

 private:
  template <typename Sample, typename Take>
  void add_until(TimeNs t_ns, const std::vector<Sample>& samples, std::size_t& next, const Take& take) {
    for (; next < samples.size() && samples[next].t_ns <= t_ns; ++next) take(samples[next]);
  }

  void take(const FeatureFrame& frame) {
    const auto estimate = filter_.process(through(given_, now_, frame));
    if (estimate && due(estimate->state.t_ns)) states_.push_back({estimate->state, frame.t_ns, frame.features});
  }

  [[nodiscard]] bool due(TimeNs t_ns) const {
    return states_.empty() || duration_ns(states_.back().state.t_ns, t_ns) >= interval_ns_ - kTolerance;
  }

  const Drive& drive_;
  const Calibration& given_;
  const Calibration& now_;
  Filter filter_;
  TimeNs interval_ns_;
  double encoder_offset_, laser_offset_;  ///< [s] of their clocks
  std::size_t encoder_ = 0, laser_ = 0, frame_ = 0;
  std::vector<GuessedState> states_;
};

/// From the first state to the last of the longest stretch without a gap.
void keep_longest(std::vector<GuessedState>& states) {
  std::size_t best = 0, best_size = 0, begin = 0;
  for (std::size_t i = 1; i <= states.size(); ++i) {
    const bool ends =
        i == states.size() || seconds_between(states[i - 1].state.t_ns, states[i].state.t_ns) > kLongestGap;
    if (!ends) continue;
    if (i - begin > best_size) {
      best = begin;
      best_size = i - begin;
    }
    begin = i;
  }
  states.erase(states.begin() + static_cast<std::ptrdiff_t>(best + best_size), states.end());
  states.erase(states.begin(), states.begin() + static_cast<std::ptrdiff_t>(best));
}

/// From the first state to the last [s].
double length_of(const std::vector<GuessedState>& states) {
  return states.empty() ? 0.0 : seconds_between(states.front().state.t_ns, states.back().state.t_ns);
}

/// The longest piece of what the filter makes of the drive. An image's time may be after the last inertial sample.
std::vector<GuessedState> longest_piece(const Drive& drive, const Calibration& given, const Calibration& now,
                                        const FilterConfig& config, double interval) {
  std::vector<GuessedState> states = Feed(drive, given, now, config, interval).run();
  while (!states.empty() && states.back().state.t_ns > drive.imu.back().t_ns) states.pop_back();
  if (given.cameras.empty()) states = bridge_gaps(states, drive.imu, interval, kLongestGap, kBridged);
  keep_longest(states);
  return states;
}

}  // namespace

FirstGuess guess_motion(const Drive& drive, const Calibration& given, Calibration now, FilterConfig config,
                        double interval) {
  now.imu.accel_scale_sigma.reset();
  config.prior.accel_scale = 0.0;
  const double duration = seconds_between(drive.imu.front().t_ns, drive.imu.back().t_ns);
  FilterConfig cameras = config;
  if (!given.cameras.empty()) cameras.odometer.model = OdometerModel::none;
  FirstGuess guess;
  guess.states = longest_piece(drive, given, now, cameras, interval);
  if (!given.cameras.empty() && given.encoder && length_of(guess.states) < kWhole * duration) {  // the cameras lost it
    std::vector<GuessedState> with_wheels = longest_piece(drive, given, now, config, interval);
    if (length_of(with_wheels) > length_of(guess.states)) guess.states = std::move(with_wheels);
  }
  const double length = length_of(guess.states);
  if (length < kShortest) {
    throw std::invalid_argument(drive.name + ": only " + std::to_string(length) +
                                " s in one piece could be estimated; a calibration needs a start at rest, images with "
                                "texture, and a calibration that is roughly right");
  }
  guess.left_out = duration - length;
  return guess;
}

}  // namespace ear::calibration
