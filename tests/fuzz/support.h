// What the fuzz targets share: bytes as numbers, bytes as files, and what must hold for every estimate.
#pragma once

#include <unistd.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "ear/odometry.h"

namespace ear::fuzz {

/// Takes an input apart; past its end everything is zero.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}
  [[nodiscard]] bool any() const { return data_ < end_; }

  /// Any pattern of bits: for a double also NaN and infinity.
  template <typename T>
  [[nodiscard]] T take() {
    T value{};
    const std::size_t left = static_cast<std::size_t>(end_ - data_);
    std::memcpy(&value, data_, left < sizeof(T) ? left : sizeof(T));
    data_ += left < sizeof(T) ? left : sizeof(T);
    return value;
  }

 private:
  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

/// A folder of this process, removed at its end; in memory where there is such a place, since disks are slow.
class Folder {
 public:
  Folder() : path_(parent() / ("ear_fuzz_" + std::to_string(getpid()))) { std::filesystem::create_directories(path_); }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  /// Writes a file into it; its folders are made.
  std::filesystem::path write(const char* name, std::string_view text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  static std::filesystem::path parent() {
    const std::filesystem::path memory = "/dev/shm";
    return access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path();
  }

  std::filesystem::path path_;
};

inline void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

/// The estimate is finite and its covariance has positive variances.
inline void check(const Estimate& estimate) {
  const NavState& x = estimate.state;
  require(x.p_WB.allFinite() && x.v_W.allFinite() && x.b_g.allFinite() && x.b_a.allFinite(), "the state is finite");
  require(std::abs(x.q_WB.norm() - 1.0) < 1e-6, "the quaternion has length one");
  require(estimate.covariance.allFinite(), "the covariance is finite");
  require(estimate.covariance.diagonal().minCoeff() > 0.0, "variances are positive");
}

}  // namespace ear::fuzz
