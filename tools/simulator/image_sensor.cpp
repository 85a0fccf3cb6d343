#include "tools/simulator/image_sensor.h"

#include <algorithm>
#include <cmath>

#include "tools/simulator/constants.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/random.h"

namespace ear::simulator {
namespace {

constexpr double kReadVariance = 1.5 * 1.5;                      // grey levels squared
constexpr double kShotVariance = (9.0 - kReadVariance) / 255.0;  // per grey level
constexpr std::size_t kTable = 4096;

// SplitMix64 (Steele, Lea, Flood 2014): a hash of a counter, good enough for pixels, and free of state.
std::uint64_t hash(std::uint64_t value) {
  value += 0x9E3779B97F4A7C15ULL;
  value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  value = (value ^ (value >> 27U)) * 0x94D049BB133111EBULL;
  return value ^ (value >> 31U);
}

// Quantiles of the normal distribution at (i + 1/2) / kTable, by bisection of erfc.
std::vector<float> normal_quantiles() {
  std::vector<float> table(kTable);
  for (std::size_t i = 0; i < kTable / 2; ++i) {
    const double p = (static_cast<double>(i) + 0.5) / kTable;
    double low = -6.0;
    double high = 0.0;
    for (int step = 0; step < 50; ++step) {
      const double middle = 0.5 * (low + high);
      (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
    }
    table[i] = static_cast<float>(low);
    table[kTable - 1 - i] = static_cast<float>(-low);
  }
  return table;
}

std::uint8_t to_byte(float grey) { return static_cast<std::uint8_t>(std::clamp(grey + 0.5F, 0.0F, 255.0F)); }

}  // namespace

Exposure exposure_at(double t, std::uint64_t seed) {
  Rng rng = make_rng(seed, Stream::exposure);
  double gain = 1.0;
  for (const double frequency : {0.03, 0.11, 0.27}) {
    const double phase = uniform(rng, -kPi, kPi);
    const double varied = frequency * uniform(rng, 0.8, 1.2);
    gain += 0.08 * std::sin(2.0 * kPi * varied * t + phase);
  }
  return {0.0065 + 0.006 * (gain - 1.0), gain};
}

cv::Mat vignetting(const CameraCalibration& camera) {
  cv::Mat factor(camera.height, camera.width, CV_32FC1);
  for (int v = 0; v < factor.rows; ++v) {
    for (int u = 0; u < factor.cols; ++u) {
      const double r2 = to_ray(camera, Eigen::Vector2d(u, v)).squaredNorm();
      factor.at<float>(v, u) = static_cast<float>(std::pow(1.0 + r2, -0.4));
    }
  }
  return factor;
}

std::uint64_t picture_key(std::uint64_t seed, TimeNs t_ns, std::size_t camera) {
  const auto stream = static_cast<std::uint64_t>(Stream::pixels);
  return hash(hash(hash(seed ^ (stream << 56U)) ^ static_cast<std::uint64_t>(t_ns)) + camera);
}

double noise_sigma(double grey) { return std::sqrt(kReadVariance + kShotVariance * grey); }

ImageSensor::ImageSensor() : quantiles_(normal_quantiles()) {
  for (int grey = 0; grey < 256; ++grey) sigmas_.push_back(static_cast<float>(noise_sigma(grey)));
}

cv::Mat ImageSensor::read(const cv::Mat& grey, std::uint64_t key) const {
  cv::Mat bytes(grey.size(), CV_8UC1);
  std::uint64_t counter = key;
  for (int v = 0; v < grey.rows; ++v) {
    const float* in = grey.ptr<float>(v);
    std::uint8_t* out = bytes.ptr<std::uint8_t>(v);
    for (int u = 0; u < grey.cols; u += 4) {
      std::uint64_t bits = hash(counter++);  // 16 bits for each of four pixels
      for (int i = u; i < std::min(u + 4, grey.cols); ++i, bits >>= 16U) {
        out[i] = to_byte(in[i] + sigmas_[to_byte(in[i])] * quantiles_[bits % kTable]);
      }
    }
  }
  return bytes;
}

}  // namespace ear::simulator
