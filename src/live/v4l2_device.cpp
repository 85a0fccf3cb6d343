// The part that talks to the kernel. Nothing here is tested without hardware: keep it thin.
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "src/live/video_device.h"

namespace ear::live {
namespace {

constexpr std::uint32_t kBuffers = 4;

struct Format {
  std::uint32_t code;
  PixelLayout layout;
};
constexpr std::array<Format, 3> kFormats{{{V4L2_PIX_FMT_GREY, PixelLayout::grey},
                                          {V4L2_PIX_FMT_YUYV, PixelLayout::yuyv},
                                          {V4L2_PIX_FMT_UYVY, PixelLayout::uyvy}}};

class V4l2Device final : public VideoDevice {
 public:
  V4l2Device(std::string name, int width, int height, double rate_hz) : name_(std::move(name)) {
    file_ = ::open(name_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (file_ < 0) fail("cannot be opened");
    try {
      choose_format(width, height);
      choose_rate(rate_hz);
      map_buffers();
      int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      call(VIDIOC_STREAMON, &type, "does not start");
    } catch (...) {
      release();
      throw;
    }
  }
  ~V4l2Device() override { release(); }
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;
  V4l2Device(V4l2Device&&) = delete;
  V4l2Device& operator=(V4l2Device&&) = delete;

  std::optional<VideoImage> wait(int timeout_ms) override {
    if (held_) call(VIDIOC_QBUF, &*held_, "takes no buffer");
    held_.reset();
    pollfd waiting{file_, POLLIN, 0};
    if (::poll(&waiting, 1, timeout_ms) <= 0) return std::nullopt;
    v4l2_buffer buffer = capture_buffer(0);
    if (::ioctl(file_, VIDIOC_DQBUF, &buffer) != 0) {
      if (errno == EAGAIN) return std::nullopt;
      fail("is gone");
    }
    held_ = buffer;
    const TimeNs t_ns = TimeNs{buffer.timestamp.tv_sec} * 1'000'000'000 + TimeNs{buffer.timestamp.tv_usec} * 1000;
    const auto* const pixels = static_cast<const std::uint8_t*>(buffers_[buffer.index].data);
    return VideoImage{t_ns, grey_view(pixels, width_, height_, stride_, layout_, grey_)};
  }

 private:
  struct Mapping {
    void* data = nullptr;
    std::size_t size = 0;
  };

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(name_ + ": " + what + ": " + std::strerror(errno));
  }
  void call(unsigned long request, void* argument, const char* what) const {
    if (::ioctl(file_, request, argument) != 0) fail(what);
  }
  static v4l2_buffer capture_buffer(std::uint32_t index) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    return buffer;
  }

  void choose_format(int width, int height) {
    for (const Format& candidate : kFormats) {
      v4l2_format format{};
      format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      v4l2_pix_format& pixels = format.fmt.pix;
      pixels.width = static_cast<std::uint32_t>(width);
      pixels.height = static_cast<std::uint32_t>(height);
      pixels.pixelformat = candidate.code;
      if (::ioctl(file_, VIDIOC_S_FMT, &format) != 0 || pixels.pixelformat != candidate.code) continue;
      if (pixels.width != static_cast<std::uint32_t>(width) || pixels.height != static_cast<std::uint32_t>(height))
        continue;
      layout_ = candidate.layout;
      width_ = width;
      height_ = height;
      stride_ = pixels.bytesperline;
      return;
    }
    throw std::runtime_error(name_ + ": gives no images of " + std::to_string(width) + "x" + std::to_string(height) +
                             " as GREY, YUYV or UYVY");
  }

  /// A device that cannot choose keeps its rate, which the log then shows.
  void choose_rate(double rate_hz) const {
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    rate.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000.0 * rate_hz))};
    static_cast<void>(::ioctl(file_, VIDIOC_S_PARM, &rate));
  }

  void map_buffers() {
    v4l2_requestbuffers request{};
    request.count = kBuffers;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    call(VIDIOC_REQBUFS, &request, "gives no buffers");
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer = capture_buffer(i);
      call(VIDIOC_QUERYBUF, &buffer, "gives no buffer");
      void* const data = ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, file_, buffer.m.offset);
      if (data == MAP_FAILED) fail("cannot be mapped");
      buffers_.push_back({data, buffer.length});
      call(VIDIOC_QBUF, &buffer, "takes no buffer");
    }
  }

  void release() {
    for (const Mapping& buffer : buffers_) ::munmap(buffer.data, buffer.size);
    ::close(file_);
  }

  std::string name_;
  int file_ = -1;
  int width_ = 0, height_ = 0;
  std::ptrdiff_t stride_ = 0;
  PixelLayout layout_ = PixelLayout::grey;
  std::vector<Mapping> buffers_;
  std::optional<v4l2_buffer> held_;  ///< whose image the caller looks at
  std::vector<std::uint8_t> grey_;
};

}  // namespace

std::unique_ptr<VideoDevice> open_v4l2(const std::filesystem::path& device, int width, int height, double rate_hz) {
  return std::make_unique<V4l2Device>(device.string(), width, height, rate_hz);
}

}  // namespace ear::live
