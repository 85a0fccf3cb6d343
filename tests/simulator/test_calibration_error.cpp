// The calibration that the estimator is given: as wrong as is promised, and the drive does not depend on it.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/about.h"
#include "tools/simulator/calibration_error.h"
#include "tools/simulator/constants.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/sensors.h"
#include "tools/simulator/simulation.h"
#include "tools/simulator/vehicle.h"

namespace ear::simulator {
namespace {

using test::about;

using Draws = std::map<std::string, std::vector<double>>;

constexpr std::uint64_t kSeeds = 400;

double angle(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.transpose() * b)).angle() / kDegree;
}

/// The rotation vector from one attitude to another, in the axes that both turn vectors into [deg].
Eigen::Vector3d turned(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::AngleAxisd rotation(Eigen::Matrix3d(to * from.transpose()));
  return rotation.angle() * rotation.axis() / kDegree;
}

void add(std::vector<double>& list, const Eigen::VectorXd& values) {
  list.insert(list.end(), values.data(), values.data() + values.size());
}

/// How far what is given is off, by name.
void add_differences(const ear::Calibration& truth, const ear::Calibration& given, Draws& draws) {
  const Eigen::Isometry3d& T_BC = truth.cameras[0].T_BC;
  add(draws["rig rotation [deg]"], turned(T_BC.linear(), given.cameras[0].T_BC.linear()));
  add(draws["rig position [mm]"], 1e3 * (given.cameras[0].T_BC.translation() - T_BC.translation()));
  const Eigen::Isometry3d given_pair = given.cameras[0].T_BC.inverse() * given.cameras[1].T_BC;
  const Eigen::Isometry3d true_pair = T_BC.inverse() * truth.cameras[1].T_BC;
  add(draws["stereo rotation [deg]"], turned(true_pair.linear(), given_pair.linear()));
  add(draws["stereo position [mm]"], 1e3 * (given_pair.translation() - true_pair.translation()));
  const std::array<std::string, 2> sides = {"left ", "right "};
  for (std::size_t i = 0; i < 2; ++i) {
    const ear::CameraCalibration& a = truth.cameras[i];
    const ear::CameraCalibration& b = given.cameras[i];
    draws[sides[i] + "focal length [%]"].push_back(1e2 * (b.fu / a.fu - 1.0));
    CHECK(b.fv / a.fv == doctest::Approx(b.fu / a.fu).epsilon(1e-12));
    add(draws[sides[i] + "principal point [px]"], Eigen::Vector2d(b.cu - a.cu, b.cv - a.cv));
    CHECK(b.distortion == a.distortion);
  }

  const double left = 1e2 * (given.encoder->wheel_radius[0] / truth.encoder->wheel_radius[0] - 1.0);
  const double right = 1e2 * (given.encoder->wheel_radius[1] / truth.encoder->wheel_radius[1] - 1.0);
  draws["radius in common [%]"].push_back(0.5 * (left + right));
  draws["radius apart [%]"].push_back(left - right);
  draws["track width [%]"].push_back(1e2 * (given.encoder->track_width / truth.encoder->track_width - 1.0));
  add(draws["odometer rotation [deg]"], turned(truth.encoder->T_BO.linear(), given.encoder->T_BO.linear()));
  add(draws["odometer position [mm]"], 1e3 * (given.encoder->T_BO.translation() - truth.encoder->T_BO.translation()));
  for (std::size_t i = 0; i < 3; ++i) {
    const ear::LaserBeam& a = truth.lasers->beams[i];
    const ear::LaserBeam& b = given.lasers->beams[i];
    CHECK(b.d_B.norm() == doctest::Approx(1.0).epsilon(1e-12));
    const Eigen::Vector3d side = a.d_B.unitOrthogonal();  // a turn about the beam itself cannot be seen
    add(draws["beam " + std::to_string(i) + " direction [deg]"],
        Eigen::Vector2d(side.dot(b.d_B), a.d_B.cross(side).dot(b.d_B)) / kDegree);
    add(draws["beam " + std::to_string(i) + " origin [mm]"], 1e3 * (b.p_BL - a.p_BL));
  }
  draws["time [ms]"].push_back(1e3 * (given.camera_time_offset - truth.camera_time_offset));
  draws["encoders' time [ms]"].push_back(1e3 * (given.encoder->time_offset - truth.encoder->time_offset));
  draws["lasers' time [ms]"].push_back(1e3 * (given.lasers->time_offset - truth.lasers->time_offset));
}

/// Of all seeds.
Draws differences(double factor) {
  const ear::Calibration truth = make_vehicle(30.0, LensModel::radial_tangential);
  Draws draws;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const CalibrationErrors errors = draw_calibration_errors(seed, factor);
    add_differences(truth, with_errors(truth, errors), draws);
    Rng rng = make_rng(seed, Stream::imu);
    const ImuBias bias = draw_imu_biases(truth.imu, 1, rng).front();
    add(draws["accelerometer bias [m/s^2]"], bias.accel + errors.accel_bias);
    add(draws["gyroscope's matrix [%]"], 1e2 * errors.gyro_matrix.reshaped());
  }
  return draws;
}

Options short_run(std::optional<double> calibration_error) {
  Options options;
  options.sequence = "fly1";
  options.seed = 18;
  options.duration = 4.0;
  options.calibration_error = calibration_error;
  return options;
}

/// All but the accelerometer, bit for bit.
/// Where it was seen: features are normalized with the lens that is given.
Eigen::Vector2d pixel(const Simulation& simulation, std::size_t camera, const Eigen::Vector2d& feature) {
  return to_pixel(simulation.calibration().cameras[camera], feature);
}

void check_same_drive(const Simulation& a, const Simulation& b) {
  REQUIRE(a.imu().size() == b.imu().size());
  for (std::size_t i = 0; i < a.imu().size(); ++i) {
    CHECK(a.imu()[i].t_ns == b.imu()[i].t_ns);
    const Truth truth = a.truth(a.imu()[i].t_ns);
    const Truth other = b.truth(b.imu()[i].t_ns);
    CHECK(truth.p_WB == other.p_WB);
    CHECK(truth.R_WB == other.R_WB);
    CHECK(truth.b_g == other.b_g);
  }
  REQUIRE(a.encoders().size() == b.encoders().size());
  for (std::size_t i = 0; i < a.encoders().size(); ++i) {
    CHECK(a.encoders()[i].left_count == b.encoders()[i].left_count);
    CHECK(a.encoders()[i].right_count == b.encoders()[i].right_count);
  }
  REQUIRE(a.lasers().size() == b.lasers().size());
  for (std::size_t i = 0; i < a.lasers().size(); ++i) {
    CHECK(std::equal(a.lasers()[i].range.begin(), a.lasers()[i].range.end(), b.lasers()[i].range.begin(),
                     [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); }));
  }
  REQUIRE(a.frame_times() == b.frame_times());
  for (std::size_t i = 0; i < a.frame_times().size(); ++i) {
    const auto& features = a.tracks(i).features;
    const auto& others = b.tracks(i).features;
    REQUIRE(features.size() == others.size());
    for (std::size_t j = 0; j < features.size(); ++j) {
      CHECK((pixel(a, 0, features[j].left) - pixel(b, 0, others[j].left)).norm() < 1e-6);
      if (!features[j].has_right) continue;
      CHECK((pixel(a, 1, features[j].right) - pixel(b, 1, others[j].right)).norm() < 1e-6);
    }
  }
}

}  // namespace

TEST_CASE("calibration error: every quantity is drawn with its standard deviation, times the factor") {
  // 400 draws and more: their standard deviation scatters by 3.5 % of it, their mean by 5 %.
  const std::map<std::string, double> sigmas{
      {"rig rotation [deg]", 0.2},
      {"rig position [mm]", 1.0},
      {"stereo rotation [deg]", 0.02},
      {"stereo position [mm]", 0.05},
      {"left focal length [%]", 0.1},
      {"right focal length [%]", 0.1},
      {"left principal point [px]", 0.5},
      {"right principal point [px]", 0.5},
      {"radius in common [%]", 0.4},
      {"radius apart [%]", 0.1},
      {"track width [%]", 0.5},
      {"odometer rotation [deg]", 0.3},
      {"odometer position [mm]", 3.0},
      {"beam 0 direction [deg]", 0.3},
      {"beam 0 origin [mm]", 2.0},
      {"beam 1 direction [deg]", 0.3},
      {"beam 1 origin [mm]", 2.0},
      {"beam 2 direction [deg]", 0.3},
      {"beam 2 origin [mm]", 2.0},
      {"time [ms]", 2.0},
      {"encoders' time [ms]", 2.0},
      {"lasers' time [ms]", 2.0},
      {"accelerometer bias [m/s^2]", 0.08},
      {"gyroscope's matrix [%]", 0.3},
  };
  for (const double factor : {1.0, 3.0}) {
    CAPTURE(factor);
    const Draws draws = differences(factor);
    CHECK(draws.size() == sigmas.size());
    for (const auto& stated : sigmas) {
      const std::string& name = stated.first;
      const double sigma = stated.second;
      CAPTURE(name);
      REQUIRE(draws.count(name) == 1);
      const Eigen::Map<const Eigen::ArrayXd> values(draws.at(name).data(),
                                                    static_cast<Eigen::Index>(draws.at(name).size()));
      REQUIRE(values.size() >= static_cast<Eigen::Index>(kSeeds));
      // 0.03 m/s^2 of the bias are there at any factor.
      const bool bias = name.front() == 'a';
      const double expected = bias ? std::sqrt(9e-4 + factor * factor * (sigma * sigma - 9e-4)) : factor * sigma;
      CHECK(std::abs(std::sqrt(values.square().mean()) / expected - 1.0) < 0.2);
      CHECK(std::abs(values.mean()) < 0.2 * expected);
    }
  }
}

TEST_CASE("calibration error: 0 is the true calibration, bit for bit; the drive is that of any other") {
  const Simulation perfect(short_run(0.0));
  const ear::Calibration& given = perfect.calibration();
  const ear::Calibration& truth = perfect.true_calibration();
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(given.cameras[i].T_BC.matrix() == truth.cameras[i].T_BC.matrix());
    CHECK(given.cameras[i].fu == truth.cameras[i].fu);
    CHECK(given.cameras[i].cv == truth.cameras[i].cv);
    CHECK(given.encoder->wheel_radius[i] == truth.encoder->wheel_radius[i]);
  }
  CHECK(given.encoder->T_BO.matrix() == truth.encoder->T_BO.matrix());
  CHECK(given.encoder->track_width == truth.encoder->track_width);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(given.lasers->beams[i].d_B == truth.lasers->beams[i].d_B);
    CHECK(given.lasers->beams[i].p_BL == truth.lasers->beams[i].p_BL);
  }
  CHECK(given.camera_time_offset == 0.0);

  const Simulation fixed(short_run(std::nullopt));
  check_same_drive(perfect, fixed);
  for (std::size_t i = 0; i < perfect.imu().size(); ++i) {
    CHECK(perfect.imu()[i].accel_B == fixed.imu()[i].accel_B);
    CHECK(perfect.imu()[i].gyro_B == fixed.imu()[i].gyro_B);
  }
}

TEST_CASE(
    "calibration error: motion, noise and what is true stay, but for the accelerometer's bias and the gyroscope") {
  const Simulation perfect(short_run(0.0));
  const Simulation wrong(short_run(1.0));
  check_same_drive(perfect, wrong);
  CHECK(perfect.true_calibration().cameras[1].T_BC.matrix() == wrong.true_calibration().cameras[1].T_BC.matrix());
  const CalibrationErrors errors = draw_calibration_errors(18, 1.0);
  CHECK(errors.accel_bias.norm() > 0.01);
  CHECK(errors.gyro_matrix.norm() > 0.001);
  const Eigen::Matrix3d M = Eigen::Matrix3d::Identity() + errors.gyro_matrix;
  CHECK(wrong.true_calibration().imu.gyro_matrix == M);
  CHECK(wrong.calibration().imu.gyro_matrix.isIdentity(0.0));
  CHECK(perfect.true_calibration().imu.gyro_matrix.isIdentity(0.0));
  Options ideal = short_run(0.0);
  ideal.sensor_noise = false;
  const Simulation exact(ideal);
  double fastest = 0.0;  // [rad/s]
  for (std::size_t i = 0; i < perfect.imu().size(); ++i) {
    const TimeNs t_ns = perfect.imu()[i].t_ns;
    CHECK((wrong.imu()[i].accel_B - perfect.imu()[i].accel_B - errors.accel_bias).norm() < 1e-12);
    const Eigen::Vector3d rate_B = exact.imu()[i].gyro_B;
    const Eigen::Vector3d bias_and_noise = perfect.imu()[i].gyro_B - rate_B;
    CHECK((M * (wrong.imu()[i].gyro_B - bias_and_noise) - rate_B).norm() < 1e-12);
    fastest = std::max(fastest, rate_B.norm());
    CHECK((wrong.truth(t_ns).b_a - perfect.truth(t_ns).b_a - errors.accel_bias).norm() < 1e-12);
  }
  CHECK(fastest > 0.1);
  const ear::Calibration expected = with_errors(wrong.true_calibration(), errors);
  CHECK(wrong.calibration().cameras[1].T_BC.matrix() == expected.cameras[1].T_BC.matrix());
  CHECK(wrong.calibration().encoder->wheel_radius == expected.encoder->wheel_radius);
  CHECK(wrong.calibration().camera_time_offset == expected.camera_time_offset);
}

TEST_CASE("calibration error: another factor scales the same draws; an IMU without errors has no bias") {
  const CalibrationErrors one = draw_calibration_errors(7, 1.0);
  const CalibrationErrors half = draw_calibration_errors(7, 0.5);
  CHECK((half.rig_rotation_B - 0.5 * one.rig_rotation_B).norm() < 1e-15);
  CHECK((half.beams[2].origin_B - 0.5 * one.beams[2].origin_B).norm() < 1e-15);
  CHECK((half.accel_bias - 0.5 * one.accel_bias).norm() < 1e-15);
  CHECK(draw_calibration_errors(8, 1.0).rig_rotation_B != one.rig_rotation_B);

  Options options = short_run(1.0);
  options.sensor_noise = false;
  options.tracks = false;
  const Simulation ideal(options);
  CHECK(ideal.truth(ideal.imu()[100].t_ns).b_a == Eigen::Vector3d::Zero());
  CHECK(ideal.true_calibration().imu.gyro_matrix.isIdentity(0.0));
  CHECK(ideal.calibration().camera_time_offset != 0.0);
}

TEST_CASE("calibration error: below zero or not finite it is refused") {
  for (const double factor : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    CAPTURE(factor);
    CHECK_THROWS_WITH_AS(Simulation{short_run(factor)}, doctest::Contains("calibration error"), std::invalid_argument);
  }
}

TEST_CASE("calibration error: without one, errors are of fixed sizes; the data do not depend on them") {
  const Simulation imperfect(short_run(std::nullopt));
  const ear::Calibration& given = imperfect.calibration();
  const ear::Calibration& truth = imperfect.true_calibration();
  CHECK(std::abs(given.encoder->wheel_radius[0] / 0.075 - 1.0) == about(0.003, 0.06));
  CHECK(std::abs(given.encoder->wheel_radius[1] / 0.075 - 1.0) == about(0.003, 0.06));
  CHECK(std::abs(given.encoder->track_width / 0.40 - 1.0) == doctest::Approx(0.003).scale(0.0));
  CHECK(angle(given.encoder->T_BO.linear(), truth.encoder->T_BO.linear()) == doctest::Approx(0.2));
  for (std::size_t i = 0; i < 3; ++i) {
    const double cosine = given.lasers->beams[i].d_B.dot(truth.lasers->beams[i].d_B);
    CHECK(std::acos(cosine) / kDegree == about(0.2, 1e-3));
  }
  CHECK(angle(given.cameras[0].T_BC.linear(), truth.cameras[0].T_BC.linear()) == doctest::Approx(0.2));
  const Eigen::Isometry3d given_pair = given.cameras[0].T_BC.inverse() * given.cameras[1].T_BC;
  const Eigen::Isometry3d true_pair = truth.cameras[0].T_BC.inverse() * truth.cameras[1].T_BC;
  CHECK(angle(given_pair.linear(), true_pair.linear()) == about(0.02, 1e-3));
  CHECK((given_pair.translation() - true_pair.translation()).norm() < 1e-12);
  CHECK(given.cameras[0].fu == truth.cameras[0].fu);
  CHECK(std::abs(given.camera_time_offset) == doctest::Approx(0.001).scale(0.0));
}

}  // namespace ear::simulator
