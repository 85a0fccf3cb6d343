// Pictures against geometry that is worked out without the renderer, and against their own claims.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/simulator/support.h"
#include "tests/support/about.h"
#include "tools/simulator/constants.h"
#include "tools/simulator/image_sensor.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/materials.h"
#include "tools/simulator/renderer.h"
#include "tools/simulator/simulation.h"
#include "tools/simulator/vehicle.h"

namespace ear::simulator {
namespace {

using test::about;

constexpr double kSquare = 0.12;  // [m] of the checkerboard
constexpr int kSquares = 24;      // per edge

// A checkerboard wall 1.6 m in front of the origin, tilted; its surroundings are grey.
Panel board_panel() {
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.25, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  const Eigen::Vector3d u_W = -R.col(1);  // seen from the origin, to the right
  const Eigen::Vector3d v_W = R.col(2);
  const double edge = kSquare * kSquares;
  const Eigen::Vector3d middle_W(1.6, 0.1, 0.9);
  return {middle_W - 0.5 * edge * (u_W + v_W), u_W, v_W, edge, edge, Material::poster};
}

Texture board_texture() {
  constexpr double kTexel = 0.0025;
  const int pixels = static_cast<int>(std::lround(kSquare / kTexel));
  const int size = (kSquares * pixels + kTextureMultiple - 1) / kTextureMultiple * kTextureMultiple;
  cv::Mat image(size, size, CV_8UC1);
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      image.at<unsigned char>(row, column) = (row / pixels + column / pixels) % 2 == 0 ? 50 : 200;
    }
  }
  return {image, kTexel};
}

Texture grey_texture() { return {cv::Mat(64, 64, CV_8UC1, cv::Scalar(120)), 0.2}; }

struct Board {
  Scene scene;
  Appearance appearance;
};

Board make_board() {
  Board board{{}, {{}, grey_texture()}};
  board.scene.size = {12.0, 9.0};
  board.scene.panels = {board_panel()};
  board.appearance.panels = {board_texture()};
  return board;
}

// The axle moves with constant rates; t = 0.5 s is at `start`.
Trajectory moving(const AxleState& start, const AxleState& rates, const ear::Calibration& vehicle) {
  constexpr double kPeriod = 0.0025;
  Eigen::Matrix<double, 6, Eigen::Dynamic> states(6, 401);
  for (Eigen::Index i = 0; i < states.cols(); ++i) {
    states.col(i) = start + (kPeriod * static_cast<double>(i) - 0.5) * rates;
  }
  return {kPeriod, states, vehicle.encoder->T_BO};
}

struct Errors {
  double mean_u = 0.0, mean_v = 0.0, worst = 0.0;
  int count = 0;
};

// Where cornerSubPix finds the board's corners, against where the calibration says that they are.
Errors corner_errors(const cv::Mat& picture, const ear::CameraCalibration& camera, const Eigen::Isometry3d& T_WC) {
  const Panel panel = board_panel();
  Errors errors;
  for (int i = 1; i < kSquares; ++i) {
    for (int j = 1; j < kSquares; ++j) {
      const Eigen::Vector3d corner_W = panel.corner_W + kSquare * (i * panel.u_W + j * panel.v_W);
      const auto expected = project(camera, T_WC.inverse() * corner_W, 14.0);
      if (!expected) continue;
      std::vector<cv::Point2f> found{
          {static_cast<float>(std::lround(expected->x())), static_cast<float>(std::lround(expected->y()))}};
      cv::cornerSubPix(picture, found, {5, 5}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-4});
      const Eigen::Vector2d error(found[0].x - expected->x(), found[0].y - expected->y());
      errors.mean_u += error.x();
      errors.mean_v += error.y();
      errors.worst = std::max(errors.worst, error.norm());
      ++errors.count;
    }
  }
  errors.mean_u /= errors.count;
  errors.mean_v /= errors.count;
  return errors;
}

cv::Mat to_bytes(const cv::Mat& grey) {
  cv::Mat bytes;
  grey.convertTo(bytes, CV_8UC1);
  return bytes;
}

// In both cameras: how far the farthest corner, and both means, may be off [px].
void check_corners(const Board& board, const Trajectory& trajectory, const ear::Calibration& vehicle, double worst,
                   double mean) {
  const Renderer renderer(board.scene, board.appearance, vehicle.cameras);
  for (std::size_t camera = 0; camera < 2; ++camera) {
    CAPTURE(camera);
    const cv::Mat picture = to_bytes(renderer.render(camera, trajectory, 0.5, Exposure{}));
    const Errors errors =
        corner_errors(picture, vehicle.cameras[camera], pose_WC(trajectory, 0.5, vehicle.cameras[camera]));
    MESSAGE("mean " << errors.mean_u << " " << errors.mean_v << " worst " << errors.worst << " px of " << errors.count);
    CHECK(errors.count > 100);
    CHECK(errors.worst < worst);
    CHECK(std::abs(errors.mean_u) < mean);
    CHECK(std::abs(errors.mean_v) < mean);
  }
}

const AxleState kFacingBoard = (AxleState() << 0.0, 0.0, 0.9, 0.05, 0.03, -0.1).finished();

// The furnished room, painted once for all cases that only look at it.
struct Room {
  Simulation simulation;
  Appearance appearance;
};

Room make_room_on(const std::string& sequence) {
  Options options;
  options.sequence = sequence;
  options.seed = 31;
  options.tracks = false;
  Simulation simulation(options);
  Appearance appearance = paint_room(simulation.scene(), 31);
  return {std::move(simulation), std::move(appearance)};
}

}  // namespace

TEST_CASE("renderer: corners are where the lens puts them, < 0.2 px, in both cameras") {
  for (const ear::LensModel lens : {ear::LensModel::radial_tangential, ear::LensModel::equidistant}) {
    const ear::Calibration vehicle = make_vehicle(30.0, lens);
    check_corners(make_board(), moving(kFacingBoard, AxleState::Zero(), vehicle), vehicle, 0.2, 0.01);
  }
}

TEST_CASE("renderer: in motion, corners are where they are in the middle of the exposure") {
  const ear::Calibration vehicle = make_vehicle(30.0, ear::LensModel::radial_tangential);
  AxleState rates;
  rates << 0.4, 0.6, -0.2, 0.5, -0.3, 0.4;  // [m/s], [rad/s]: some 2 px of blur
  check_corners(make_board(), moving(kFacingBoard, rates, vehicle), vehicle, 0.3, 0.015);
}

TEST_CASE("renderer: motion blurs an edge over the way it moves during the exposure") {
  const ear::Calibration vehicle = make_vehicle(30.0, ear::LensModel::radial_tangential);
  const Board board = make_board();
  const Renderer renderer(board.scene, board.appearance, vehicle.cameras);
  AxleState rates = AxleState::Zero();
  rates(3) = 2.0;  // turning: 2 rad/s x 6 ms x 385 px = 4.6 px
  const auto steepest = [&](const Trajectory& trajectory) {
    const cv::Mat picture = renderer.render(0, trajectory, 0.5, Exposure{0.006, 1.0});
    const cv::Mat slope = picture(cv::Rect(1, 0, 639, 480)) - picture(cv::Rect(0, 0, 639, 480));
    std::vector<float> values;
    for (int v = 200; v < 280; ++v) {
      for (int u = 250; u < 390; ++u) values.push_back(std::abs(slope.at<float>(v, u)));
    }
    std::nth_element(values.begin(), values.end() - 100, values.end());
    return static_cast<double>(*(values.end() - 100));
  };
  const double sharp = steepest(moving(kFacingBoard, AxleState::Zero(), vehicle));
  const double blurred = steepest(moving(kFacingBoard, rates, vehicle));
  CHECK(sharp > 70.0);  // of a step of 150 grey levels
  CHECK(blurred < 0.7 * sharp);
  CHECK(blurred < 150.0 / 2.5);
  CHECK(blurred > 150.0 / 4.6);
}

TEST_CASE("renderer: scenes and appearances that do not belong together are refused") {
  Board board = make_board();
  board.appearance.panels.clear();
  const ear::Calibration vehicle = make_vehicle(30.0, ear::LensModel::radial_tangential);
  CHECK_THROWS_WITH_AS(Renderer(board.scene, board.appearance, vehicle.cameras), doctest::Contains("1 panels"),
                       std::invalid_argument);
}

TEST_CASE("renderer: in the room, both cameras and the next moment see the same surfaces") {
  for (const std::string sequence : {"flat1", "wave1"}) {
    CAPTURE(sequence);
    const Room room = make_room_on(sequence);
    const auto& cameras = room.simulation.true_calibration().cameras;
    const Renderer renderer(room.simulation.scene(), room.appearance, cameras);
    const Trajectory& trajectory = room.simulation.plan().trajectory;
    const double t = 9.0;
    const Exposure exposure{1e-5, 1.0};  // no blur: the pictures differ by geometry alone
    const cv::Mat vignetting_left = vignetting(cameras[0]);
    const cv::Mat left = renderer.render(0, trajectory, t, exposure) / vignetting_left;

    struct Other {
      std::size_t camera;
      double t;
    };
    for (const Other other : {Other{1, t}, Other{0, t + 0.1}}) {
      CAPTURE(other.camera);
      const cv::Mat picture =
          renderer.render(other.camera, trajectory, other.t, exposure) / vignetting(cameras[other.camera]);
      const Eigen::Isometry3d T_WC0 = pose_WC(trajectory, t, cameras[0]);
      const Eigen::Isometry3d T_WC = pose_WC(trajectory, other.t, cameras[other.camera]);
      // The second picture, looked up where the points of the first must be, and one pixel to each side of it.
      cv::Mat map_u(480, 640, CV_32FC1, cv::Scalar(-10));
      cv::Mat map_v(480, 640, CV_32FC1, cv::Scalar(-10));
      cv::Mat valid = cv::Mat::zeros(480, 640, CV_8UC1);
      for (int v = 4; v < 476; v += 6) {
        for (int u = 4; u < 636; u += 6) {
          const Eigen::Vector3d direction_W =
              T_WC0.linear() * to_ray(cameras[0], Eigen::Vector2d(u, v)).homogeneous().normalized();
          const auto hit = room.simulation.scene().cast(T_WC0.translation(), direction_W);
          if (!hit) continue;
          const Eigen::Vector3d p_W = T_WC0.translation() + hit->range * direction_W;
          if (!room.simulation.scene().sees(T_WC.translation(), p_W)) continue;
          const auto pixel = project(cameras[other.camera], T_WC.inverse() * p_W, 3.0);
          if (!pixel) continue;
          map_u.at<float>(v, u) = static_cast<float>(pixel->x());
          map_v.at<float>(v, u) = static_cast<float>(pixel->y());
          valid.at<unsigned char>(v, u) = 255;
        }
      }
      const auto difference = [&](double du, double dv) {
        cv::Mat looked_up;
        cv::remap(picture, looked_up, map_u + du, map_v + dv, cv::INTER_LINEAR);
        return cv::norm(looked_up, left, cv::NORM_L1, valid) / cv::countNonZero(valid);
      };
      CHECK(cv::countNonZero(valid) > 6500);
      const double here = difference(0.0, 0.0);
      MESSAGE(sequence << ": difference " << here << " grey levels, 1 px aside " << difference(1.0, 0.0) << " "
                       << difference(-1.0, 0.0) << " " << difference(0.0, 1.0) << " " << difference(0.0, -1.0));
      CHECK(here < 3.0);
      CHECK(difference(1.0, 0.0) > 1.3 * here);
      CHECK(difference(0.0, 1.0) > 1.3 * here);
      // The two sides are alike: no shift of a tenth of a pixel hides in here.
      CHECK(difference(1.0, 0.0) == about(difference(-1.0, 0.0), 0.1));
      CHECK(difference(0.0, 1.0) == about(difference(0.0, -1.0), 0.1));
    }
  }
}

TEST_CASE("image sensor: noise is unbiased and as strong as it claims, and follows from the key alone") {
  const ImageSensor sensor;
  for (const double grey : {20.0, 100.0, 230.0}) {
    CAPTURE(grey);
    const cv::Mat flat(480, 640, CV_32FC1, cv::Scalar(grey));
    const cv::Mat picture = sensor.read(flat, picture_key(1, 123456789, 0));
    cv::Scalar mean, sigma;
    cv::meanStdDev(picture, mean, sigma);
    CHECK(mean[0] == about(grey, 4.0 * 3.0 / std::sqrt(307200.0) / grey));
    // Rounding to whole grey levels adds a twelfth.
    CHECK(sigma[0] == about(std::sqrt(noise_sigma(grey) * noise_sigma(grey) + 1.0 / 12.0), 0.01));
    CHECK(cv::norm(picture, sensor.read(flat, picture_key(1, 123456789, 0)), cv::NORM_INF) == 0.0);
    // Another camera, another time, another seed: noise that has nothing to do with it.
    for (const std::uint64_t key :
         {picture_key(1, 123456789, 1), picture_key(1, 123456790, 0), picture_key(2, 123456789, 0)}) {
      const cv::Mat other = sensor.read(flat, key);
      cv::Mat a, b;
      picture.convertTo(a, CV_64FC1, 1.0, -mean[0]);
      other.convertTo(b, CV_64FC1, 1.0, -mean[0]);
      CHECK(std::abs(a.dot(b)) / (307200.0 * sigma[0] * sigma[0]) < 5.0 / std::sqrt(307200.0));
    }
  }
  CHECK(noise_sigma(0.0) == doctest::Approx(1.5));
  CHECK(noise_sigma(255.0) == doctest::Approx(3.0));
}

TEST_CASE("image sensor: exposure stays within its limits and changes slowly") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    double smallest = 10.0;
    double largest = 0.0;
    for (double t = 0.0; t < 60.0; t += 1.0 / 30.0) {
      const Exposure now = exposure_at(t, seed);
      CHECK(now.seconds > 0.0045);
      CHECK(now.seconds < 0.0085);
      CHECK(std::abs(exposure_at(t + 1.0 / 30.0, seed).gain - now.gain) < 0.01);
      smallest = std::min(smallest, now.gain);
      largest = std::max(largest, now.gain);
    }
    CHECK(smallest > 0.75);
    CHECK(largest < 1.25);
    CHECK(largest - smallest > 0.1);
  }
}

}  // namespace ear::simulator
