// Devices that are not there: images from memory, at chosen times.
#include "src/live/stereo_camera.h"

#include <doctest/doctest.h>

#include <chrono>
#include <deque>
#include <mutex>
#include <stdexcept>

using namespace ear;
using namespace ear::live;

namespace {

constexpr int kWidth = 4, kHeight = 2;
constexpr TimeNs kMs = 1'000'000;

class FakeDevice final : public VideoDevice {
 public:
  FakeDevice(int width, std::deque<TimeNs> stamps_ms, bool breaks = false)
      : width_(width), stamps_ms_(std::move(stamps_ms)), breaks_(breaks) {}
  std::optional<VideoImage> wait(int timeout_ms) override {
    if (stamps_ms_.empty()) {
      if (breaks_) throw std::runtime_error("/dev/video9: is gone");
      std::this_thread::sleep_for(std::chrono::milliseconds(timeout_ms / 20));
      return std::nullopt;
    }
    const TimeNs stamp = stamps_ms_.front();
    stamps_ms_.pop_front();
    pixels_.resize(static_cast<std::size_t>(width_ * kHeight));
    for (std::size_t i = 0; i < pixels_.size(); ++i) pixels_[i] = static_cast<std::uint8_t>(i);
    return VideoImage{stamp * kMs, {pixels_.data(), width_, kHeight, width_}};
  }

 private:
  int width_;
  std::deque<TimeNs> stamps_ms_;
  bool breaks_;
  std::vector<std::uint8_t> pixels_;
};

Calibration two_cameras() {
  Calibration calibration;
  CameraCalibration camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fu = camera.fv = 4.0;
  camera.rate_hz = 30.0;
  calibration.cameras = {camera, camera};
  calibration.cameras[1].T_BC.translation().x() = 0.1;
  return calibration;
}

struct Frame {
  TimeNs t_ns = 0;
  int left = 0, right = -1;  ///< the first pixels
};

/// What a camera handed in, once `count` frames came.
std::vector<Frame> frames_of(std::unique_ptr<VideoDevice> left, std::unique_ptr<VideoDevice> right, std::size_t count,
                             double delay = 0.0, std::vector<std::string>* words = nullptr) {
  std::mutex mutex;
  std::vector<Frame> frames;
  const LiveClock clock;
  LiveEstimator estimator(Config{}, two_cameras(), {2.0, 16}, {});
  Intake intake(estimator, two_cameras(), clock,
                {nullptr, nullptr, nullptr, [&](const StereoFrame& frame) {
                   const std::lock_guard lock(mutex);
                   const int other = frame.right.empty() ? -1 : frame.right.data[0];
                   frames.push_back({frame.t_ns - clock.from_monotonic(0), frame.left.data[0], other});
                 }});
  StereoCamera camera(std::move(left), std::move(right), delay, intake);
  for (int i = 0; i < 500; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (words != nullptr) {
      for (std::string& text : camera.look()) words->push_back(std::move(text));
    }
    const std::lock_guard lock(mutex);
    if (frames.size() >= count && (words == nullptr || !words->empty())) break;
  }
  const std::lock_guard lock(mutex);
  return frames;
}

}  // namespace

TEST_CASE("stereo camera: side by side") {
  const auto frames =
      frames_of(std::make_unique<FakeDevice>(2 * kWidth, std::deque<TimeNs>{100, 133}), nullptr, 2, 0.01);
  REQUIRE(frames.size() == 2);
  CHECK(frames[0].t_ns == 90 * kMs);
  CHECK(frames[0].left == 0);
  CHECK(frames[0].right == kWidth);
}

TEST_CASE("stereo camera: two devices, paired by their stamps; a lost image costs one pair") {
  std::vector<std::string> words;
  const auto frames =
      frames_of(std::make_unique<FakeDevice>(kWidth, std::deque<TimeNs>{100, 133, 166, 200}),
                std::make_unique<FakeDevice>(kWidth, std::deque<TimeNs>{67, 101, 167, 199}), 4, 0.0, &words);
  REQUIRE(frames.size() == 4);
  CHECK(frames[0].right == 0);
  CHECK(frames[1].right == -1);  // 133 has no partner
  CHECK(frames[2].right == 0);
  CHECK(frames[3].right == 0);
  REQUIRE_FALSE(words.empty());
  CHECK(words[0].find("no partner within 3 ms") != std::string::npos);
}

TEST_CASE("stereo camera: a device that is gone is said, and nothing else happens") {
  std::vector<std::string> words;
  frames_of(std::make_unique<FakeDevice>(2 * kWidth, std::deque<TimeNs>{100}, true), nullptr, 1, 0.0, &words);
  REQUIRE_FALSE(words.empty());
  CHECK(words[0] == "cameras: /dev/video9: is gone");
}

TEST_CASE("stereo camera: the grey of packed colours") {
  const std::vector<std::uint8_t> yuyv{1, 90, 2, 90, 3, 90, 4, 90};
  std::vector<std::uint8_t> grey;
  const ImageView first = grey_view(yuyv.data(), 2, 2, 4, PixelLayout::yuyv, grey);
  CHECK(std::vector<std::uint8_t>(first.data, first.data + 4) == std::vector<std::uint8_t>{1, 2, 3, 4});
  const ImageView second = grey_view(yuyv.data(), 2, 2, 4, PixelLayout::uyvy, grey);
  CHECK(second.data[3] == 90);
}

TEST_CASE("stereo camera: a device that is not there has a reason") {
  CHECK_THROWS_WITH_AS(static_cast<void>(open_v4l2("/dev/no-video", 640, 480, 30.0)),
                       "/dev/no-video: cannot be opened: No such file or directory", std::runtime_error);
}
