#include "src/recording/imu_check.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

// No IMU has a smaller range than these, so that equal small values (quantisation at rest) are no clipping.
constexpr double kLeastGyroRange = 2.0;    // [rad/s] 125 deg/s
constexpr double kLeastAccelRange = 19.0;  // [m/s^2] 2 g
constexpr std::size_t kClippedRun = 2;     // samples in a row with exactly the same extreme value

// A second is quiet if gyroscope and accelerometer hardly change and only gravity is felt.
constexpr double kWindow = 1.0;            // [s]
constexpr std::size_t kLeastSamples = 20;  // in a window
constexpr double kRestGyroSpread = 0.02;   // [rad/s]
constexpr double kRestAccelSpread = 0.3;   // [m/s^2]
constexpr double kRestGyro = 0.2;          // [rad/s] the bias is in it
constexpr double kGravity = 9.81;          // [m/s^2]
constexpr double kRestAccel = 0.7;         // [m/s^2]

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void ImuCheck::add(const ImuSample& sample) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = static_cast<std::size_t>(4 * axis);
    follow_extreme(extremes_[first], sample.gyro_B(axis), kLeastGyroRange);
    follow_extreme(extremes_[first + 1], -sample.gyro_B(axis), kLeastGyroRange);
    follow_extreme(extremes_[first + 2], sample.accel_B(axis), kLeastAccelRange);
    follow_extreme(extremes_[first + 3], -sample.accel_B(axis), kLeastAccelRange);
  }
  if (last_ && last_->gyro_B == sample.gyro_B && last_->accel_B == sample.accel_B) ++repeated_;
  follow_rest(sample);
  last_ = sample;
}

// The largest value that an axis ever reaches is where it clips, if it stays there: runs of it are counted, and
// forgotten when a larger value shows that it was not the end of the range.
void ImuCheck::follow_extreme(Extreme& extreme, double value, double floor) {
  if (value >= floor && value > extreme.value) {
    extreme = {value, 1, 0};
  } else if (value >= floor && value == extreme.value) {
    ++extreme.run;
    if (extreme.run == kClippedRun) extreme.clipped += kClippedRun;
    if (extreme.run > kClippedRun) ++extreme.clipped;
  } else {
    extreme.run = 0;
  }
}

void ImuCheck::follow_rest(const ImuSample& sample) {
  if (window_count_ > 0 && seconds_between(window_start_ns_, sample.t_ns) >= kWindow) close_window();
  Vector6 value;
  value << sample.gyro_B, sample.accel_B;
  if (window_count_ == 0) {
    window_start_ns_ = sample.t_ns;
    sum_.setZero();
    sum_of_squares_.setZero();
    sum_of_steps_.setZero();
  } else {
    Vector6 before;
    before << last_->gyro_B, last_->accel_B;
    sum_of_steps_ += (value - before).cwiseAbs2();
  }
  sum_ += value;
  sum_of_squares_ += value.cwiseAbs2();
  window_s_ = seconds_between(window_start_ns_, sample.t_ns);
  ++window_count_;
}

void ImuCheck::close_window() {
  const auto n = static_cast<double>(window_count_);
  const bool enough = window_count_ >= kLeastSamples;
  window_count_ = 0;
  if (!enough) return;

  const Vector6 mean = sum_ / n;
  const Vector6 spread = (sum_of_squares_ / n - mean.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  const bool quiet = spread.head<3>().maxCoeff() < kRestGyroSpread && spread.tail<3>().maxCoeff() < kRestAccelSpread &&
                     mean.head<3>().norm() < kRestGyro && std::abs(mean.tail<3>().norm() - kGravity) < kRestAccel;
  if (!quiet) return;

  // Differences between neighbours leave out whatever moves slowly; their variance is twice that of one sample.
  const double dt = window_s_ / (n - 1.0);
  const Vector6 variance = sum_of_steps_ / (2.0 * (n - 1.0));
  quiet_.push_back({window_start_ns_, last_->t_ns, std::sqrt(variance.head<3>().mean() * dt),
                    std::sqrt(variance.tail<3>().mean() * dt)});
}

ImuReport ImuCheck::report(const Stood& stood) const {
  ImuReport report;
  for (const Extreme& extreme : extremes_) report.clipped += extreme.clipped;
  report.repeated = repeated_;

  std::vector<double> gyro;
  std::vector<double> accel;
  for (const QuietSecond& second : quiet_) {
    if (!stood || !stood(second.begin_ns, second.end_ns)) continue;
    gyro.push_back(second.gyro);
    accel.push_back(second.accel);
  }
  if (!gyro.empty()) report.standing_noise = StandingNoise{median(gyro), median(accel), gyro.size()};
  return report;
}

}  // namespace ear
