#include "tools/replay.h"

#include <algorithm>

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
        camera_offset_ns_(static_cast<TimeNs>(1e9 * recording.calibration().camera_time_offset)),
        steps_(!recording.calibration().cameras.empty(), recording.calibration().encoder.has_value()) {}

  void run() {
    while (const std::optional<Sample> sample = recording_.next()) {
      if (before_sample_) before_sample_(*sample);
      std::visit([this](const auto& s) { take(s); }, *sample);
      if (after_sample_) after_sample_(*sample);
    }
    hand_over();
  }

 private:
  void take(const ImuSample& imu) {
    odometry_.add_imu(imu);
    imu_ns_ = imu.t_ns;
    if (waiting_ && imu_ns_ >= std::min(frame_time(), waiting_until_ns_)) hand_over();
    if (!waiting_ && steps_.due(imu.t_ns)) on_frame_({imu.t_ns, odometry_.step(imu.t_ns)});
  }
  void take(const EncoderSample& encoder) { odometry_.add_encoder(encoder); }
  void take(const LaserSample& laser) { odometry_.add_laser(laser); }
  void take(const RecordedFrame& frame) {
    hand_over();  // there is one waiting only if the inertial samples stopped
    waiting_ = std::make_unique<RecordedFrame>(frame);
    waiting_until_ns_ = imu_ns_ + kLongestWait;
  }

  [[nodiscard]] TimeNs frame_time() const { return waiting_->t_ns + camera_offset_ns_; }

  void hand_over() {
    if (!waiting_) return;
    on_frame_({waiting_->t_ns, odometry_.add_stereo(*waiting_)});
    if (frame_time() <= waiting_until_ns_) steps_.saw_frame(frame_time());  // else it was refused
    waiting_.reset();
  }

  static constexpr TimeNs kLongestWait = 60'000'000;

  Recording& recording_;
  Odometry& odometry_;
  const std::function<void(const ReplayedFrame&)>& on_frame_;
  const std::function<void(const Sample&)>& before_sample_;
  const std::function<void(const Sample&)>& after_sample_;
  TimeNs camera_offset_ns_;
  BlindSteps steps_;
  std::unique_ptr<RecordedFrame> waiting_;
  TimeNs waiting_until_ns_ = 0;  ///< by then the inertial samples of its stamp have come, unless that is wrong
  TimeNs imu_ns_ = 0;            ///< the newest sample
};

}  // namespace

void replay(Recording& recording, Odometry& odometry, const std::function<void(const ReplayedFrame&)>& on_frame,
            const std::function<void(const Sample&)>& before_sample,
            const std::function<void(const Sample&)>& after_sample) {
  Replay(recording, odometry, on_frame, before_sample, after_sample).run();
}

}  // namespace ear::tools
