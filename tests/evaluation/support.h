// Trajectories and files for the tests of the evaluation.
#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

inline constexpr TimeNs kStart = 1'700'000'000'000'000'123;  // too long for a double to hold exactly
inline constexpr TimeNs kSecond = 1'000'000'000;

inline Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& w) {
  return w.norm() == 0.0 ? Eigen::Quaterniond::Identity()
                         : Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized()));
}

inline Eigen::Vector3d gaussian(std::mt19937_64& rng, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(rng);
  const double y = normal(rng);
  return {x, y, normal(rng)};
}

/// A smooth walk through a room: about 1.2 m/s on curves that never lie in a plane.
inline Pose pose_at(double t) {
  Pose pose;
  pose.t_ns = kStart + std::llround(t * 1e9);
  pose.p_WB = {4.0 * std::sin(0.25 * t) + 3.0, 3.0 * std::sin(0.4 * t + 1.0) - 2.0, 0.5 * std::sin(0.3 * t) + 1.0};
  pose.q_WB = exp_rotation({0.1 * std::sin(t), 0.15 * std::cos(0.7 * t), 0.3 * t});
  return pose;
}

inline Trajectory walk(double duration, double rate) {
  Trajectory poses;
  for (int i = 0; i <= static_cast<int>(duration * rate); ++i) poses.push_back(pose_at(i / rate));
  return poses;
}

/// The same poses seen from another world.
inline Trajectory moved(const Eigen::Isometry3d& T, Trajectory poses) {
  for (Pose& pose : poses) {
    pose.p_WB = T * pose.p_WB;
    pose.q_WB = Eigen::Quaterniond(T.linear()) * pose.q_WB;
  }
  return poses;
}

inline Eigen::Isometry3d isometry(const Eigen::Vector3d& rotation, const Eigen::Vector3d& translation) {
  return Eigen::Translation3d(translation) * exp_rotation(rotation);
}

/// A folder of its own that goes away with it.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / ("ear-evaluation-" + name + "-" + unique())) {
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  /// Writes a file, with the folders above it, and returns its path.
  std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name) << content;
    return path_ / name;
  }

 private:
  static std::string unique() { return std::to_string(std::random_device{}()); }

  std::filesystem::path path_;
};

}  // namespace ear::evaluation
