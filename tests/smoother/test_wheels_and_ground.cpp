#include "tests/smoother/support.h"

#include <limits>
#include <vector>

#include "smoother/ground_normal.h"
#include "smoother/wheel_chain.h"
#include "tests/support/random_drive.h"

using namespace ear;
using namespace ear::smoother;
using ear::test::random_vector;

namespace {

/// Three beams straight down around the axle's middle, which is 7.5 cm above the ground.
Calibration vehicle() {
  Calibration calibration;
  calibration.encoder.emplace();
  calibration.lasers.emplace();
  for (const Eigen::Vector3d& p_BL :
       {Eigen::Vector3d(0.15, 0.1, 0.1), Eigen::Vector3d(0.15, -0.1, 0.1), Eigen::Vector3d(-0.15, 0.0, 0.1)}) {
    calibration.lasers->beams.push_back({"beam", p_BL, -Eigen::Vector3d::UnitZ()});
  }
  return calibration;
}

OdometerState odometer_of_vehicle() {
  OdometerState odometer;
  odometer.wheel_radius = {0.075, 0.075};
  odometer.track_width = 0.4;
  return odometer;
}

/// Along the beam to the plane n . x = -0.075.
BeamRanges ranges(const Calibration& calibration, const Eigen::Vector3d& n_B) {
  BeamRanges ranges;
  for (std::size_t i = 0; i < ranges.range.size(); ++i) {
    const LaserBeam& beam = calibration.lasers->beams[i];
    ranges.range[i] = (-0.075 - n_B.dot(beam.p_BL)) / n_B.dot(beam.d_B);
  }
  return ranges;
}

}  // namespace

TEST_CASE("wheel_chain: two displacements in a row are one over both") {
  std::mt19937_64 rng{41};
  WheelNoise noise;  // a reading that ends one and starts the next counts twice: without it
  noise.gyro = 2e-3;
  noise.slip = 1e-3;
  noise.side_slip = 2e-3;
  noise.roughness = 4e-3;
  noise.normal_walk = 0.1;
  WheelModel wheels;
  wheels.radius = {0.075, 0.0748};
  wheels.track_width = 0.4;
  const Eigen::Vector3d b_g = random_vector(rng, 0.01);
  const std::vector<ear::test::WheelInterval> drive = ear::test::random_drive(rng, 20);
  const std::vector<ear::test::WheelInterval> before(drive.begin(), drive.begin() + 8);
  const std::vector<ear::test::WheelInterval> after(drive.begin() + 8, drive.end());
  const Eigen::Vector3d n_Bi = Eigen::Vector3d(0.1, 0.02, 1.0).normalized();
  const ear::test::NormalSighting seen{8, Eigen::Vector3d(-0.05, 0.03, 1.0).normalized(), 0.03};
  const ear::test::NormalSighting seen_at_start{0, seen.n_Bk, seen.sigma};

  const WheelDisplacement whole = ear::test::preintegrate(drive, wheels, noise, n_Bi, b_g, &seen);
  const WheelDisplacement first = ear::test::preintegrate(before, wheels, noise, n_Bi, b_g);
  const WheelDisplacement second = ear::test::preintegrate(after, wheels, noise, seen.n_Bk, b_g, &seen_at_start);
  const WheelDisplacement joined = chained(first, second);
  CHECK((joined.alpha_Bi - whole.alpha_Bi).norm() < 1e-12);
  CHECK((joined.R_BiBj - whole.R_BiBj).norm() < 1e-12);
  CHECK(joined.distance == doctest::Approx(whole.distance));
  CHECK(joined.J_alpha_bias.isApprox(whole.J_alpha_bias, 1e-9));
  CHECK(joined.J_xi_bias.isApprox(whole.J_xi_bias, 1e-9));
  CHECK(joined.J_alpha_radius.isApprox(whole.J_alpha_radius, 1e-9));
  CHECK(joined.J_alpha_axle.isApprox(whole.J_alpha_axle, 1e-9));
  CHECK(joined.covariance.isApprox(whole.covariance, 1e-6));

  const Eigen::Vector3d other = b_g + random_vector(rng, 1e-4);  // of second order
  const WheelDisplacement corrected =
      chained(first, ear::test::preintegrate(after, wheels, noise, seen.n_Bk, other, &seen_at_start));
  CHECK((corrected.alpha_Bi - whole.alpha_Bi).norm() < 1e-7);
}

TEST_CASE("ground_normal: nose up on flat ground, the normal leans back in the body; by hand 0.1 rad") {
  const Calibration calibration = vehicle();
  GroundNormal ground(OdometerConfig{}, calibration, 0.997);
  Records records;
  CHECK_FALSE(ground.known());
  const Eigen::Vector3d n_B(std::sin(0.1), 0.0, std::cos(0.1));  // the body's z leans back by 0.1: n ahead of it
  CHECK(ground.add(ranges(calibration, n_B), odometer_of_vehicle(), records));
  CHECK((ground.n_B() - n_B).norm() < 1e-6);
  CHECK(ground.reading_sigma() < 0.1);

  // The nose goes down by 0.1: a turn about y, to the left.
  ground.move(exp_so3({0.0, 0.1, 0.0}), 0.0);
  CHECK((ground.n_B() - Eigen::Vector3d::UnitZ()).norm() < 1e-6);
}

TEST_CASE("ground_normal: one beam that is broken does not turn the ground, one without return neither") {
  const Calibration calibration = vehicle();
  GroundNormal ground(OdometerConfig{}, calibration, 0.997);
  const Eigen::Vector3d n_B = Eigen::Vector3d::UnitZ();
  Records records;
  for (int i = 0; i < 10; ++i) {
    ground.move(Eigen::Matrix3d::Identity(), 0.02);
    REQUIRE(ground.add(ranges(calibration, n_B), odometer_of_vehicle(), records));
  }
  BeamRanges broken = ranges(calibration, n_B);
  broken.range[0] += 0.5;
  broken.range[1] = std::numeric_limits<double>::quiet_NaN();
  records = Records{};
  CHECK(ground.add(broken, odometer_of_vehicle(), records));
  CHECK(records.statistics.beams_used == 1);
  CHECK(records.statistics.beams_rejected == 1);
  CHECK(records.log.records()[index_of(Source::beam_0)].rejected == 1);
  CHECK(records.log.records()[index_of(Source::beam_1)].rejected == 0);
  CHECK(records.log.records()[index_of(Source::beam_2)].used == 1);
  CHECK((ground.n_B() - n_B).norm() < 1e-3);
}
