#include "tools/replay.h"

namespace ear::tools {
namespace {

constexpr TimeNs kStep = 50'000'000;       // between estimates without images
constexpr TimeNs kPatience = 150'000'000;  // so long after the last image the next one is missing

class Replay {
 public:
  Replay(Recording& recording, Odometry& odometry, const std::function<void(const ReplayedFrame&)>& on_frame,
         const std::function<void(const Sample&)>& before_sample)
      : recording_(recording),
        odometry_(odometry),
        on_frame_(on_frame),
        before_sample_(before_sample),
        camera_offset_ns_(static_cast<TimeNs>(1e9 * recording.calibration().camera_time_offset)),
        has_camera_(!recording.calibration().cameras.empty()),
        has_wheels_(recording.calibration().encoder.has_value()) {}

  void run() {
    while (const std::optional<Sample> sample = recording_.next()) {
      if (before_sample_) before_sample_(*sample);
      std::visit([this](const auto& s) { take(s); }, *sample);
    }
    hand_over();
  }

 private:
  void take(const ImuSample& imu) {
    odometry_.add_imu(imu);
    if (waiting_ && imu.t_ns >= waiting_->t_ns + camera_offset_ns_) hand_over();
    if (!waiting_) step_if_blind(imu.t_ns);
  }
  void take(const EncoderSample& encoder) { odometry_.add_encoder(encoder); }
  void take(const LaserSample& laser) { odometry_.add_laser(laser); }
  void take(const RecordedFrame& frame) {
    hand_over();  // there is one waiting only if the inertial samples stopped
    waiting_ = std::make_unique<RecordedFrame>(frame);
  }

  void hand_over() {
    if (!waiting_) return;
    on_frame_({waiting_->t_ns, odometry_.add_stereo(*waiting_)});
    last_frame_ns_ = waiting_->t_ns + camera_offset_ns_;
    waiting_.reset();
  }

  /// Without images the wheels carry on: always on a vehicle without a camera, else while images are missing. Without
  /// wheels there is nothing but inertia, and its estimate would be no more than a plausible lie.
  void step_if_blind(TimeNs t_ns) {
    if (!has_wheels_) return;
    if (has_camera_ && (!last_frame_ns_ || t_ns < *last_frame_ns_ + kPatience)) return;
    if (last_step_ns_ && t_ns < *last_step_ns_ + kStep) return;
    last_step_ns_ = t_ns;
    on_frame_({t_ns, odometry_.step(t_ns)});
  }

  Recording& recording_;
  Odometry& odometry_;
  const std::function<void(const ReplayedFrame&)>& on_frame_;
  const std::function<void(const Sample&)>& before_sample_;
  TimeNs camera_offset_ns_;
  bool has_camera_;
  bool has_wheels_;
  std::unique_ptr<RecordedFrame> waiting_;
  std::optional<TimeNs> last_frame_ns_;  // IMU time
  std::optional<TimeNs> last_step_ns_;
};

}  // namespace

void replay(Recording& recording, Odometry& odometry, const std::function<void(const ReplayedFrame&)>& on_frame,
            const std::function<void(const Sample&)>& before_sample) {
  Replay(recording, odometry, on_frame, before_sample).run();
}

}  // namespace ear::tools
