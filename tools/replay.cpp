#include "tools/replay.h"

namespace ear::tools {

void replay(Recording& recording, Odometry& odometry, const std::function<void(const ReplayedFrame&)>& on_frame) {
  const double offset = recording.calibration().camera_time_offset;
  std::optional<RecordedFrame> waiting;
  const auto hand_over = [&] {
    on_frame({waiting->t_ns, odometry.add_stereo(*waiting)});
    waiting.reset();
  };
  while (auto sample = recording.next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*sample)) {
      odometry.add_imu(*imu);
      if (waiting && imu->t_ns >= waiting->t_ns + static_cast<TimeNs>(1e9 * offset)) hand_over();
    } else if (auto* frame = std::get_if<RecordedFrame>(&*sample)) {
      if (waiting) hand_over();  // the inertial samples stopped
      waiting = std::move(*frame);
    }
    // Encoders and lasers are read, and not used yet.
  }
  if (waiting) hand_over();
}

}  // namespace ear::tools
