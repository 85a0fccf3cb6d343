#include "calibration/parameters.h"

#include <Eigen/Eigenvalues>

#include "calibration/findings.h"
#include "calibration/stated.h"
#include "tests/smoother/support.h"
#include "tools/calibration/simulated_drive.h"

using namespace ear;
using namespace ear::calibration;

TEST_CASE("calibration: parameters of a wrong calibration lead to the true one") {
  simulator::Options options;
  options.sequence = "static";
  options.duration = 2.0;
  options.calibration_error = 5.0;
  const simulator::Simulation simulation(options);
  Calibration given = simulation.calibration();
  given.encoder->time_offset = 0.01;
  Calibration truth = simulation.true_calibration();
  truth.encoder->time_offset = -0.02;
  truth.lasers->time_offset = 0.03;
  const Calibration made = applied(given, errors_of(given, truth));
  CHECK(made.encoder->time_offset == doctest::Approx(-0.02));
  CHECK(made.lasers->time_offset == doctest::Approx(0.03));
  CHECK_FALSE(truth.imu.gyro_matrix.isApprox(given.imu.gyro_matrix, 1e-3));
  CHECK(made.imu.gyro_matrix.isApprox(truth.imu.gyro_matrix, 1e-12));
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(made.cameras[i].T_BC.isApprox(truth.cameras[i].T_BC, 1e-9));
    CHECK(made.cameras[i].fu == doctest::Approx(truth.cameras[i].fu));
    CHECK(made.cameras[i].cv == doctest::Approx(truth.cameras[i].cv));
  }
  CHECK(made.encoder->wheel_radius[0] == doctest::Approx(truth.encoder->wheel_radius[0]));
  CHECK(made.encoder->wheel_radius[1] == doctest::Approx(truth.encoder->wheel_radius[1]));
  CHECK(made.encoder->T_BO.linear().col(1).isApprox(truth.encoder->T_BO.linear().col(1), 1e-9));
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(made.lasers->beams[i].p_BL.isApprox(truth.lasers->beams[i].p_BL, 1e-9));
    CHECK(made.lasers->beams[i].d_B.isApprox(truth.lasers->beams[i].d_B, 1e-9));
  }
}

TEST_CASE("calibration: what sensor.yaml states is the prior; a sketch where it states nothing") {
  Calibration given;
  given.encoder = EncoderCalibration{};
  CHECK(priors_of(given).wheel_radius == doctest::Approx(0.05));
  given.encoder->wheel_radius_sigma = 0.001;
  CHECK(priors_of(given).wheel_radius == doctest::Approx(0.001 / 0.075));
  given.lasers = LaserCalibration{};
  CHECK(priors_of(given).encoder_time == 2e-3);
  CHECK(priors_of(given).laser_time == 2e-3);
  given.encoder->time_offset_sigma = 5e-3;
  given.lasers->time_offset_sigma = 6e-3;
  given.cameras.resize(2);
  for (CameraCalibration& camera : given.cameras) camera.fu = camera.fv = 400.0;
  given.cameras[1].intrinsics_sigma = IntrinsicsSigma{0.8, 0.3};
  CHECK(priors_of(given).gyro == 5e-3);
  given.imu.gyro_scale_sigma = 2e-3;
  const Priors priors = priors_of(given);
  CHECK(priors.gyro == 2e-3);
  CHECK(priors.focal_length[0] == 5e-3);
  CHECK(priors.focal_length[1] / 2e-3 == doctest::Approx(1.0));
  CHECK(priors.principal_point[1] == 0.3);
  CHECK(priors.encoder_time == 5e-3);
  CHECK(priors.laser_time == 6e-3);
  const Calibration stated = with_priors(given, priors);
  CHECK(stated.encoder->time_offset_sigma == 5e-3);
  CHECK(stated.lasers->time_offset_sigma == 6e-3);
  CHECK(stated.cameras[0].intrinsics_sigma->focal_length == doctest::Approx(2.0));
  CHECK(stated.cameras[1].intrinsics_sigma->focal_length == doctest::Approx(0.8));
}

TEST_CASE("calibration: what hangs on a value that was not shown moves with it, and is as uncertain as that makes it") {
  std::array<double, 3> values{0.3, 0.4, 0.1};
  const std::array<const char*, 3> names{"first", "second", "third"};
  std::vector<Entry> entries;
  for (std::size_t i = 0; i < 3; ++i) entries.push_back({names[i], "", 1.0, 0.0, 1.0, &values[i]});
  Covariances before{Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()};
  before.white.topLeftCorner<2, 2>() << 0.8, 0.4, 0.4, 0.3;  // the second moves by half of what the first does
  before.found.topLeftCorner<2, 2>() << 0.8, 0.2, 0.2, 0.3;
  before.white(2, 2) = 0.04;
  before.found(2, 2) = 0.01;  // no less than white errors make it
  const Decided decided = decide(entries, before, 0.7, [](const std::string& name) { return "move " + name; });
  CHECK_FALSE(decided.findings[0].shown);
  CHECK(decided.findings[0].motion_wanted == "move first");
  CHECK(decided.findings[0].posterior == doctest::Approx(1.0));
  CHECK(values[0] == 0.0);
  CHECK(decided.findings[1].shown);
  CHECK(values[1] == doctest::Approx(0.25));
  // Of e2 - e1 / 2 by the errors found, and a quarter of the first one's prior.
  CHECK(decided.covariance(1, 1) == doctest::Approx(0.3 - 0.2 + 0.25 * 0.8 + 0.25));
  CHECK(decided.covariance(0, 1) == doctest::Approx(0.5));
  CHECK(values[2] == doctest::Approx(0.1));
  CHECK(decided.findings[2].posterior == doctest::Approx(0.2));
}

TEST_CASE("calibration: what is turned together is stated so that, taken for independent, it is nowhere better known") {
  Calibration found;
  found.cameras.resize(1);
  found.encoder = EncoderCalibration{};
  Parameters parameters = zero_parameters(found);
  const double sigma = 1e-3;  // of each, [rad] or relative
  std::vector<Finding> findings;
  for (const CalibrationBlock& block : blocks_of(parameters, found, priors_of(found))) {
    for (const Entry& entry : block.entries) {
      findings.push_back({entry.name, entry.unit, 0.0, 0.0, 1.0, entry.scale * sigma, true, "", 0.0, ""});
    }
  }
  // Gyroscope, camera and axle about x share nearly all of their error.
  const auto n = static_cast<Eigen::Index>(findings.size());
  Eigen::MatrixXd P = sigma * sigma * Eigen::MatrixXd::Identity(n, n);
  std::vector<Eigen::Index> shared;
  for (const char* name : {"imu0: gyroscope, y by what z measures", "cam0: rotation in the body about x",
                           "encoder0: axle turned about x"}) {
    const auto at = std::find_if(findings.begin(), findings.end(), [&](const Finding& f) { return f.name == name; });
    REQUIRE(at != findings.end());
    shared.push_back(at - findings.begin());
  }
  for (const Eigen::Index i : shared) {
    for (const Eigen::Index j : shared) P(i, j) = (i == j ? 1.0 : 0.99) * sigma * sigma;
  }
  const Calibration stated = with_sigmas(found, findings, P);
  const double factor = std::sqrt(1.0 + 2.0 * 0.99);
  CHECK(stated.cameras[0].pose_sigma->rotation == doctest::Approx(factor * sigma));
  CHECK(stated.imu.gyro_scale_sigma.value_or(0.0) == doctest::Approx(factor * sigma));
  CHECK(stated.encoder->T_BO_sigma->rotation == doctest::Approx(factor * sigma));
  CHECK(stated.cameras[0].pose_sigma->position == doctest::Approx(sigma));

  const Eigen::MatrixXd independent = std::pow(factor * sigma, 2) * Eigen::MatrixXd::Identity(3, 3);
  const Eigen::MatrixXd beyond = independent - P(shared, shared);
  CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(beyond).eigenvalues().minCoeff() > -1e-6 * sigma * sigma);
  CHECK(with_sigmas(found, findings, sigma * sigma * Eigen::MatrixXd::Identity(n, n)).cameras[0].pose_sigma->rotation ==
        doctest::Approx(sigma));
}
