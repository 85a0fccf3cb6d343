#include "src/recording/image_file.h"

#include <cstdint>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string_view>
#include <vector>

#include "src/recording/input_error.h"

namespace ear {
namespace {

std::vector<std::uint8_t> read_bytes(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) return {};
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) return {};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(stream.tellg()));
  stream.seekg(0);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

// Decoders fill up an image that was cut off; only the missing end shows it. Half a kilobyte of padding is accepted.
bool cut_off(std::string_view bytes) {
  constexpr std::size_t kPadding = 512;
  const std::string_view tail = bytes.substr(bytes.size() > kPadding ? bytes.size() - kPadding : 0);
  if (bytes.substr(0, 4) == "\x89PNG") return tail.find("IEND") == std::string_view::npos;
  if (bytes.substr(0, 2) == "\xff\xd8") return tail.find("\xff\xd9") == std::string_view::npos;
  return false;
}

cv::Mat decoded(const std::vector<std::uint8_t>& bytes) {
  if (bytes.empty() || cut_off({reinterpret_cast<const char*>(bytes.data()), bytes.size()})) return {};
  try {
    return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  } catch (const cv::Exception&) {  // absurd sizes in the header, for example
    return {};
  }
}

}  // namespace

cv::Mat read_image(const std::filesystem::path& file, const std::string& camera, Warnings& warnings) {
  return grey_image(read_bytes(file), file, camera, warnings);
}

cv::Mat grey_image(const std::vector<std::uint8_t>& bytes, const std::filesystem::path& where,
                   const std::string& camera, Warnings& warnings) {
  cv::Mat image = decoded(bytes);
  if (image.empty()) {
    const char* const reason = bytes.empty() ? "missing or empty" : "no image, or cut off";
    warnings.add(camera + ": unreadable image", located(where, 0, "", reason));
    return {};
  }
  if (image.depth() == CV_16U) {
    warnings.add(camera + ": 16-bit image scaled down to 8 bits", located(where, 0, "", "the upper 8 bits are used"));
    image.convertTo(image, CV_8U, 1.0 / 256.0);
  } else if (image.depth() != CV_8U) {
    warnings.add(camera + ": unreadable image", located(where, 0, "", "neither 8 nor 16 bits per pixel"));
    return {};
  }
  return image;
}

}  // namespace ear
