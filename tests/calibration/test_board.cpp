// Cameras from a board's corners, made by the simulator's lenses: what is found is as wrong as is said, and what the
// board's motion does not show is said in words.
#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>

#include "calibration/board.h"
#include "tests/smoother/support.h"
#include "tests/support/about.h"
#include "tools/calibration/board_start.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/vehicle.h"

using namespace ear;
using namespace ear::calibration;
using ear::test::about;

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kNoise = 0.05;  // [px]

struct Motion {
  int views = 60;
  double tilt = 45.0;   // [deg] at most
  double aside = 0.45;  // of the board's middle, tangent
};

double uniform(std::mt19937_64& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

std::vector<BoardView> views_of(const Calibration& truth, const BoardShape& board, const Motion& motion,
                                std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  std::vector<BoardView> views;
  for (int i = 0; i < motion.views; ++i) {
    const double depth = uniform(rng, 0.3, 0.7);
    Eigen::Isometry3d T_C0P = Eigen::Isometry3d::Identity();
    const double axis = uniform(rng, -3.1, 3.1);
    T_C0P.linear() = (Eigen::AngleAxisd(uniform(rng, 0.0, motion.tilt) * kDegree,
                                        Eigen::Vector3d(std::cos(axis), std::sin(axis), 0.0)) *
                      Eigen::AngleAxisd(uniform(rng, -30.0, 30.0) * kDegree, Eigen::Vector3d::UnitZ()))
                         .toRotationMatrix();
    const Eigen::Vector3d middle(depth * uniform(rng, -motion.aside, motion.aside),
                                 depth * uniform(rng, -motion.aside, motion.aside), depth);
    T_C0P.translation() = middle - T_C0P.linear() * Eigen::Vector3d(0.5 * board.columns * board.square,
                                                                    0.5 * board.rows * board.square, 0.0);
    BoardView view;
    view.t_ns = 1'000'000'000LL * i;
    for (std::size_t camera = 0; camera < truth.cameras.size(); ++camera) {
      const Eigen::Isometry3d T_CC0 = truth.cameras[camera].T_BC.inverse() * truth.cameras[0].T_BC;
      for (int corner = 0; corner < board.corners(); ++corner) {
        const Eigen::Vector2d at = board.at(corner);
        const Eigen::Vector3d p_C = T_CC0 * (T_C0P * Eigen::Vector3d(at.x(), at.y(), 0.0));
        const auto px = simulator::project(truth.cameras[camera], p_C, 4.0);
        if (px) view.seen[camera].push_back({corner, *px + Eigen::Vector2d(noise(rng), noise(rng))});
      }
    }
    views.push_back(view);
  }
  return views;
}

BoardResult found(const Calibration& truth, const Motion& motion, std::uint64_t seed) {
  const BoardShape board;
  std::vector<BoardView> views = views_of(truth, board, motion, seed);
  std::vector<CameraCalibration> sizes(truth.cameras.size());
  for (CameraCalibration& size : sizes) size.width = 640, size.height = 480;
  const Calibration start = board_start(sizes, truth.cameras[0].lens, board, views);
  return calibrate_cameras(start, board, views);
}

/// Errors in the order of the findings: both lenses, then position of the right camera [mm].
std::vector<double> errors(const Calibration& truth, const Calibration& found) {
  std::vector<double> all;
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    const CameraCalibration& a = found.cameras[i];
    const CameraCalibration& b = truth.cameras[i];
    all.insert(all.end(), {a.fu - b.fu, a.fv - b.fv, a.cu - b.cu, a.cv - b.cv});
    for (std::size_t k = 0; k < 4; ++k) all.push_back(a.distortion[k] - b.distortion[k]);
  }
  const auto stereo = [](const Calibration& c) { return c.cameras[0].T_BC.inverse() * c.cameras[1].T_BC; };
  const Eigen::AngleAxisd turn(stereo(found).linear() * stereo(truth).linear().transpose());
  const Eigen::Vector3d phi = turn.angle() / kDegree * turn.axis();
  const Eigen::Vector3d p = 1e3 * (stereo(found).translation() - stereo(truth).translation());
  all.insert(all.end(), {phi.x(), phi.y(), phi.z(), p.x(), p.y(), p.z()});
  return all;
}

std::string refusal(const Calibration& truth, const Motion& motion) {
  try {
    static_cast<void>(found(truth, motion, 5));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

bool says(const std::vector<std::string>& advice, const std::string& words) {
  for (const std::string& line : advice) {
    if (line.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("board: both lens models from nothing, with errors of the size that is said") {
  for (const LensModel lens : {LensModel::radial_tangential, LensModel::equidistant}) {
    const Calibration truth = simulator::make_vehicle(30.0, lens);
    double sum = 0.0;
    std::size_t count = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      CAPTURE(seed);
      const BoardResult result = found(truth, {}, seed);
      const std::vector<double> error = errors(truth, result.calibration);
      REQUIRE(error.size() == result.findings.size());
      for (std::size_t i = 0; i < error.size(); ++i) {
        CHECK(result.findings[i].shown);
        const double normalized = error[i] / result.findings[i].posterior;
        CAPTURE(result.findings[i].name);
        CHECK(std::abs(normalized) < 5.0);
        sum += normalized * normalized;
        ++count;
      }
      CHECK(std::abs(error[0]) < 0.3);
      CHECK(std::abs(error[2]) < 0.3);
      CHECK(result.sigma_px == about(kNoise, 0.1));
      CHECK_FALSE(says(result.advice, "tilted"));
      CHECK_FALSE(says(result.advice, "not shown"));
    }
    // 22 numbers, strongly correlated, of 12 seeds: their mean square scatters by some 0.15. Never less than white
    // noise gives, so rather below 1 than above.
    const double mean = sum / static_cast<double>(count);
    MESSAGE("mean squared normalized error " << mean);
    CHECK(mean > 0.5);
    CHECK(mean < 1.4);
  }
}

TEST_CASE("board: the standard deviations stand where the filter looks for them") {
  const BoardResult result = found(simulator::make_vehicle(30.0, LensModel::radial_tangential), {}, 3);
  REQUIRE(result.calibration.cameras[1].pose_sigma);
  CHECK(result.calibration.cameras[1].pose_sigma->position > 1e-6);
  CHECK(result.calibration.cameras[1].pose_sigma->position < 1e-4);
  CHECK(result.calibration.cameras[1].pose_sigma->rotation < 1e-3);
  CHECK_FALSE(result.calibration.cameras[0].pose_sigma);
  for (const CameraCalibration& camera : result.calibration.cameras) {
    REQUIRE(camera.intrinsics_sigma);
    CHECK(camera.intrinsics_sigma->focal_length > 1e-3);
    CHECK(camera.intrinsics_sigma->focal_length < 0.5);
    CHECK(camera.intrinsics_sigma->principal_point > 1e-3);
    CHECK(camera.intrinsics_sigma->principal_point < 0.5);
  }
}

TEST_CASE("board: one camera alone") {
  Calibration truth = simulator::make_vehicle(30.0, LensModel::radial_tangential);
  truth.cameras.resize(1);
  const BoardResult result = found(truth, {}, 4);
  CHECK(result.findings.size() == 8);
  CHECK(std::abs(result.calibration.cameras[0].fu - truth.cameras[0].fu) < 0.3);
}

TEST_CASE("board: what its motion does not show is said in words") {
  const Calibration truth = simulator::make_vehicle(30.0, LensModel::radial_tangential);
  const std::string flat = refusal(truth, {60, 0.0, 0.45});
  CHECK(flat.find("focal length") != std::string::npos);
  CHECK(flat.find("never tilted") != std::string::npos);
  const std::string few = refusal(truth, {3, 45.0, 0.45});
  CHECK(few.find("3 views") != std::string::npos);
  const BoardResult middle = found(truth, {60, 45.0, 0.0}, 6);
  CHECK(says(middle.advice, "never in the image's corner"));
  CHECK(says(found(truth, {12, 45.0, 0.45}, 7).advice, "only 12 views"));
}
