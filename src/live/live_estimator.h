// The estimator of a live process: sensors' threads add samples, a thread of its own estimates.
//
// The order in which samples reach the estimator does not depend on how busy the machine is: a frame, or a step
// without images, is handed over once the inertial samples reach it, and the wheels' and beams' readings that are no
// later than these are there. So the same samples from a recording give the same estimates, bit for bit.
#pragma once

#include <semaphore.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <thread>

#include "src/blind_steps.h"
#include "src/queued_odometry.h"

namespace ear::live {

/// What became of one stereo frame, or of a step without one.
struct LiveFrame {
  TimeNs t_ns = 0;                   ///< IMU time
  std::optional<Estimate> estimate;  ///< empty before the start, while lost, and of a frame that was left out
  Status status = Status::waiting_for_imu;
  Health health;
};

/// One inertial sample, with the newest state carried on to it.
struct LiveSample {
  ImuSample imu;
  std::optional<NavState> state;  ///< nothing before the start, lost, or after 2 s on inertia alone
};

/// Who is told, by the estimator's thread, which is held up as long as that takes; each may be empty.
struct LiveListeners {
  std::function<void(const LiveFrame&, const Odometry&)> on_frame;
  std::function<void(const LiveSample&)> on_imu;
  std::function<QueuedFrame*()> keep_frame =
      {};  ///< before a frame: where it is to be kept, as QueuedOdometry::process
};

class LiveEstimator {
 public:
  /// Begins. `make` as for QueuedOdometry, which it throws as.
  LiveEstimator(const Config& config, const Calibration& calibration, const QueueCapacity& capacity,
                LiveListeners listeners, MakeEstimator make = {});
  ~LiveEstimator();  ///< as stop()
  LiveEstimator(const LiveEstimator&) = delete;
  LiveEstimator& operator=(const LiveEstimator&) = delete;
  LiveEstimator(LiveEstimator&&) = delete;
  LiveEstimator& operator=(LiveEstimator&&) = delete;

  /// Each by one thread; none waits. False: the queue was full, and the sample is counted in overflows(). `state` gets
  /// the newest state, carried on to this sample, unless it is null.
  bool add_imu(const ImuSample& sample, std::optional<NavState>* state = nullptr);
  bool add_encoder(const EncoderSample& sample);
  bool add_laser(const QueuedOdometry::Ranges& ranges);
  /// Copies the images, which must have the calibration's size.
  bool add_stereo(const StereoFrame& frame);

  /// Estimates what is complete, and ends the thread. No sensor adds any more.
  void stop();

  [[nodiscard]] Overflows overflows() const { return queued_.overflows(); }
  /// Frames and steps that did not wait any longer for readings of wheels or beams: the same samples from a recording
  /// may give other last digits.
  [[nodiscard]] std::uint64_t impatient() const { return impatient_; }

 private:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::min();
  /// A stream whose readings belong before the frames that are later.
  struct Beside {
    std::atomic<TimeNs> newest_ns{kNever};  ///< IMU time
    TimeNs period_ns = 0;                   ///< 0: there is no such sensor
    double time_offset = 0.0;               ///< [s] added to a stamp gives IMU time
    std::optional<TimeNs> given_up_ns;      ///< its newest reading as it was waited for in vain
  };

  void run();
  void count_waiting();
  [[nodiscard]] bool advance();
  [[nodiscard]] bool must_wait();
  [[nodiscard]] bool take_step();
  [[nodiscard]] bool take_frame(TimeNs frame_ns);
  void take_sample();
  void report(std::optional<Estimate> estimate, TimeNs t_ns);
  [[nodiscard]] bool is_owed(const Beside& stream) const;
  void wake() { ::sem_post(&news_); }

  QueuedOdometry queued_;
  SampleQueue<LiveSample> samples_;  ///< for the listener, and to know how far the inertial samples reach
  Beside encoder_, laser_;
  LiveListeners listeners_;
  BlindSteps steps_;
  std::optional<TimeNs> step_ns_;                   ///< a step that is due
  TimeNs reached_ns_;                               ///< the newest inertial stamp taken
  std::optional<TimeNs> handed_over_ns_;            ///< up to here samples were given to the estimator
  std::optional<std::chrono::nanoseconds> waited_;  ///< so long a frame or step has waited for other sensors
  std::chrono::steady_clock::time_point looked_;    ///< when the thread last looked for samples
  std::atomic<std::uint64_t> impatient_{0};
  sem_t news_{};
  std::atomic<bool> stop_ = false;
  std::thread thread_;  ///< last: it uses all else
};

}  // namespace ear::live
