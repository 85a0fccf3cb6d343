// Odometry behind one bounded queue per sensor: the sensors' threads add, one thread estimates.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "ear/odometry.h"
#include "filter/ingest/stamp_guard.h"
#include "src/live_state.h"
#include "src/log/repeat_limit.h"
#include "src/odometry_factory.h"
#include "src/sample_queue.h"

namespace ear {

/// How much waits at most for the thread that estimates.
struct QueueCapacity {
  double seconds = 2.0;         ///< [s] of samples of each sensor but the cameras, at the calibration's rates
  std::size_t frame_slots = 4;  ///< stereo frames
};

/// Samples that were refused because their queue was full; frames also that were dropped because the thread that
/// estimates was too far behind.
struct Overflows {
  std::uint64_t imu = 0, encoder = 0, laser = 0, frames = 0;
};

/// A stereo frame that owns its pixels, in rows without gaps.
struct QueuedFrame {
  TimeNs t_ns = 0;
  std::vector<std::uint8_t> left, right;  ///< of the cameras' sizes
  bool has_right = false;
};

/// With memory for images of these cameras.
[[nodiscard]] QueuedFrame empty_frame(const std::vector<CameraCalibration>& cameras);
[[nodiscard]] StereoFrame view_of(const QueuedFrame& frame, const std::vector<CameraCalibration>& cameras);

/// What became of the oldest frame.
enum class Progress : std::uint8_t {
  no_frame,  ///< none is complete
  taken,     ///< the estimator refused it, or has not started
  estimated
};

class QueuedOdometry {
 public:
  static constexpr std::size_t kMaxBeams = 3;

  /// One reading of the beams, in a form that owns no memory; as LaserSample.
  struct Ranges {
    TimeNs t_ns = 0;
    std::array<double, kMaxBeams> range{};
  };

  /// Throws std::invalid_argument, naming the field. `clock` as for Odometry; `make`: in place of the filter.
  QueuedOdometry(const Config& config, const Calibration& calibration, const QueueCapacity& capacity, Clock clock = {},
                 MakeEstimator make = {});

  /// Each by one thread. False: the queue is full; the sample is counted.
  bool add_imu(const ImuSample& sample) {
    live_.add(sample);
    return add(imu_, sample);
  }
  bool add_encoder(const EncoderSample& sample) { return add(encoder_, sample); }
  bool add_laser(const Ranges& ranges) { return add(laser_, ranges); }
  /// Copies the images, which have the size in the calibration.
  bool add_stereo(const StereoFrame& frame);

  /// The newest state, carried on to the newest inertial sample, by the thread that adds these: it waits for nobody.
  [[nodiscard]] std::optional<NavState> live() const { return live_.state(); }

  /// All that follows belongs to the thread that estimates. Hands over what waits, ordered by time, up to the oldest
  /// frame, and that frame once inertial samples reach it or all slots are taken. With a budget
  /// (PerformanceConfig::budget_ms), frames but the newest are dropped while more than half of the inertial samples'
  /// queue waits. `keep`, if there is one, gets a frame that was taken, in exchange for its own: an empty_frame().
  Progress process(std::optional<Estimate>& estimate, QueuedFrame* keep = nullptr);
  /// Hands over all samples that wait, and no frame: for when none comes. One that comes meanwhile is still there.
  void hand_over_samples();
  /// The time of the oldest frame that waits (IMU time), or nothing.
  [[nodiscard]] std::optional<TimeNs> next_frame_ns() const;
  void start_at(const GivenStart& start) { odometry_.start_at(start); }
  std::optional<Estimate> step(TimeNs t_ns);
  void reset();

  [[nodiscard]] const Odometry& odometry() const { return odometry_; }
  /// By any thread.
  [[nodiscard]] const std::vector<CameraCalibration>& cameras() const { return cameras_; }
  [[nodiscard]] Overflows overflows() const;

 private:
  template <typename T>
  struct Inlet {
    SampleQueue<T> queue;
    std::atomic<std::uint64_t> overflows{0};
    double time_offset;  ///< [s] added to a stamp gives IMU time

    Inlet(std::size_t capacity, const T& element, double offset = 0.0)
        : queue(capacity, element), time_offset(offset) {}
  };
  template <typename T>
  static bool add(Inlet<T>& inlet, const T& sample) {
    T* const slot = inlet.queue.slot_to_fill();
    if (slot == nullptr) {
      inlet.overflows.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    *slot = sample;
    inlet.queue.push();
    return true;
  }

  /// The largest number for null.
  template <typename T>
  [[nodiscard]] static TimeNs imu_time(const T* sample, double time_offset = 0.0) {
    return sample == nullptr ? std::numeric_limits<TimeNs>::max() : later_by(time_offset, sample->t_ns);
  }
  void drop_old_frames();
  void hand_over(const ImuSample& sample);
  void hand_over(TimeNs until_ns);
  void log_overflows();
  void set_live_state();

  Odometry odometry_;
  bool drops_frames_;
  std::vector<CameraCalibration> cameras_;
  Inlet<ImuSample> imu_;
  Inlet<EncoderSample> encoder_;
  Inlet<Ranges> laser_;
  Inlet<QueuedFrame> frames_;
  LaserSample laser_sample_;                                   ///< reused
  StampGuard imu_stamps_;                                      ///< as the estimator judges them
  TimeNs newest_imu_ns_ = std::numeric_limits<TimeNs>::min();  ///< that was handed over and is no false one
  LiveState live_;
  Overflows logged_;  ///< that the log knows of
  RepeatLimit log_limit_{10.0};
};

}  // namespace ear
