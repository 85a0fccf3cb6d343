// The sensors of a recording or a vehicle. Objects do not change; replace() gives a changed copy.
#include "ear/calibration.h"

#include "python/binding/bindings.h"
#include "python/binding/value.h"
#include "src/recording/calibration_files.h"

namespace ear::python {
namespace {

std::vector<std::filesystem::path> paths_from(py::handle given, const std::string& name) {
  return from_python<std::vector<std::filesystem::path>>(given, name);
}

void bind_camera(py::module_& module) {
  py::enum_<LensModel>(module, "LensModel", "How a lens bends rays; the coefficients are in OpenCV's order.")
      .value("radial_tangential", LensModel::radial_tangential)
      .value("equidistant", LensModel::equidistant);
  bind_value(module, "PoseSigma", "How well a pose is known: about [rad] and along [m] each axis.",
             Field{"rotation", &PoseSigma::rotation}, Field{"position", &PoseSigma::position});
  bind_value(module, "IntrinsicsSigma", "How well a lens is known: focal length and principal point [px].",
             Field{"focal_length", &IntrinsicsSigma::focal_length},
             Field{"principal_point", &IntrinsicsSigma::principal_point});
  using C = CameraCalibration;
  bind_value(module, "CameraCalibration", "One camera: pose in the body, size and focal lengths [px], lens.",
             Field{"T_BC", &C::T_BC}, Field{"width", &C::width}, Field{"height", &C::height}, Field{"fu", &C::fu},
             Field{"fv", &C::fv}, Field{"cu", &C::cu}, Field{"cv", &C::cv}, Field{"lens", &C::lens},
             Field{"distortion", &C::distortion}, Field{"rate_hz", &C::rate_hz}, Field{"pose_sigma", &C::pose_sigma},
             Field{"intrinsics_sigma", &C::intrinsics_sigma});
}

void bind_imu(py::module_& module) {
  using C = ImuCalibration;
  bind_value(module, "ImuCalibration", "Continuous-time noise of the IMU.", Field{"rate_hz", &C::rate_hz},
             Field{"gyro_noise", &C::gyro_noise}, Field{"gyro_random_walk", &C::gyro_random_walk},
             Field{"accel_noise", &C::accel_noise}, Field{"accel_random_walk", &C::accel_random_walk},
             Field{"gyro_bias_sigma", &C::gyro_bias_sigma}, Field{"accel_bias_sigma", &C::accel_bias_sigma},
             Field{"gyro_scale_sigma", &C::gyro_scale_sigma}, Field{"accel_scale_sigma", &C::accel_scale_sigma},
             Field{"gyro_matrix", &C::gyro_matrix});
}

void bind_wheels_and_lasers(py::module_& module) {
  using E = EncoderCalibration;
  bind_value(module, "EncoderCalibration", "Two wheels on one axle.", Field{"T_BO", &E::T_BO},
             Field{"rate_hz", &E::rate_hz}, Field{"resolution", &E::resolution}, Field{"wraps", &E::wraps},
             Field{"wheel_radius", &E::wheel_radius}, Field{"track_width", &E::track_width},
             Field{"noise_counts", &E::noise_counts}, Field{"stamp_sigma", &E::stamp_sigma},
             Field{"time_offset", &E::time_offset}, Field{"time_offset_sigma", &E::time_offset_sigma},
             Field{"T_BO_sigma", &E::T_BO_sigma}, Field{"wheel_radius_sigma", &E::wheel_radius_sigma},
             Field{"wheel_radius_difference_sigma", &E::wheel_radius_difference_sigma},
             Field{"track_width_sigma", &E::track_width_sigma});
  bind_value(module, "LaserBeam", "Where a beam starts [m] and its unit direction, in the body.",
             Field{"name", &LaserBeam::name}, Field{"p_BL", &LaserBeam::p_BL}, Field{"d_B", &LaserBeam::d_B});
  using L = LaserCalibration;
  bind_value(module, "LaserCalibration", "Laser beams that point at the ground.", Field{"beams", &L::beams},
             Field{"rate_hz", &L::rate_hz}, Field{"range_min", &L::range_min}, Field{"range_max", &L::range_max},
             Field{"noise", &L::noise}, Field{"time_offset", &L::time_offset},
             Field{"time_offset_sigma", &L::time_offset_sigma}, Field{"offset_sigma", &L::offset_sigma});
}

}  // namespace

void bind_calibration(py::module_& module) {
  bind_camera(module);
  bind_imu(module);
  bind_wheels_and_lasers(module);
  using C = Calibration;
  bind_value(module, "Calibration", "The sensors of a vehicle: geometry, lenses, noise.", Field{"cameras", &C::cameras},
             Field{"camera_time_offset", &C::camera_time_offset},
             Field{"camera_time_offset_sigma", &C::camera_time_offset_sigma}, Field{"imu", &C::imu},
             Field{"encoder", &C::encoder}, Field{"lasers", &C::lasers});
  module.def(
      "load_calibration",
      [](py::handle folder, py::handle files) {
        Warnings warnings;
        return load_calibration(path_from(folder, "folder"), paths_from(files, "calibration_files"), warnings,
                                CalibrationKind::alone);
      },
      py::arg("folder"), py::arg("calibration_files") = py::tuple(),
      "The calibration of a folder with sensor.yaml files, all its cameras; Kalibr's files replace theirs.");
}

}  // namespace ear::python
