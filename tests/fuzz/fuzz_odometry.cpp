// class Odometry with small images, fed by bytes: each first says what is done.
#include <vector>

#include "tests/fuzz/support.h"

namespace {

using namespace ear;

constexpr int kWidth = 96;
constexpr int kHeight = 64;
constexpr int kLongestStride = 127;  // that an odd frame may have

Calibration calibration() {
  Calibration c;
  c.cameras.resize(2);
  for (CameraCalibration& camera : c.cameras) {
    camera.width = kWidth;
    camera.height = kHeight;
    camera.fu = camera.fv = 60.0;
    camera.cu = 0.5 * kWidth;
    camera.cv = 0.5 * kHeight;
    camera.T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  }
  c.cameras[1].T_BC.translation().y() = -0.1;
  c.encoder.emplace();
  return c;
}

class Vehicle {
 public:
  explicit Vehicle(fuzz::Bytes bytes) : bytes_(bytes), odometry_(Config{}, calibration()) {}

  void run() {
    while (bytes_.any()) act(bytes_.take<std::uint8_t>());
  }

 private:
  void act(std::uint8_t what) {
    switch (what % 7) {
      case 0:
        return stand(bytes_.take<std::uint8_t>() % 64);
      case 1: {
        ImuSample s;
        s.t_ns = stamp();
        for (int i = 0; i < 3; ++i) s.gyro_B(i) = bytes_.take<double>();
        for (int i = 0; i < 3; ++i) s.accel_B(i) = bytes_.take<double>();
        return odometry_.add_imu(s);
      }
      case 2:
        return odometry_.add_encoder({stamp(), bytes_.take<std::int32_t>(), bytes_.take<std::int32_t>()});
      case 3:
        return add_frame(stamp());
      case 4:
        if (const auto estimate = odometry_.step(stamp())) fuzz::check(*estimate);
        return;
      case 5:
        if (const auto state = odometry_.predict(stamp())) fuzz::require(state->p_WB.allFinite(), "finite");
        return;
      default:
        if (bytes_.take<std::uint8_t>() % 16 == 0) odometry_.reset();
        return;
    }
  }

  void stand(int count) {
    for (int i = 0; i < count && periods_left_ > 0; ++i, --periods_left_) {
      now_ns_ += 10'000'000;
      ImuSample s;
      s.t_ns = now_ns_;
      s.accel_B.z() = 9.81;
      odometry_.add_imu(s);
      odometry_.add_encoder({now_ns_, 0, 0});
      if (i % 10 == 9) add_frame(now_ns_);
    }
  }

  /// Blocks of grey levels drawn from the input; the right image is the left one, shifted.
  void add_frame(TimeNs t_ns) {
    pixels_.assign(static_cast<std::size_t>(kLongestStride * kHeight), 0);
    std::uint32_t noise = bytes_.take<std::uint32_t>();
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      if (i % 4 == 0 && (i / kWidth) % 4 == 0) noise = noise * 1664525U + 1013904223U;
      pixels_[i] = static_cast<std::uint8_t>(noise >> 24U);
    }
    const auto odd = bytes_.take<std::uint8_t>();
    StereoFrame frame;
    frame.t_ns = t_ns;
    frame.left = {pixels_.data(), kWidth, kHeight, kWidth};
    if (odd % 2 == 0) frame.right = frame.left;
    if (odd == 255) frame.left.width = bytes_.take<std::int8_t>();
    if (odd == 253) frame.right = {pixels_.data(), kWidth, kHeight, bytes_.take<std::int8_t>()};
    if (const auto estimate = odometry_.add_stereo(frame)) fuzz::check(*estimate);
  }

  TimeNs stamp() {
    const auto kind = bytes_.take<std::uint8_t>();
    if (kind % 8 == 0) return bytes_.take<TimeNs>();
    now_ns_ += 1'000'000 * static_cast<TimeNs>(kind / 8);
    return now_ns_;
  }

  fuzz::Bytes bytes_;
  Odometry odometry_;
  std::vector<std::uint8_t> pixels_;
  TimeNs now_ns_ = 1'000'000'000;
  int periods_left_ = 300;  ///< at rest: so long runs do not slow down the search
};

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Vehicle({data, size}).run();
  return 0;
}
