// Faults of the cameras and of what they see, in pictures.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "tests/support/about.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/picture_maker.h"
#include "tools/simulator/simulation.h"

namespace ear::simulator {
namespace {

using test::about;

Simulation faulty(const std::vector<std::string>& faults) {
  Options options;
  options.seed = 53;
  options.duration = 7.0;
  options.camera_rate_hz = 10.0;
  options.tracks = false;
  for (const std::string& fault : faults) options.faults.push_back(parse_fault(fault));
  return Simulation(options);
}

bool same(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0.0; }

double mean_of(const cv::Mat& picture) { return cv::mean(picture)[0]; }

// Exposures of these times: 10 per second, the first at 0.1083 s.
constexpr std::size_t kBefore = 28;  // 2.9 s, the last one before 3 s
constexpr std::size_t kAfter = 55;

Eigen::Isometry3d pose_WC(const Simulation& simulation, std::size_t exposure, std::size_t camera) {
  const Truth truth = simulation.truth(simulation.exposures()[exposure]);
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  T_WB.linear() = truth.R_WB;
  T_WB.translation() = truth.p_WB;
  return T_WB * simulation.true_calibration().cameras[camera].T_BC;
}

// Where spots of the people are in a picture, of those that are in it.
struct Spot {
  Eigen::Vector2d on_panel, pixel;
};

std::vector<Spot> spots_on(const Panel& panel, const Simulation& simulation, const Shot& shot) {
  const Eigen::Isometry3d T_CW = pose_WC(simulation, shot.exposure, shot.camera).inverse();
  const ear::CameraCalibration& camera = simulation.true_calibration().cameras[shot.camera];
  std::vector<Spot> spots;
  for (double a = 0.02; a < panel.width; a += 0.02) {
    for (double b = 0.02; b < panel.height; b += 0.02) {
      const auto pixel = project(camera, T_CW * (panel.corner_W + a * panel.u_W + b * panel.v_W), 5.0);
      if (pixel) spots.push_back({{a, b}, *pixel});
    }
  }
  return spots;
}

float grey_at(const cv::Mat& picture, const Eigen::Vector2d& pixel) {
  cv::Mat patch;
  cv::getRectSubPix(picture, {3, 3}, {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())}, patch, CV_32F);
  return static_cast<float>(cv::mean(patch)[0]);
}

}  // namespace

TEST_CASE("pictures: too little light, too much, none; frozen, swapped; in both eyes or one") {
  const Simulation clean_simulation = faulty({});
  const Simulation simulation = faulty({"camera_dark@1+1", "camera_overexposed.left@2+1", "camera_covered.right@3+1",
                                        "camera_frozen@4+1", "camera_swapped@5+2", "camera_frozen.left@6+1"});
  const PictureMaker clean(clean_simulation);
  const PictureMaker pictures(simulation);
  const auto left = [](std::size_t exposure) { return Shot{exposure, 0}; };
  const auto right = [](std::size_t exposure) { return Shot{exposure, 1}; };
  const auto unchanged = [&](const Shot& shot) {
    return same(pictures.make(shot), clean.make(shot)) && !changed_by_faults(simulation, shot);
  };
  const std::size_t second = 10;  // exposures; the one at index 8 is at 0.91 s
  CHECK(unchanged(left(8)));
  CHECK(unchanged(right(8)));

  for (const Shot& shot : {left(8 + second / 2), right(8 + second / 2)}) {
    CHECK(mean_of(pictures.make(shot)) == about(0.05 * mean_of(clean.make(shot)), 0.1));
    CHECK(changed_by_faults(simulation, shot));
  }
  const std::size_t bright = 8 + second + second / 2;
  CHECK(mean_of(pictures.make(left(bright))) > 230.0);
  CHECK(changed_by_faults(simulation, left(bright)));
  CHECK(unchanged(right(bright)));
  const std::size_t covered = bright + second;
  CHECK(unchanged(left(covered)));
  CHECK(mean_of(pictures.make(right(covered))) == about(6.0, 0.05));
  CHECK(changed_by_faults(simulation, right(covered)));

  // Those of another time and of the other camera, to the byte.
  const std::size_t frozen = covered + second;
  const std::size_t before_frozen = 8 + 3 * second;  // 3.91 s: the right lens is still covered
  CHECK(same(pictures.make(left(frozen)), clean.make(left(before_frozen))));
  CHECK(same(pictures.make(right(frozen)), pictures.make(right(before_frozen))));
  const std::size_t swapped = frozen + second;
  CHECK(same(pictures.make(left(swapped)), clean.make(right(swapped))));
  CHECK(same(pictures.make(right(swapped)), clean.make(left(swapped))));
  const std::size_t both = swapped + second;
  CHECK(same(pictures.make(left(both)), clean.make(right(both))));
  CHECK(same(pictures.make(right(both)), clean.make(left(8 + 5 * second))));
}

TEST_CASE("pictures: people are where the tracks have them, look alike from both cameras and the next moment") {
  const Simulation clean = faulty({});
  const Simulation simulation = faulty({"people@3+2"});
  const PictureMaker clean_pictures(clean);
  const PictureMaker pictures(simulation);
  const Passerby& people = simulation.passersby().front();
  const std::size_t exposure = 38;  // 3.9 s: in the middle of the view
  const auto panel_at = [&](std::size_t i) { return people.panel(motion_time(simulation.exposures()[i])); };

  const cv::Mat left = pictures.make({exposure, 0});
  const std::vector<Spot> spots = spots_on(panel_at(exposure), simulation, {exposure, 0});
  REQUIRE(spots.size() > 500);
  // Changed on them; unchanged elsewhere.
  cv::Mat difference;
  cv::absdiff(left, clean_pictures.make({exposure, 0}), difference);
  cv::Mat on_people = cv::Mat::zeros(480, 640, CV_8UC1);
  for (const Spot& spot : spots) {
    cv::circle(on_people, {static_cast<int>(spot.pixel.x()), static_cast<int>(spot.pixel.y())}, 20, 255, cv::FILLED);
  }
  CHECK(cv::countNonZero(difference & ~on_people) == 0);
  CHECK(cv::countNonZero(difference) > 60000);
  CHECK(same(pictures.make({kBefore, 0}), clean_pictures.make({kBefore, 0})));
  CHECK(same(pictures.make({kAfter, 1}), clean_pictures.make({kAfter, 1})));

  for (const Shot& other : {Shot{exposure, 1}, Shot{exposure + 1, 0}}) {
    CAPTURE(other.exposure);
    const cv::Mat picture = pictures.make(other);
    const Eigen::Isometry3d T_CW = pose_WC(simulation, other.exposure, other.camera).inverse();
    const Panel panel = panel_at(other.exposure);
    const ear::CameraCalibration& camera = simulation.true_calibration().cameras[other.camera];
    const auto mean_difference = [&](const Eigen::Vector2d& shift) {
      double sum = 0.0;
      double n = 0.0;
      for (const Spot& spot : spots) {
        const Eigen::Vector3d p_W = panel.corner_W + spot.on_panel.x() * panel.u_W + spot.on_panel.y() * panel.v_W;
        const auto pixel = project(camera, T_CW * p_W, 5.0);
        if (!pixel) continue;
        sum += std::abs(grey_at(left, spot.pixel) - grey_at(picture, *pixel + shift));
        n += 1.0;
      }
      REQUIRE(n > 300.0);
      return sum / n;
    };
    const double here = mean_difference({0.0, 0.0});
    MESSAGE("difference " << here << " grey levels, 2 px aside " << mean_difference({2.0, 0.0}) << " and "
                          << mean_difference({0.0, 2.0}));
    CHECK(here < 8.0);
    CHECK(mean_difference({2.0, 0.0}) > 1.3 * here);
    CHECK(mean_difference({-2.0, 0.0}) > 1.3 * here);
    CHECK(mean_difference({0.0, 2.0}) > 1.3 * here);
    CHECK(mean_difference({0.0, -2.0}) > 1.3 * here);
  }
}

}  // namespace ear::simulator
