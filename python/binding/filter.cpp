// class Filter: the estimator behind a front end of one's own.
#include "filter/filter.h"

#include "python/binding/bindings.h"
#include "python/binding/estimators.h"

namespace ear::python {

void bind_filter(py::module_& module) {
  using py::arg;
  py::class_<GuardedFilter> filter(module, "Filter",
                                   "The estimator alone: samples and feature tracks in, estimates out.");
  filter.def(py::init([](const Calibration& calibration, const FilterConfig& config) {
               return std::make_unique<GuardedFilter>(config, calibration);
             }),
             arg("calibration"), arg("config") = FilterConfig{});
  bind_common(filter);
  filter
      .def(
          "process",
          [](GuardedFilter& self, const FeatureFrame& frame) {
            return to_python(self.work([&](Filter& f) { return f.process(frame); }));
          },
          arg("frame"), "The estimate at the frame's time, or None while it cannot start.")
      .def(
          "process_without_image",
          [](GuardedFilter& self, py::handle t_ns) {
            const TimeNs t = integer_from(t_ns, "t_ns");
            return to_python(self.work([&](Filter& f) { return f.process_without_image(t); }));
          },
          arg("t_ns"))
      .def(
          "common_stamp",
          [](GuardedFilter& self, py::handle t_ns) {
            const TimeNs t = integer_from(t_ns, "t_ns");
            return to_python(self.quick([&](Filter& f) { return f.common_stamp(t); }));
          },
          arg("t_ns"), "A camera's stamp by the common clock; None for a frame that is not to be used.")
      .def(
          "motion_to",
          [](GuardedFilter& self, py::handle t_ns) -> py::object {
            const TimeNs t = integer_from(t_ns, "t_ns");
            const auto motion = self.quick([&](Filter& f) { return f.motion_to(t); });
            if (!motion) return py::none();
            return py::make_tuple(motion->R_B1B0, motion->translation_known ? py::cast(motion->p_B0B1) : py::none());
          },
          arg("t_ns"), "R_B1B0 and p_B0B1 (None if not known) from the last frame to this time, or None.");
}

}  // namespace ear::python
