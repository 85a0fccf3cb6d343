#include "src/queued_odometry.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "src/log/log.h"

namespace ear {
namespace {

constexpr double kMinCapacity = 16.0;  // elements of a queue
constexpr double kMaxSeconds = 60.0;
constexpr std::size_t kMaxFrameSlots = 64;
constexpr int kMaxImageSize = 16384;  // [px]
constexpr double kFarAhead = 1.0;     // [s] of a frame: such inertial samples do not show what it waits for

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(what);
}

const Calibration& checked(const Calibration& calibration, const QueueCapacity& capacity) {
  require(capacity.seconds > 0.0 && capacity.seconds <= kMaxSeconds, "queue_seconds: must be positive, at most 60");
  require(capacity.frame_slots >= 1 && capacity.frame_slots <= kMaxFrameSlots, "frame_slots: 1 to 64");
  for (const CameraCalibration& camera : calibration.cameras) {
    require(camera.width > 0 && camera.height > 0 && camera.width <= kMaxImageSize && camera.height <= kMaxImageSize,
            "calibration: a camera's width and height must be positive, at most 16384");
  }
  const auto is_rate = [](double hz) { return hz > 0.0 && hz <= 1e5; };
  require(is_rate(calibration.imu.rate_hz), "calibration: the rate of the IMU must be positive, at most 100 kHz");
  require(!calibration.encoder || is_rate(calibration.encoder->rate_hz),
          "calibration: the rate of the encoders must be positive, at most 100 kHz");
  require(!calibration.lasers || is_rate(calibration.lasers->rate_hz),
          "calibration: the rate of the lasers must be positive, at most 100 kHz");
  require(!calibration.lasers || calibration.lasers->beams.size() <= QueuedOdometry::kMaxBeams,
          "calibration: at most three laser beams");
  require(std::abs(calibration.camera_time_offset) <= kLargestTimeOffset,
          "calibration: camera_time_offset must be a number of seconds, at most an hour");
  return calibration;
}

std::size_t elements(double seconds, double rate_hz) {
  return static_cast<std::size_t>(std::max(kMinCapacity, std::ceil(seconds * rate_hz)));
}

std::size_t pixels(const std::vector<CameraCalibration>& cameras, std::size_t camera) {
  if (camera >= cameras.size()) return 0;
  return static_cast<std::size_t>(cameras[camera].width) * static_cast<std::size_t>(cameras[camera].height);
}

void copy_rows(const ImageView& from, std::vector<std::uint8_t>& to) {
  const std::ptrdiff_t width = from.width;
  for (std::ptrdiff_t row = 0; row < from.height; ++row) {
    std::copy_n(from.data + row * from.stride, width, to.begin() + row * width);
  }
}

ImageView view_of_rows(const std::vector<std::uint8_t>& rows, const CameraCalibration& camera) {
  return {rows.data(), camera.width, camera.height, camera.width};
}

}  // namespace

QueuedFrame empty_frame(const std::vector<CameraCalibration>& cameras) {
  return {0, std::vector<std::uint8_t>(pixels(cameras, 0)), std::vector<std::uint8_t>(pixels(cameras, 1)), false};
}

StereoFrame view_of(const QueuedFrame& frame, const std::vector<CameraCalibration>& cameras) {
  StereoFrame view;
  view.t_ns = frame.t_ns;
  view.left = view_of_rows(frame.left, cameras.front());
  if (frame.has_right) view.right = view_of_rows(frame.right, cameras[1]);
  return view;
}

QueuedOdometry::QueuedOdometry(const Config& config, const Calibration& calibration, const QueueCapacity& capacity,
                               Clock clock, MakeEstimator make)
    : odometry_(make ? OdometryFactory::make(config, checked(calibration, capacity), std::move(make), std::move(clock))
                     : Odometry(config, checked(calibration, capacity), std::move(clock))),
      drops_frames_(config.performance.budget_ms > 0.0),
      cameras_(calibration.cameras),
      imu_(elements(capacity.seconds, calibration.imu.rate_hz), {}),
      encoder_(calibration.encoder ? elements(capacity.seconds, calibration.encoder->rate_hz) : 0, {},
               calibration.encoder ? calibration.encoder->time_offset : 0.0),
      laser_(calibration.lasers ? elements(capacity.seconds, calibration.lasers->rate_hz) : 0, {},
             calibration.lasers ? calibration.lasers->time_offset : 0.0),
      frames_(calibration.cameras.empty() ? 0 : capacity.frame_slots, empty_frame(calibration.cameras)),
      live_(imu_.queue.capacity()) {
  if (calibration.lasers) laser_sample_.range.resize(calibration.lasers->beams.size());
}

bool QueuedOdometry::add_stereo(const StereoFrame& frame) {
  QueuedFrame* const slot = frames_.queue.slot_to_fill();
  if (slot == nullptr) {
    frames_.overflows.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  slot->t_ns = frame.t_ns;
  copy_rows(frame.left, slot->left);
  slot->has_right = cameras_.size() > 1 && !frame.right.empty();
  if (slot->has_right) copy_rows(frame.right, slot->right);
  frames_.queue.push();
  return true;
}

void QueuedOdometry::hand_over(const ImuSample& sample) {
  odometry_.add_imu(sample);
  if (!is_time(sample.t_ns)) return;
  const Stamp stamp = imu_stamps_.judge(sample.t_ns);
  if (stamp != Stamp::not_later && stamp != Stamp::far_ahead) newest_imu_ns_ = sample.t_ns;
}

/// Up to and with the first inertial sample that is not earlier than `until_ns`: an interval ends between two samples.
/// All that waits where the inertial clock is far ahead: it has jumped, or the others were set back.
void QueuedOdometry::hand_over(TimeNs until_ns) {
  while (newest_imu_ns_ < until_ns || seconds_between(until_ns, newest_imu_ns_) > kFarAhead) {
    const ImuSample* const imu = imu_.queue.front();
    const EncoderSample* const encoder = encoder_.queue.front();
    const Ranges* const laser = laser_.queue.front();
    const TimeNs encoder_ns = imu_time(encoder, encoder_.time_offset);
    const TimeNs earliest = std::min({imu_time(imu), encoder_ns, imu_time(laser, laser_.time_offset)});
    if (imu != nullptr && imu->t_ns == earliest) {
      hand_over(*imu);
      imu_.queue.pop();
    } else if (encoder != nullptr && encoder_ns == earliest) {
      odometry_.add_encoder(*encoder);
      encoder_.queue.pop();
    } else if (laser != nullptr) {
      laser_sample_.t_ns = laser->t_ns;
      std::copy_n(laser->range.begin(), laser_sample_.range.size(), laser_sample_.range.begin());
      odometry_.add_laser(laser_sample_);
      laser_.queue.pop();
    } else {
      return;  // nothing waits
    }
  }
}

/// So that no inertial samples are lost because a frame takes too long.
void QueuedOdometry::drop_old_frames() {
  while (2 * imu_.queue.size() > imu_.queue.capacity() && frames_.queue.size() > 1) {
    frames_.queue.pop();
    frames_.overflows.fetch_add(1, std::memory_order_relaxed);
    hand_over(odometry_.frame_time(frames_.queue.front()->t_ns));
  }
}

void QueuedOdometry::set_live_state() { live_.set(odometry_.predict(newest_imu_ns_), newest_imu_ns_); }

/// By the thread that estimates, since a sensor's must not wait for a file.
void QueuedOdometry::log_overflows() {
  const Overflows now = overflows();
  const bool same = now.imu == logged_.imu && now.encoder == logged_.encoder && now.laser == logged_.laser &&
                    now.frames == logged_.frames;
  if (same) return;
  logged_ = now;
  if (const auto held_back = log_limit_.allows("overflow", newest_imu_ns_)) {
    log_warning("the estimator is behind: refused so far: " + std::to_string(now.imu) + " imu, " +
                std::to_string(now.encoder) + " encoder, " + std::to_string(now.laser) + " laser samples, " +
                std::to_string(now.frames) + " frames" + held_back_text(*held_back));
  }
}

Progress QueuedOdometry::process(std::optional<Estimate>& estimate, QueuedFrame* keep) {
  if (drops_frames_) drop_old_frames();
  log_overflows();
  QueuedFrame* const frame = frames_.queue.front_to_empty();
  if (frame == nullptr) {
    hand_over_samples();
    return Progress::no_frame;
  }
  const TimeNs frame_ns = odometry_.frame_time(frame->t_ns);
  hand_over(frame_ns);
  if (newest_imu_ns_ < frame_ns && !frames_.queue.full()) return Progress::no_frame;
  estimate = odometry_.add_stereo(view_of(*frame, cameras_));
  if (keep != nullptr) std::swap(*frame, *keep);
  frames_.queue.pop();
  set_live_state();
  return estimate ? Progress::estimated : Progress::taken;
}

void QueuedOdometry::hand_over_samples() { hand_over(std::numeric_limits<TimeNs>::max()); }

std::optional<TimeNs> QueuedOdometry::next_frame_ns() const {
  const QueuedFrame* const frame = frames_.queue.front();
  return frame == nullptr ? std::nullopt : std::optional(odometry_.frame_time(frame->t_ns));
}

std::optional<Estimate> QueuedOdometry::step(TimeNs t_ns) {
  hand_over(t_ns);
  std::optional<Estimate> estimate = odometry_.step(t_ns);
  set_live_state();
  return estimate;
}

void QueuedOdometry::reset() {
  const auto drop_all = [](auto& inlet) {
    while (inlet.queue.front() != nullptr) inlet.queue.pop();
  };
  drop_all(imu_);
  drop_all(encoder_);
  drop_all(laser_);
  drop_all(frames_);
  imu_stamps_ = StampGuard{};
  newest_imu_ns_ = std::numeric_limits<TimeNs>::min();
  odometry_.reset();
  live_.set(std::nullopt, 0);
}

Overflows QueuedOdometry::overflows() const {
  const auto count = [](const auto& inlet) { return inlet.overflows.load(std::memory_order_relaxed); };
  return {count(imu_), count(encoder_), count(laser_), count(frames_)};
}

}  // namespace ear
