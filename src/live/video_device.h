// A video device, as little of it as is needed: grey images with their times. V4L2 behind it, or what a test puts
// there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "ear/types.h"

namespace ear::live {

/// One image; its memory belongs to the device until it is asked for the next one.
struct VideoImage {
  TimeNs monotonic_ns = 0;  ///< the driver's stamp, CLOCK_MONOTONIC
  ImageView view;
};

class VideoDevice {
 public:
  VideoDevice() = default;
  virtual ~VideoDevice() = default;
  VideoDevice(const VideoDevice&) = delete;
  VideoDevice& operator=(const VideoDevice&) = delete;
  VideoDevice(VideoDevice&&) = delete;
  VideoDevice& operator=(VideoDevice&&) = delete;

  /// The next image; nothing if none came in time. Throws std::runtime_error when the device is gone.
  [[nodiscard]] virtual std::optional<VideoImage> wait(int timeout_ms) = 0;
};

/// How a pixel's brightness lies in memory.
enum class PixelLayout : std::uint8_t { grey, yuyv, uyvy };

/// The grey of packed pixels: a view of `from` itself, or of `grey`, which is filled. `stride`: bytes of a row.
[[nodiscard]] ImageView grey_view(const std::uint8_t* from, int width, int height, std::ptrdiff_t stride,
                                  PixelLayout layout, std::vector<std::uint8_t>& grey);

/// Opens a device of V4L2 and starts it with this size and rate, in one of the layouts above. Throws
/// std::runtime_error, naming device and reason, where it offers no such images.
[[nodiscard]] std::unique_ptr<VideoDevice> open_v4l2(const std::filesystem::path& device, int width, int height,
                                                     double rate_hz);

}  // namespace ear::live
