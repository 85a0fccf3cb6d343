// The state with its covariance, what a frame was used for, how far the sensors agree, and what was refused.
#include "ear/estimate.h"

#include "ear/given_start.h"
#include "python/binding/bindings.h"
#include "python/binding/value.h"
#include "src/health_text.h"

namespace ear::python {
namespace {

const char* name_of(MotionSensor sensor) {
  constexpr std::array<const char*, kMotionSensors> kNames{"imu", "odometer", "camera"};
  return kNames[static_cast<std::size_t>(sensor)];
}

void bind_consistency(py::module_& module) {
  using C = Consistency;
  auto consistency =
      bind_value(module, "Consistency", "How far the sensors (imu, odometer, camera) agree.",
                 Field{"available", &C::available}, Field{"coefficient", &C::coefficient}, Field{"weight", &C::weight},
                 Field{"variance", &C::variance}, Field{"score", &C::score}, Field{"threshold", &C::threshold});
  consistency
      .def_property_readonly("anomalous",
                             [](const C& self) -> py::object {
                               if (!self.anomalous) return py::none();
                               return py::str(name_of(*self.anomalous));
                             })
      .def_property_readonly("disagree", &C::disagree);
}

void bind_frame(py::module_& module) {
  using F = FrameStatistics;
  bind_value(module, "FrameStatistics", "How the last frame was used.", Field{"tracks", &F::tracks},
             Field{"stereo", &F::stereo}, Field{"features_used", &F::features_used},
             Field{"features_rejected", &F::features_rejected}, Field{"clones", &F::clones},
             Field{"wheel_rows_used", &F::wheel_rows_used}, Field{"wheel_rows_rejected", &F::wheel_rows_rejected},
             Field{"beams_used", &F::beams_used}, Field{"beams_rejected", &F::beams_rejected},
             Field{"standing", &F::standing}, Field{"on_ground", &F::on_ground});
  using T = TerrainEstimate;
  bind_value(module, "TerrainEstimate", "The ground under the vehicle [rad].", Field{"known", &T::known},
             Field{"slope_along", &T::slope_along}, Field{"slope_across", &T::slope_across},
             Field{"sigma_along", &T::sigma_along}, Field{"sigma_across", &T::sigma_across});
}

void bind_counts(py::module_& module) {
  using S = StreamCounts;
  bind_value(module, "StreamCounts", "What one stream delivered.", Field{"accepted", &S::accepted},
             Field{"not_finite", &S::not_finite}, Field{"implausible", &S::implausible},
             Field{"not_later", &S::not_later}, Field{"far_ahead", &S::far_ahead}, Field{"too_late", &S::too_late},
             Field{"repeated", &S::repeated}, Field{"gaps", &S::gaps})
      .def_property_readonly("rejected", &S::rejected);
  using I = InputCounts;
  bind_value(module, "InputCounts", "What was refused or bridged since the start.", Field{"imu", &I::imu},
             Field{"encoder", &I::encoder}, Field{"laser", &I::laser}, Field{"camera", &I::camera},
             Field{"imu_spikes", &I::imu_spikes}, Field{"clock_jumps", &I::clock_jumps},
             Field{"features_rejected", &I::features_rejected}, Field{"steps_rejected", &I::steps_rejected});
  using T = StageTimes;
  bind_value(module, "StageTimes", "Time spent in the last add_stereo [s].", Field{"pyramid", &T::pyramid},
             Field{"track", &T::track}, Field{"detect", &T::detect}, Field{"stereo", &T::stereo},
             Field{"reject", &T::reject}, Field{"filter", &T::filter});
}

}  // namespace

void bind_estimate(py::module_& module) {
  py::enum_<Status>(module, "Status", "Where the estimator is in its life.")
      .value("waiting_for_imu", Status::waiting_for_imu)
      .value("waiting_for_standstill", Status::waiting_for_standstill)
      .value("tracking", Status::tracking)
      .value("lost", Status::lost);
  using N = NavState;
  bind_value(module, "NavState", "The state of the vehicle at one instant; the quaternion is w x y z.",
             Field{"t_ns", &N::t_ns}, Field{"q_WB", &N::q_WB}, Field{"p_WB", &N::p_WB}, Field{"v_W", &N::v_W},
             Field{"b_g", &N::b_g}, Field{"b_a", &N::b_a});
  bind_frame(module);
  bind_consistency(module);
  bind_counts(module);
  using E = Estimate;
  auto estimate = bind_value(
      module, "Estimate",
      "One estimate. The covariance is 15 x 15: rotation, velocity, position, gyroscope and accelerometer bias.",
      Field{"state", &E::state}, Field{"covariance", &E::covariance}, Field{"terrain", &E::terrain},
      Field{"frame", &E::frame}, Field{"consistency", &E::consistency}, Field{"health", &E::health});
  const auto short_text = [](const E& self) {
    return "<Estimate at " + std::to_string(self.state.t_ns) + " ns: " + to_text(self.health) + ">";
  };
  estimate.attr("__repr__") = py::cpp_function(short_text, py::name("__repr__"), py::is_method(estimate));
  using G = GivenStart;
  bind_value(module, "GivenStart", "A start that is given: the state at one time, and how well it is known.",
             Field{"state", &G::state}, Field{"tilt_sigma", &G::tilt_sigma}, Field{"yaw_sigma", &G::yaw_sigma},
             Field{"position_sigma", &G::position_sigma}, Field{"velocity_sigma", &G::velocity_sigma},
             Field{"gyro_bias_sigma", &G::gyro_bias_sigma}, Field{"accel_bias_sigma", &G::accel_bias_sigma});
}

}  // namespace ear::python
