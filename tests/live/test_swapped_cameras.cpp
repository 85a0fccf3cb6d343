// Exchanged images, from the simulator's cameras: recognised, and sound ones never taken for it.
#include "src/swapped_cameras.h"

#include <doctest/doctest.h>

#include <random>

#include "src/live/swap_watch.h"
#include "tools/simulator/film.h"

using namespace ear;

namespace {

using Verdict = SwappedCameras::Verdict;

simulator::Film film(const std::string& sequence, std::uint64_t seed) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = seed;
  options.duration = 4.0;
  options.camera_rate_hz = 4.0;
  return simulator::Film(options);
}

/// After all pairs, exchanged or not.
SwappedCameras seen(const simulator::Film& film, bool exchanged) {
  const Calibration& calibration = film.simulation.calibration();
  SwappedCameras check(calibration.cameras[0], calibration.cameras[1]);
  for (std::size_t i = 0; i < film.pictures.size(); ++i) {
    const StereoFrame frame = film.frame(i);
    check.add(exchanged ? frame.right : frame.left, exchanged ? frame.left : frame.right);
  }
  return check;
}

}  // namespace

TEST_CASE("swapped cameras: told from the signs of disparities, in several scenes") {
  for (const char* sequence : {"flat1", "wave1", "fly1"}) {
    CAPTURE(sequence);
    const simulator::Film pictures = film(sequence, 31);
    const SwappedCameras right = seen(pictures, false), swapped = seen(pictures, true);
    INFO(right.as_stated(), " fit, ", right.exchanged(), " do not; exchanged: ", swapped.as_stated(), ", ",
         swapped.exchanged());
    CHECK(right.verdict() == Verdict::right);
    CHECK(swapped.verdict() == Verdict::swapped);
    CHECK(right.exchanged() < 0.2 * right.as_stated());  // what the odds rest on
    CHECK(swapped.as_stated() < 0.2 * swapped.exchanged());
  }
}

TEST_CASE("swapped cameras: images that show nothing leave it open") {
  const Calibration calibration = film("flat1", 31).simulation.calibration();
  SwappedCameras check(calibration.cameras[0], calibration.cameras[1]);
  cv::Mat grey(calibration.cameras[0].height, calibration.cameras[0].width, CV_8UC1), other = grey.clone();
  std::mt19937_64 rng{3};
  for (int i = 0; i < 20; ++i) {  // noise of two cameras before a wall without texture
    for (cv::Mat* const image : {&grey, &other}) {
      for (int k = 0; k < image->rows * image->cols; ++k) image->data[k] = static_cast<std::uint8_t>(100 + rng() % 5);
    }
    check.add({grey.data, grey.cols, grey.rows, grey.cols}, {other.data, other.cols, other.rows, other.cols});
    check.add({grey.data, grey.cols, grey.rows, grey.cols}, {});
  }
  CHECK(check.verdict() == Verdict::open);
}

TEST_CASE("swap watch: three pairs suffice, and it is said once") {
  const simulator::Film pictures = film("flat1", 32);
  const Calibration& calibration = pictures.simulation.calibration();
  live::SwapWatch watch(calibration.cameras[0], calibration.cameras[1]);
  int looks = 0, said = 0;
  for (std::size_t i = 0; i < pictures.pictures.size(); ++i) {
    const StereoFrame frame = pictures.frame(i);
    watch.take({frame.t_ns, frame.right, frame.left});
    const std::string words = watch.look();
    said += words.empty() ? 0 : 1;
    looks += said == 0 ? 1 : 0;
    CHECK((words.empty() || words.find("left and right are swapped") != std::string::npos));
  }
  CHECK(said == 1);
  CHECK(looks == 2);  // the third says it
}
