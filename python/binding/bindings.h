// One function per part of the module; module.cpp calls them in this order.
#pragma once

#include <pybind11/pybind11.h>

namespace ear::python {

void bind_samples(pybind11::module_& module);
void bind_settings(pybind11::module_& module);
void bind_calibration(pybind11::module_& module);
void bind_health(pybind11::module_& module);
void bind_estimate(pybind11::module_& module);
void bind_recording(pybind11::module_& module);
void bind_odometry(pybind11::module_& module);
void bind_filter(pybind11::module_& module);
void bind_simulation(pybind11::module_& module);
void bind_results(pybind11::module_& module);

}  // namespace ear::python
