// Which features moved as a static scene must, seen from a camera that moved rigidly: a sample consensus over the
// camera's motion, refined by Gauss-Newton.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <vector>

#include "frontend/stereo_geometry.h"

namespace ear {

/// One feature in two frames of one camera, normalized coordinates.
struct Flow {
  Eigen::Vector2d x0 = Eigen::Vector2d::Zero();
  Eigen::Vector2d x1 = Eigen::Vector2d::Zero();
  double inverse_depth0 = 0.0;       ///< [1/m], used if has_depth
  double inverse_depth_sigma = 0.0;  ///< [1/m]
  bool has_depth = false;
};

/// What is known of the camera's motion beforehand. Transfer: from the first frame to the second.
struct MotionGuess {
  Transfer motion;
  bool rotation_known = false;
  bool translation_known = false;
};

/// The camera's motion as the flows show it.
struct Consensus {
  std::vector<std::uint8_t> inliers;  ///< one flag for each flow: 1 if it belongs to the static scene
  Transfer motion;                    ///< first frame to second
  bool metric = false;                ///< motion was measured, with its length, and most flows agree with it
};

class FlowCheck {
 public:
  /// `tolerance`: distance in normalized coordinates at which a feature stops being static.
  explicit FlowCheck(double tolerance) : tolerance_(tolerance) {}

  /// Takes the memory for so many flows.
  void reserve(std::size_t flows);

  /// With too few flows to measure it, the motion is the guess; all are inliers if its rotation is known, else none is.
  /// Where no depths tell the motion, flows of length zero that a fully known guess would have moved, whatever their
  /// depth, are no inliers: what they show moves with the camera.
  /// Valid until the next call. Asks for no memory with up to as many flows as were reserved.
  [[nodiscard]] const Consensus& find(const std::vector<Flow>& flows, const MotionGuess& guess);

 private:
  void find_into(const std::vector<Flow>& flows, const MotionGuess& guess);

  double tolerance_;
  std::mt19937 random_{20240607};  // fixed seed: the same images give the same features
  Consensus result_;
  // Kept for their memory.
  std::vector<std::uint8_t> trial_, used_;
  std::vector<std::size_t> indices_;
};

}  // namespace ear
