#include "calibration/parameters.h"

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
  const Calibration& given = simulation.calibration();
  const Calibration& truth = simulation.true_calibration();
  const Calibration made = applied(given, errors_of(given, truth));
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
}
