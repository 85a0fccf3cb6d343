#include "calibration/allan.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "filter/ingest/median.h"

namespace ear::calibration {
namespace {

constexpr double kShortest = 2.0;        // [s] of standing
constexpr double kFewestClusters = 9.0;  // of the longest averaging time
constexpr double kSure = 3.0;            // a walk is claimed where it is this many sigmas from none
constexpr double kWindow = 0.5;          // [s] over which standing is looked for
constexpr double kOverlap = 1.4;         // neighbouring averaging times see the same noise
constexpr double kTurns = 0.02;          // [rad/s] of a window's mean from the first one's
constexpr double kTilts = 0.2;           // [m/s^2]
constexpr double kShakes = 2.0;          // times the spread of the quietest window
constexpr double kFirstTau = 0.02;       // [s] below, filters and digits of the sensor show
constexpr double kJitterTime = 0.01;     // [s] means that jitter is told from
constexpr double kMoves = 2.0;           // times the jitter at rest: what a gyroscope spreads over a moving half second
constexpr double kLeastMotion = 3.0;     // [s]

double squared(double x) { return x * x; }

/// Overlapping Allan variance with clusters of m samples, from the running sum (one longer than the signal).
double allan_variance(const std::vector<double>& sum, std::size_t m) {
  double total = 0.0;
  const std::size_t count = sum.size() - 2 * m;
  for (std::size_t i = 0; i < count; ++i) total += squared(sum[i + 2 * m] - 2.0 * sum[i + m] + sum[i]);
  return total / (2.0 * squared(static_cast<double>(m)) * static_cast<double>(count));
}

/// Of white noise, for overlapping clusters: what the variance of the estimate amounts to.
double degrees_of_freedom(std::size_t samples, std::size_t m) {
  const auto n = static_cast<double>(samples);
  const auto k = static_cast<double>(m);
  return (3.0 * (n - 1.0) / (2.0 * k) - 2.0 * (n - 2.0) / n) * 4.0 * k * k / (4.0 * k * k + 5.0);
}

/// variance(tau) = N^2 / tau + K^2 tau / 3, by weighted least squares; each octave counts as independent.
void fit(AllanResult& result) {
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  for (int iteration = 0; iteration < 20; ++iteration) {
    A.setZero();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (const AllanPoint& point : result.points) {
      if (point.tau < kFirstTau) continue;
      const Eigen::Vector2d h(1.0 / point.tau, point.tau / 3.0);
      const double variance = squared(point.deviation);
      // The spread is that of the model's variance, not of the one that was measured.
      const double model = iteration == 0 ? variance : std::max(h.dot(x), 1e-12 * variance);
      const double weight = 1.0 / squared(2.0 * point.relative_sigma * model);
      A += weight * h * h.transpose();
      b += weight * variance * h;
    }
    if (!(A.determinant() > 0.0)) return;
    x = A.inverse() * b;
    if (x(1) < 0.0) x = Eigen::Vector2d(b(0) / A(0, 0), 0.0);
  }
  const Eigen::Matrix2d P = A.inverse();
  if (x(0) > 0.0) result.white = Measured{std::sqrt(x(0)), std::sqrt(P(0, 0)) / (2.0 * std::sqrt(x(0)))};
  const double spread = std::sqrt(P(1, 1));
  if (x(1) > kSure * spread) {
    result.random_walk = Measured{std::sqrt(x(1)), spread / (2.0 * std::sqrt(x(1)))};
  } else {
    result.walk_below = std::sqrt(x(1) + 2.0 * spread);
  }
}

/// Means and spread of half a second.
struct Window {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();
  double gyro_spread = 0.0;
};

Window window_of(const std::vector<ImuSample>& imu, std::size_t from, std::size_t size) {
  Window window;
  const auto n = static_cast<double>(size);
  for (std::size_t k = from; k < from + size; ++k) {
    window.gyro += imu[k].gyro_B / n;
    window.accel += imu[k].accel_B / n;
  }
  double sum = 0.0;
  for (std::size_t k = from; k < from + size; ++k) sum += (imu[k].gyro_B - window.gyro).squaredNorm() / n;
  window.gyro_spread = std::sqrt(sum);
  return window;
}

/// First and last index of the longest stretch that neither moves nor shakes: where rotors idle, a body is at rest, but
/// the spread is not that of the sensor.
std::pair<std::size_t, std::size_t> longest_rest(const std::vector<ImuSample>& imu, double interval) {
  const auto size = std::max<std::size_t>(2, static_cast<std::size_t>(std::lround(kWindow / interval)));
  std::vector<Window> windows;
  for (std::size_t i = 0; i + size <= imu.size(); i += size) windows.push_back(window_of(imu, i, size));
  if (windows.empty()) return {0, 0};
  const auto quieter = [](const Window& a, const Window& b) { return a.gyro_spread < b.gyro_spread; };
  const double quiet = std::min_element(windows.begin(), windows.end(), quieter)->gyro_spread;
  std::size_t best = 0, best_size = 0, begin = 0;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const bool moves = (windows[i].gyro - windows[begin].gyro).norm() > kTurns ||
                       (windows[i].accel - windows[begin].accel).norm() > kTilts;
    if (moves) begin = i;
    if (windows[i].gyro_spread > kShakes * quiet) {
      begin = i + 1;
      continue;
    }
    if (i + 1 - begin > best_size) {
      best = begin;
      best_size = i + 1 - begin;
    }
  }
  return {best * size, (best + best_size) * size};
}

double median_interval(const std::vector<ImuSample>& imu) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < imu.size(); ++i) intervals.push_back(seconds_between(imu[i - 1].t_ns, imu[i].t_ns));
  return upper_median(intervals);
}

double component(const ImuSample& sample, std::size_t axis) {
  const auto k = static_cast<Eigen::Index>(axis);
  return axis < 3 ? sample.gyro_B(k) : sample.accel_B(k - 3);
}

/// Of white noise, the fourth difference of means has 70 times their variance; of a motion of 5 Hz, a thousandth.
double jitter_of(const std::vector<ImuSample>& imu, std::size_t from, std::size_t to, std::size_t axis,
                 double interval) {
  const auto m = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(kJitterTime / interval)));
  std::vector<double> means;
  for (std::size_t i = from; i + m <= to; i += m) {
    double sum = 0.0;
    for (std::size_t k = i; k < i + m; ++k) sum += component(imu[k], axis);
    means.push_back(sum / static_cast<double>(m));
  }
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i + 4 < means.size(); ++i) {
    sum += squared(means[i] - 4.0 * means[i + 1] + 6.0 * means[i + 2] - 4.0 * means[i + 3] + means[i + 4]);
    count += 1.0;
  }
  constexpr double kOfFourth = 70.0;
  return count > 0.0 ? std::sqrt(sum / count / kOfFourth * static_cast<double>(m) * interval) : 0.0;
}

}  // namespace

AllanResult allan(const std::vector<double>& signal, double interval) {
  AllanResult result;
  double mean = 0.0;
  for (const double value : signal) mean += value / static_cast<double>(signal.size());
  std::vector<double> sum(1, 0.0);
  for (const double value : signal) sum.push_back(sum.back() + value - mean);
  for (std::size_t m = 1; kFewestClusters * static_cast<double>(m) <= static_cast<double>(signal.size()); m *= 2) {
    const double freedom = std::max(1.0, degrees_of_freedom(signal.size(), m));
    result.points.push_back(
        {static_cast<double>(m) * interval, std::sqrt(allan_variance(sum, m)), kOverlap / std::sqrt(2.0 * freedom)});
  }
  fit(result);
  return result;
}

ImuNoise noise_at_rest(const std::vector<ImuSample>& imu) {
  if (imu.size() < 100) throw std::invalid_argument("hardly any inertial samples: " + std::to_string(imu.size()));
  const double interval = median_interval(imu);
  const auto [from, to] = longest_rest(imu, interval);
  ImuNoise result;
  result.duration = static_cast<double>(to - from) * interval;
  result.rate_hz = 1.0 / interval;
  if (result.duration < kShortest) {
    throw std::invalid_argument("it stands for " + std::to_string(result.duration) +
                                " s at most; 2 s are needed for "
                                "the white noise, an hour and more for the random walk");
  }
  std::vector<double> signal(to - from);
  for (int axis = 0; axis < 6; ++axis) {
    for (std::size_t i = from; i < to; ++i) {
      signal[i - from] = component(imu[i], static_cast<std::size_t>(axis));
    }
    result.axes.push_back(allan(signal, interval));
    result.jitter[static_cast<std::size_t>(axis)] = jitter_of(imu, from, to, static_cast<std::size_t>(axis), interval);
  }
  return result;
}

MotionNoise noise_in_motion(const ImuNoise& rest, const std::vector<ImuSample>& imu) {
  const double interval = imu.size() < 100 ? 0.0 : median_interval(imu);
  if (!(std::abs(interval * rest.rate_hz - 1.0) < 0.1)) {
    throw std::invalid_argument("noise in motion: samples at another rate than at rest, or hardly any");
  }
  const auto size = static_cast<std::size_t>(std::lround(kWindow / interval));
  const double turns = std::sqrt(squared(rest.jitter[0]) + squared(rest.jitter[1]) + squared(rest.jitter[2]));
  std::array<std::vector<double>, 6> jitter;
  for (std::size_t i = 0; i + size <= imu.size(); i += size) {
    if (window_of(imu, i, size).gyro_spread < kMoves * turns / std::sqrt(interval)) continue;
    for (std::size_t axis = 0; axis < 6; ++axis) jitter[axis].push_back(jitter_of(imu, i, i + size, axis, interval));
  }
  MotionNoise result;
  result.duration = static_cast<double>(jitter[0].size() * size) * interval;
  if (result.duration < kLeastMotion) {
    throw std::invalid_argument("it moves for " + std::to_string(result.duration) + " s; 3 s are needed");
  }
  // Relative, of the jitter at rest: 1 + 2 (0.8^2 + 0.4^2 + 0.11^2) of two fourth differences are not independent.
  const double at_rest = std::sqrt(2.63 / 2.0 * kJitterTime / rest.duration);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    std::vector<double>& values = jitter[axis];
    const double middle = upper_median(values);
    std::vector<double> apart;
    apart.reserve(values.size());
    for (const double value : values) apart.push_back(std::abs(value - middle));
    constexpr double kOfMedian = 1.4826 * 1.2533;  // spread of single ones from median to sigma; of their median
    const double sigma = kOfMedian * upper_median(apart) / std::sqrt(static_cast<double>(values.size()));
    const double times = middle / rest.jitter[axis];
    result.times[axis] = {times, std::hypot(sigma / rest.jitter[axis], at_rest * times)};
  }
  return result;
}

}  // namespace ear::calibration
