#include "src/ros2/image_messages.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "src/recording/frame_images.h"
#include "src/recording/image_file.h"

namespace ear::ros2 {
namespace {

constexpr TimeNs kSameInstant = 3'000'000;    // as for recordings: src/recording/frame_list.cpp
constexpr std::size_t kMostImages = 8;        // images of one camera
constexpr std::uint32_t kMostPixels = 65536;  // along one side
constexpr int kAsItIs = -1;

/// How an encoding's pixels lie in memory, and OpenCV's way to grey.
struct Encoding {
  const char* name;
  int type;
  int to_grey;
};

constexpr std::array kEncodings{
    Encoding{"mono8", CV_8UC1, kAsItIs},
    Encoding{"8UC1", CV_8UC1, kAsItIs},
    Encoding{"mono16", CV_16UC1, kAsItIs},
    Encoding{"16UC1", CV_16UC1, kAsItIs},
    Encoding{"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY},
    Encoding{"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY},
    Encoding{"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY},
    Encoding{"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY},
    Encoding{"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2GRAY},  // OpenCV names the pattern by its second row
    Encoding{"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2GRAY},
    Encoding{"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2GRAY},
    Encoding{"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2GRAY},
    Encoding{"yuv422", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
    Encoding{"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
};

const Encoding& encoding_of(const RawMessage& message, const std::string& name) {
  const auto* const found =
      std::find_if(kEncodings.begin(), kEncodings.end(), [&](const Encoding& e) { return name == e.name; });
  if (found != kEncodings.end()) return *found;
  std::string known;
  for (const Encoding& e : kEncodings) known += std::string(known.empty() ? "" : ", ") + e.name;
  throw InputError(message.topic + ": encoding '" + name + "' is none of " + known);
}

/// The upper 8 bits, whichever byte is first.
cv::Mat upper_bytes(const cv::Mat& pixels, bool big_endian) {
  cv::Mat native = pixels;
  if (big_endian) {
    native = pixels.clone();
    for (int y = 0; y < native.rows; ++y) {
      auto* const row = native.ptr<std::uint16_t>(y);
      for (int x = 0; x < native.cols; ++x) row[x] = static_cast<std::uint16_t>((row[x] >> 8U) | (row[x] << 8U));
    }
  }
  cv::Mat grey;
  native.convertTo(grey, CV_8U, 1.0 / 256.0);
  return grey;
}

cv::Mat grey_of(const RawMessage& message, Image& image, const std::string& camera, Warnings& warnings) {
  const Encoding& encoding = encoding_of(message, image.encoding);
  const std::size_t row = std::size_t{image.width} * static_cast<std::size_t>(CV_ELEM_SIZE(encoding.type));
  if (image.width == 0 || image.height == 0 || image.width > kMostPixels || image.height > kMostPixels ||
      image.step < row || image.data.size() < std::size_t{image.step} * (image.height - 1) + row) {
    throw InputError(message.topic + ": " + std::to_string(image.data.size()) + " bytes are no image of " +
                     std::to_string(image.width) + " x " + std::to_string(image.height) + " " + image.encoding +
                     " in rows of " + std::to_string(image.step) + " bytes");
  }
  const cv::Mat pixels(static_cast<int>(image.height), static_cast<int>(image.width), encoding.type, image.data.data(),
                       image.step);
  if (encoding.to_grey != kAsItIs) {
    cv::Mat grey;
    cv::cvtColor(pixels, grey, encoding.to_grey);
    return grey;
  }
  if (encoding.type == CV_8UC1) return pixels.clone();
  warnings.add(camera + ": 16-bit image scaled down to 8 bits", message.topic + ": the upper 8 bits are used");
  return upper_bytes(pixels, image.is_bigendian != 0);
}

}  // namespace

GreyImage grey_image(const RawMessage& message, const std::string& camera, Warnings& warnings) {
  GreyImage grey;
  if (canonical_type(message.type) == CompressedImage::kType) {
    const auto image = decode<CompressedImage>(message);
    grey.t_ns = stamp_of(message, image.header);
    grey.pixels = grey_image(image.data, message.topic + ": " + std::to_string(grey.t_ns), camera, warnings);
  } else {
    auto image = decode<Image>(message);
    grey.t_ns = stamp_of(message, image.header);
    try {
      grey.pixels = grey_of(message, image, camera, warnings);
    } catch (const cv::Exception& error) {  // a size that OpenCV's conversion refuses
      throw InputError(message.topic + ": " + image.encoding + ": " + error.err);
    }
  }
  grey.arrival_ns = grey.t_ns;
  return grey;
}

void StereoPairing::take(std::size_t camera, GreyImage image, std::vector<RecordedFrame>& frames, Warnings& warnings) {
  const StampOrder::Order order = order_[camera].take(image.t_ns);
  if (order == StampOrder::Order::duplicate || order == StampOrder::Order::earlier) {
    const char* const kind = order == StampOrder::Order::duplicate ? ": duplicate stamp" : ": backward stamp";
    warnings.add("cam" + std::to_string(camera) + kind, std::to_string(image.t_ns) + " ns");
    return;
  }
  if (order == StampOrder::Order::anew) waiting_[camera].clear();
  waiting_[camera].push_back(std::move(image));
  match(frames, warnings);
}

void StereoPairing::match(std::vector<RecordedFrame>& frames, Warnings& warnings) {
  auto& [left, right] = waiting_;
  while (!left.empty()) {
    const TimeNs t_ns = left.front().t_ns;
    while (!right.empty() && right.front().t_ns < t_ns - kSameInstant) {
      warnings.add("cam1: image without a left one", std::to_string(right.front().t_ns) + " ns");
      right.pop_front();
    }
    if (!stereo_) {
      emit(frames, {});
    } else if (right.empty() && left.size() <= kMostImages) {
      return;
    } else if (right.empty() || right.front().t_ns > t_ns + kSameInstant) {
      warnings.add("cam0: image without a right one", std::to_string(t_ns) + " ns");
      emit(frames, {});
    } else {
      const GreyImage partner = std::move(right.front());
      right.pop_front();
      emit(frames, partner);
    }
  }
  while (right.size() > kMostImages) {
    warnings.add("cam1: image without a left one", std::to_string(right.front().t_ns) + " ns");
    right.pop_front();
  }
}

void StereoPairing::emit(std::vector<RecordedFrame>& frames, const GreyImage& right) {
  GreyImage left = std::move(waiting_[0].front());
  waiting_[0].pop_front();
  frames.push_back(make_frame(left.t_ns, std::max(left.arrival_ns, right.arrival_ns), {left.pixels, right.pixels}));
}

void StereoPairing::finish(std::vector<RecordedFrame>& frames, Warnings& warnings) {
  while (!waiting_[0].empty()) {
    warnings.add("cam0: image without a right one", std::to_string(waiting_[0].front().t_ns) + " ns");
    emit(frames, {});
  }
  waiting_[1].clear();
}

}  // namespace ear::ros2
