// The features of an image, drawn in where the camera sees them.
#include "src/live/feature_images.h"

#include <doctest/doctest.h>

#include "ear/odometry.h"
#include "tests/live/live_setup.h"
#include "tools/simulator/film.h"

using namespace ear;
using namespace ear::live;

namespace {

/// Blue, green, red of a pixel.
std::array<int, 3> pixel(const ros2::Image& image, std::size_t x, std::size_t y) {
  const std::uint8_t* const at = image.data.data() + y * image.step + 3 * x;
  return {at[0], at[1], at[2]};
}

}  // namespace

TEST_CASE("feature images: rings around the features of the image with their stamp, while somebody looks") {
  const std::vector<std::uint8_t> grey(64 * 48, 100);
  const ImageView view{grey.data(), 64, 48, 64};
  FeatureFrame features;
  features.t_ns = 2'000'000'000;
  features.features.resize(2);
  features.features[0].left = {(40.0 - 31.5) / 50.0, (20.0 - 23.5) / 50.0};
  features.features[0].has_right = true;
  features.features[1].left = {(10.0 - 31.5) / 50.0, (30.0 - 23.5) / 50.0};
  FeatureImages images(test::small_camera());
  images.take({2'000'000'000, view, {}});
  CHECK_FALSE(images.draw(features));  // nobody looks
  images.want(true);
  for (TimeNs t_ns = 1'900'000'000; t_ns <= 2'100'000'000; t_ns += 100'000'000) images.take({t_ns, view, {}});
  const auto image = images.draw(features);
  REQUIRE(image);
  CHECK(image->encoding == "bgr8");
  CHECK(image->data.size() == 3 * 64 * 48);
  CHECK(pixel(*image, 44, 20) == std::array<int, 3>{0, 255, 0});
  CHECK(pixel(*image, 10, 26) == std::array<int, 3>{0, 255, 255});
  CHECK(pixel(*image, 40, 20) == std::array<int, 3>{100, 100, 100});
  CHECK_FALSE(images.draw(features));  // once
}

TEST_CASE("feature images: the estimator's features are those of its last image") {
  simulator::Options options;
  options.seed = 11;
  options.duration = 1.0;
  options.camera_rate_hz = 4.0;
  const simulator::Film film(options);
  Odometry odometry(Config{}, film.simulation.calibration());
  CHECK(odometry.features().features.empty());
  for (const ImuSample& sample : film.simulation.imu()) odometry.add_imu(sample);
  for (std::size_t i = 0; i < film.pictures.size(); ++i) {
    static_cast<void>(odometry.add_stereo(film.frame(i)));
    CHECK(odometry.features().t_ns == film.frame(i).t_ns);
  }
  CHECK(odometry.features().features.size() > 50);
  odometry.reset();
  CHECK(odometry.features().features.empty());
}
