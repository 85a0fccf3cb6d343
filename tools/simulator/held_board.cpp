#include "tools/simulator/held_board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#ifdef EAR_WITH_ARUCO
#include <opencv2/aruco/charuco.hpp>
#endif

#include "tools/simulator/camera_pose.h"
#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

constexpr double kTexel = 0.25e-3;  // [m]
constexpr int kSheetWidth = 27 * kTextureMultiple;
constexpr int kSheetHeight = 19 * kTextureMultiple;
constexpr double kPerPlace = 1.6;  // [s]
constexpr double kOnTheWay = 1.1;  // [s] of these

// Without jerks: velocity and acceleration are zero at both ends.
double smooth(double share) {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * s * (10.0 + s * (6.0 * s - 15.0));
}

}  // namespace

HeldBoard::HeldBoard(const BoardShow& show, const Trajectory& trajectory, const CameraCalibration& camera, Rng& rng)
    : show_(show), T_WC_(camera_pose(trajectory.at(0.5 * (show.begin + show.end)), camera.T_BC)) {
  const int count = static_cast<int>(std::ceil((show.end - show.begin) / kPerPlace)) + 1;
  for (int i = 0; i < count; ++i) {
    const double depth = std::array{0.34, 0.48, 0.62}[static_cast<std::size_t>(i / 9 % 3)] * uniform(rng, 0.9, 1.1);
    const int cell = (4 * i) % 9, row = cell / 3;  // of 3 x 3, not one beside the last
    const double x = 0.45 * (cell % 3 - 1) + uniform(rng, -0.08, 0.08);
    const double y = 0.32 * (row - 1) + uniform(rng, -0.08, 0.08);
    const double tilt = uniform(rng, 10.0, 45.0) * kDegree;
    const double axis = uniform(rng, -kPi, kPi);
    Place place;
    place << x * depth, y * depth, depth, tilt * std::cos(axis), tilt * std::sin(axis),
        uniform(rng, -30.0, 30.0) * kDegree;
    places_.push_back(place);
  }
  for (const double frequency : {2.3, 4.1, 8.7}) {
    Tremble tremble;
    tremble.frequency = frequency * uniform(rng, 0.9, 1.1);
    for (int k = 0; k < 6; ++k) {
      tremble.amplitude(k) = (k < 3 ? 0.5e-3 : 0.2 * kDegree) * uniform(rng, 0.5, 1.5) * 2.3 / frequency;
      tremble.phase(k) = uniform(rng, -kPi, kPi);
    }
    tremor_.push_back(tremble);
  }
}

Panel HeldBoard::panel(double t) const {
  const double since = std::clamp(t - show_.begin, 0.0, show_.end - show_.begin);
  const auto i = std::min(static_cast<std::size_t>(since / kPerPlace), places_.size() - 2);
  const double share = smooth((since - static_cast<double>(i) * kPerPlace) / kOnTheWay);
  Place place = places_[i] + share * (places_[i + 1] - places_[i]);
  for (const Tremble& tremble : tremor_) {
    place.array() += tremble.amplitude.array() * (2.0 * kPi * tremble.frequency * t + tremble.phase.array()).sin();
  }
  const Eigen::Vector3d turn = place.tail<3>();
  Eigen::Matrix3d R_CP = Eigen::DiagonalMatrix<double, 3>(1.0, -1.0, -1.0);  // right, up, towards the camera
  if (turn.norm() > 0.0) R_CP = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * R_CP;
  const Eigen::Matrix3d R_WP = T_WC_.linear() * R_CP;
  const double width = kTexel * kSheetWidth;
  const double height = kTexel * kSheetHeight;
  const Eigen::Vector3d middle_W = T_WC_ * Eigen::Vector3d(place.head<3>());
  return {middle_W - 0.5 * width * R_WP.col(0) - 0.5 * height * R_WP.col(1),
          R_WP.col(0),
          R_WP.col(1),
          width,
          height,
          Material::poster};
}

Texture paint_board() {
#ifdef EAR_WITH_ARUCO
  constexpr double kInk = 30.0;
  constexpr double kPaper = 200.0;
  constexpr double kHands = 120.0;
  const int square = static_cast<int>(std::lround(kBoardSquare / kTexel));
  const auto board = cv::aruco::CharucoBoard::create(kBoardColumns, kBoardRows, static_cast<float>(kBoardSquare),
                                                     static_cast<float>(kBoardMarker),
                                                     cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50));
  cv::Mat print;
  board->draw(cv::Size(kBoardColumns * square, kBoardRows * square), print);
  cv::Mat sheet(kSheetHeight, kSheetWidth, CV_8UC1, cv::Scalar(kPaper));
  const cv::Rect within((kSheetWidth - print.cols) / 2, (kSheetHeight - print.rows) / 2, print.cols, print.rows);
  print.convertTo(sheet(within), CV_8U, (kPaper - kInk) / 255.0, kInk);
  for (const int u : {0, kSheetWidth}) {
    cv::ellipse(sheet, {u, kSheetHeight * 2 / 3}, {130, 90}, 0.0, 0.0, 360.0, cv::Scalar(kHands), cv::FILLED);
  }
  cv::flip(sheet, sheet, 0);  // the panel's v goes up
  return {sheet, kTexel};
#else
  throw std::runtime_error(
      "this program was built without OpenCV's aruco module (Debian: libopencv-contrib-dev) and cannot draw a board");
#endif
}

}  // namespace ear::simulator
