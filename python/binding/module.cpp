// The Python module `ear`: the C++ interface as it is. docs/python.md.
#include "python/binding/bindings.h"
#include "src/recording/input_error.h"

namespace py = pybind11;

PYBIND11_MODULE(_ear, module) {
  module.doc() = "Localisation of vehicles that drive and fly, from cameras, IMU, wheels and lasers.";
  module.attr("__version__") = EAR_VERSION;
  py::register_exception<ear::InputError>(module, "InputError", PyExc_ValueError);
  ear::python::bind_samples(module);
  ear::python::bind_settings(module);
  ear::python::bind_calibration(module);
  ear::python::bind_health(module);
  ear::python::bind_estimate(module);
  ear::python::bind_recording(module);
  ear::python::bind_odometry(module);
  ear::python::bind_filter(module);
  ear::python::bind_simulation(module);
  ear::python::bind_results(module);
}
