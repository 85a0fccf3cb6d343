#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "frontend/lens.h"

namespace ear {
namespace {

CameraCalibration euroc() {
  CameraCalibration c;
  c.width = 752;
  c.height = 480;
  c.fu = 458.654;
  c.fv = 457.296;
  c.cu = 367.215;
  c.cv = 248.375;
  c.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  return c;
}

// Wide, with k3 as ROS and OpenCV write it.
CameraCalibration plumb_bob() {
  CameraCalibration c = euroc();
  c.distortion = {-0.30, 0.11, 0.0006, -0.0004, -0.018};
  return c;
}

CameraCalibration fisheye() {
  CameraCalibration c = euroc();
  c.lens = LensModel::equidistant;
  c.fu = 190.9;
  c.fv = 190.8;
  c.cu = 380.0;
  c.cv = 240.0;
  c.distortion = {0.0034, 0.0007, -0.0020, 0.0002};
  return c;
}

template <class Check>
void for_each_pixel_on_a_grid(const CameraCalibration& camera, Check&& check) {
  for (int v = 0; v <= camera.height; v += 24) {
    for (int u = 0; u <= camera.width; u += 24) check(Eigen::Vector2d(u, v));
  }
}

}  // namespace

TEST_CASE("lens: pixels come back from their rays, to the corners") {
  for (const CameraCalibration& camera : {euroc(), plumb_bob(), fisheye()}) {
    const Lens lens(camera);
    for_each_pixel_on_a_grid(camera, [&](const Eigen::Vector2d& pixel) {
      CAPTURE(pixel);
      const auto ray = lens.to_normalized(pixel);
      if (camera.lens == LensModel::equidistant && !ray) {
        // Outside 87 degrees from the axis.
        CHECK((pixel - Eigen::Vector2d(camera.cu, camera.cv)).norm() > 1.5 * camera.fu);
        return;
      }
      REQUIRE(ray);
      const auto back = lens.to_pixel(*ray);
      REQUIRE(back);
      CHECK((*back - pixel).norm() < 1e-6);
    });
  }
}

TEST_CASE("lens: the derivative by the ray is that of the pixels") {
  constexpr double kStep = 1e-6;
  for (const CameraCalibration& camera : {euroc(), plumb_bob(), fisheye()}) {
    const Lens lens(camera);
    for (const Eigen::Vector2d& ray :
         {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.3, -0.2), Eigen::Vector2d(-0.5, 0.4)}) {
      CAPTURE(ray);
      const auto at = lens.project(ray);
      REQUIRE(at);
      CHECK((at->pixel - *lens.to_pixel(ray)).norm() < 1e-9);
      for (int k = 0; k < 2; ++k) {
        const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
        const Eigen::Vector2d slope = (*lens.to_pixel(ray + step) - *lens.to_pixel(ray - step)) / (2.0 * kStep);
        CHECK((at->J_pixel_ray.col(k) - slope).norm() < 1e-5);
      }
    }
    CHECK_FALSE(lens.project({1e3, 0.0}));
  }
}

TEST_CASE("lens: the models are OpenCV's") {
  for (const CameraCalibration& camera : {euroc(), plumb_bob(), fisheye()}) {
    const Lens lens(camera);
    const cv::Matx33d K(camera.fu, 0.0, camera.cu, 0.0, camera.fv, camera.cv, 0.0, 0.0, 1.0);
    const std::vector<double> k(camera.distortion.begin(), camera.distortion.end());
    const std::vector<double> four(k.begin(), k.begin() + 4);
    for (double x = -0.8; x <= 0.8; x += 0.2) {
      for (double y = -0.5; y <= 0.5; y += 0.1) {
        const std::vector<cv::Point3d> points{{x, y, 1.0}};
        std::vector<cv::Point2d> pixels;
        if (camera.lens == LensModel::equidistant) {
          cv::fisheye::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), K, four);
        } else {
          cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), K, k, pixels);
        }
        const auto pixel = lens.to_pixel({x, y});
        REQUIRE(pixel);
        CHECK((*pixel - Eigen::Vector2d(pixels[0].x, pixels[0].y)).norm() < 1e-9);
      }
    }
  }
}

TEST_CASE("lens: rays beyond the fold of the polynomial see no pixel") {
  CameraCalibration camera = euroc();
  camera.distortion = {-0.4, 0.0, 0.0, 0.0};  // folds at r = 0.91
  const Lens lens(camera);
  CHECK(lens.to_pixel({0.85, 0.0}));
  CHECK_FALSE(lens.to_pixel({1.2, 0.0}));
  CHECK_FALSE(lens.to_normalized({camera.cu + 0.7 * camera.fu, camera.cv}));

  camera.distortion = {-0.4, 0.0, 0.0, 0.0, 0.2};  // r^7 bends it back: no fold
  CHECK(Lens(camera).to_pixel({1.2, 0.0}));
  camera.distortion = {0.0, 0.0, 0.0, 0.0, -0.3};  // folds at r = 0.88
  CHECK(Lens(camera).to_pixel({0.85, 0.0}));
  CHECK_FALSE(Lens(camera).to_pixel({0.9, 0.0}));
}

TEST_CASE("lens: four coefficients give the bits that they gave before there was a fifth") {
  const CameraCalibration camera = euroc();
  const Lens lens(camera);
  const auto& k = camera.distortion;
  for (double x = -0.8; x <= 0.8; x += 0.1) {
    for (double y = -0.5; y <= 0.5; y += 0.1) {
      const double r2 = x * x + y * y;
      const double radial = 1.0 + r2 * (k[0] + r2 * k[1]);
      const Eigen::Vector2d distorted(x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
                                      y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y);
      const auto pixel = lens.to_pixel({x, y});
      REQUIRE(pixel);
      CHECK(pixel->x() == distorted.x() * camera.fu + camera.cu);
      CHECK(pixel->y() == distorted.y() * camera.fv + camera.cv);
    }
  }
}

TEST_CASE("lens: a calibration that cannot be is refused") {
  CameraCalibration camera = euroc();
  camera.fu = 0.0;
  CHECK_THROWS_AS(Lens{camera}, std::invalid_argument);
  camera = euroc();
  camera.width = 0;
  CHECK_THROWS_AS(Lens{camera}, std::invalid_argument);
  camera = euroc();
  camera.distortion[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(Lens{camera}, std::invalid_argument);
  camera = euroc();
  camera.distortion[4] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(Lens{camera}, std::invalid_argument);
  camera = fisheye();
  camera.distortion[4] = 0.1;  // the equidistant model has four
  CHECK_THROWS_AS(Lens{camera}, std::invalid_argument);
}

TEST_CASE("lens: NaN is nowhere") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CameraCalibration& camera : {euroc(), plumb_bob(), fisheye()}) {
    CHECK_FALSE(Lens(camera).to_normalized({nan, 10.0}));
    CHECK_FALSE(Lens(camera).to_pixel({nan, 0.1}));
  }
}

}  // namespace ear
