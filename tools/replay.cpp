#include "tools/replay.h"

#include <algorithm>
#include <deque>

#include "src/blind_steps.h"

namespace ear::tools {
namespace {

class Replay {
 public:
  Replay(Recording& recording, Odometry& odometry, const std::function<void(const ReplayedFrame&)>& on_frame,
         const std::function<void(const Sample&)>& before_sample,
         const std::function<void(const Sample&)>& after_sample)
      : recording_(recording),
        odometry_(odometry),
        on_frame_(on_frame),
        before_sample_(before_sample),
        after_sample_(after_sample),
        steps_(!recording.calibration().cameras.empty(), recording.calibration().encoder.has_value()) {}

  void run() {
    while (const std::optional<Sample> sample = recording_.next()) {
      if (before_sample_) before_sample_(*sample);
      std::visit([this](const auto& s) { take(s); }, *sample);
      if (after_sample_) after_sample_(*sample);
    }
    while (!waiting_.empty()) hand_over();
  }

 private:
  void take(const ImuSample& imu) {
    odometry_.add_imu(imu);
    imu_ns_ = imu.t_ns;
    while (!waiting_.empty() && imu_ns_ >= std::min(frame_time(), waits_until())) hand_over();
    if (!waiting_.empty()) return;
    const TimeNs t_ns = step_time(imu.t_ns, odometry_.frame_time(imu.t_ns));
    if (steps_.due(t_ns)) on_frame_({t_ns, odometry_.step(t_ns)});
  }
  void take(const EncoderSample& encoder) { odometry_.add_encoder(encoder); }
  void take(const LaserSample& laser) { odometry_.add_laser(laser); }
  void take(const RecordedFrame& frame) {
    const bool samples_stopped = !waiting_.empty() && waiting_.back().read_ns == imu_ns_;
    if (samples_stopped || waits_too_long(frame.t_ns)) hand_over();
    waiting_.push_back({frame, imu_ns_});
  }

  struct WaitingFrame {
    RecordedFrame frame;
    TimeNs read_ns = 0;  ///< the newest inertial sample then
  };

  [[nodiscard]] TimeNs frame_time() const { return odometry_.frame_time(waiting_.front().frame.t_ns); }

  /// For the inertial samples of the oldest frame.
  [[nodiscard]] TimeNs longest_wait() const {
    const TimeNs calibrated = later_by(recording_.calibration().camera_time_offset, waiting_.front().frame.t_ns);
    return kLongestWait + std::max<TimeNs>(0, duration_ns(calibrated, frame_time()));
  }
  /// By then they have come, unless its stamp is wrong.
  [[nodiscard]] TimeNs waits_until() const { return waiting_.front().read_ns + longest_wait(); }
  /// Where the inertial samples were set back, another frame shows it.
  [[nodiscard]] bool waits_too_long(TimeNs next_frame_ns) const {
    return !waiting_.empty() && duration_ns(waiting_.front().frame.t_ns, next_frame_ns) > longest_wait();
  }

  void hand_over() {
    const RecordedFrame& frame = waiting_.front().frame;
    const TimeNs t_ns = frame_time();
    const bool usable = t_ns <= waits_until();  // else it is refused
    on_frame_({frame.t_ns, odometry_.add_stereo(frame)});
    if (usable) steps_.saw_frame(t_ns);
    waiting_.pop_front();
  }

  static constexpr TimeNs kLongestWait = 60'000'000;

  Recording& recording_;
  Odometry& odometry_;
  const std::function<void(const ReplayedFrame&)>& on_frame_;
  const std::function<void(const Sample&)>& before_sample_;
  const std::function<void(const Sample&)>& after_sample_;
  BlindSteps steps_;
  std::deque<WaitingFrame> waiting_;
  TimeNs imu_ns_ = 0;  ///< the newest sample
};

}  // namespace

void replay(Recording& recording, Odometry& odometry, const std::function<void(const ReplayedFrame&)>& on_frame,
            const std::function<void(const Sample&)>& before_sample,
            const std::function<void(const Sample&)>& after_sample) {
  Replay(recording, odometry, on_frame, before_sample, after_sample).run();
}

}  // namespace ear::tools
