// After its first frames the front end asks for no memory.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <opencv2/core/utility.hpp>
#include <random>

#include "frontend/frontend.h"
#include "scene.h"
#include "tests/support/skip.h"
#include "tools/allocation_counter.h"

namespace ear {
namespace {

constexpr int kWarmUp = 5;

cv::Mat dark(int width, int height, std::mt19937& random) {
  cv::Mat image(height, width, CV_8U, cv::Scalar(10));
  add_noise(image, 2.0, random);
  return image;
}

}  // namespace

TEST_CASE("front end: no memory is asked for once a camera moves, turns, is covered and sees again") {
  if (!tools::counts_allocations()) {
    test::skip("no hook in malloc: built with a sanitizer, or not on glibc");
    return;
  }
  cv::setNumThreads(1);
  bool stereo = true;
  SUBCASE("two cameras") {}
  SUBCASE("one camera, whose turn is a guess in every third frame") { stereo = false; }
  std::vector<CameraCalibration> cameras = test_stereo_pair();
  const std::vector<TexturedRectangle> scene{wall(1.5, 32), floor_below(0.3, 33)};
  const Camera left(cameras[0]), right(cameras[1]);
  if (!stereo) cameras.pop_back();
  Frontend frontend({100, 0.3}, cameras);
  std::mt19937 random(31);
  std::size_t features = 0;
  int fresh = 0;
  std::uint64_t last_id = 0;
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 40; ++i) {
    CAPTURE(i);
    const bool covered = i >= 20 && i < 24;
    const Eigen::Isometry3d before_W = T_WB;
    T_WB.translate(Eigen::Vector3d(0.005, 0.0, 0.01));
    T_WB.rotate(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()));
    const cv::Mat image0 = covered ? dark(320, 240, random) : left.render(T_WB, scene);
    const cv::Mat image1 = covered ? dark(320, 240, random) : right.render(T_WB, scene);
    MotionPrediction prediction = exact_motion(before_W, T_WB);
    prediction.translation_known = i % 2 == 0;
    if (!stereo && i % 3 == 0) prediction.rotation_known = prediction.translation_known = false;
    const std::uint64_t before = tools::thread_allocations();
    const StereoFrame images{i * 100'000'000, view_of(image0), stereo ? view_of(image1) : ImageView{}};
    const FeatureFrame& frame = frontend.process(images, prediction);
    const std::uint64_t allocations = tools::thread_allocations() - before;
    if (i >= kWarmUp) CHECK(allocations == 0);
    for (const FeatureObservation& feature : frame.features) {
      if (feature.id > last_id && i >= kWarmUp) ++fresh;
      last_id = std::max(last_id, feature.id);
    }
    features += frame.features.size();
  }
  CHECK(features > 1000);
  CHECK(fresh > 50);
}

}  // namespace ear
