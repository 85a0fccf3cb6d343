// The unknowns of (1) but the features: frames, oldest first, and the calibration. Blocks do not move in memory.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "filter/ekf/state.h"
#include "smoother/blocks.h"
#include "smoother/interval.h"
#include "smoother/prior_factor.h"

namespace ear::smoother {

struct CalibrationBlocks {
  PoseBlock camera{}, stereo{};
  ImagingBlock imaging{};
  WheelBlock wheels{};
};

class Unknowns {
 public:
  struct Frame {
    std::uint64_t number = 0;
    TimeNs t_ns = 0;
    PoseBlock pose{};
    MotionBlock motion{};
    Interval since;
    Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_B = Eigen::Vector3d::Zero();
    double time_offset = 0.0;
    double feature_noise = 1.0;
    bool image = false;
  };

  /// One frame, and its calibration.
  explicit Unknowns(const State& x);

  Unknowns(const Unknowns&) = delete;  // blocks do not move
  Unknowns& operator=(const Unknowns&) = delete;

  /// A frame where the inertial samples put it. Its number.
  std::uint64_t append(const NewFrame& frame, bool image);
  void erase(std::size_t frame);

  [[nodiscard]] std::size_t size() const { return frames_.size(); }
  [[nodiscard]] Frame& operator[](std::size_t i) { return *frames_[i]; }
  [[nodiscard]] const Frame& operator[](std::size_t i) const { return *frames_[i]; }
  [[nodiscard]] std::size_t index_of(std::uint64_t number) const;

  [[nodiscard]] Pose pose(std::size_t frame) const { return to_pose(frames_[frame]->pose.data()); }
  [[nodiscard]] ImuState newest() const;
  [[nodiscard]] CameraState cameras() const;
  [[nodiscard]] OdometerState odometer() const;
  /// That the block of the wheels is relative to.
  [[nodiscard]] const OdometerState& given() const { return given_; }
  [[nodiscard]] CalibrationBlocks& calibration() { return calibration_; }

  /// All, with the present values: of each frame pose and motion, then the calibration.
  [[nodiscard]] std::vector<PriorBlock> blocks() const;

 private:
  std::vector<std::unique_ptr<Frame>> frames_;
  CalibrationBlocks calibration_;
  OdometerState given_;
  std::uint64_t next_number_ = 0;
};

/// Entries of the filter's error vector (err::) that the last blocks are unknowns of, in their order: the newest
/// frame's pose and motion, and the calibration.
[[nodiscard]] std::vector<int> filter_entries();

}  // namespace ear::smoother
