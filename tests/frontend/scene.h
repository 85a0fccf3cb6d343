// A textured plane, seen by cameras with known lenses from known places: images whose every pixel's origin is known.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "frontend/frontend.h"
#include "frontend/lens.h"

namespace ear {

/// A rectangle in the world with a random texture: origin in one corner, spanned by two orthogonal unit vectors.
struct TexturedRectangle {
  Eigen::Vector3d corner_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d along_u_W = Eigen::Vector3d::UnitX();
  Eigen::Vector3d along_v_W = Eigen::Vector3d::UnitY();
  double metres_per_texel = 0.005;
  cv::Mat texture;  ///< 8-bit grey
};

/// Smoothed noise on several scales. Contrast 1 uses most of the grey values.
cv::Mat random_texture(int width, int height, unsigned seed, double contrast = 1.0);

/// Renders rectangles, the nearest hit first, everything else mid-grey. Each pixel is the mean over its area.
class Camera {
 public:
  explicit Camera(const CameraCalibration& calibration);

  [[nodiscard]] cv::Mat render(const Eigen::Isometry3d& T_WB, const std::vector<TexturedRectangle>& scene) const;
  [[nodiscard]] const CameraCalibration& calibration() const { return calibration_; }

 private:
  CameraCalibration calibration_;
  cv::Mat rays_;  // two channels: normalized coordinates of each subpixel
};

/// Adds sensor noise [grey values].
void add_noise(cv::Mat& image, double sigma, std::mt19937& random);

/// What a sensor adds to an image in the dark.
struct Noise {
  double pixel = 0.0;      ///< of each pixel [grey values]
  double hot_share = 0.0;  ///< of the pixels; they are up to 150 grey values too bright
  double row = 0.0;        ///< of whole rows [grey values]
};
void add_noise(cv::Mat& image, const Noise& noise, std::mt19937& random);

/// A pair of 320x240 cameras, 8 cm apart, looking along the body's z axis; the body is the left camera.
std::vector<CameraCalibration> test_stereo_pair(LensModel lens = LensModel::radial_tangential);

/// Where the ray of a feature meets the nearest rectangle, in the world; nothing if it misses all.
std::optional<Eigen::Vector3d> hit(const Eigen::Isometry3d& T_WC, const Eigen::Vector2d& ray,
                                   const std::vector<TexturedRectangle>& scene);

ImageView view_of(const cv::Mat& image);

/// The exact motion between two poses of the body, as a prediction.
MotionPrediction exact_motion(const Eigen::Isometry3d& T_WB0, const Eigen::Isometry3d& T_WB1);

/// A wall facing the origin, `distance` [m] before it, four times as wide and 3.2 times as high as that.
TexturedRectangle wall(double distance, unsigned seed);

/// A floor `height` [m] below the origin's camera (y down, z forward), 2 m wide, from 0.1 m to 3.1 m before it.
TexturedRectangle floor_below(double height, unsigned seed);

}  // namespace ear
