// Recordings: folders and bags, as `ear run` reads them. A recording is read once, from its beginning to its end.
#include "python/binding/recording.h"

#include "python/binding/bindings.h"
#include "python/binding/value.h"

namespace ear::python {
namespace {

std::unique_ptr<GuardedRecording> open(py::handle path, py::handle calibration_files, double camera_rate_hz, bool mono,
                                       py::handle config) {
  RecordingOptions options;
  options.calibration_files = from_python<std::vector<std::filesystem::path>>(calibration_files, "calibration_files");
  options.camera_rate_hz = camera_rate_hz;
  options.mono = mono;
  const std::filesystem::path where = path_from(path, "path");
  const std::filesystem::path settings = config.is_none() ? std::filesystem::path{} : path_from(config, "config");
  const py::gil_scoped_release released;
  return std::make_unique<GuardedRecording>(where, settings, options);
}

py::object next(GuardedRecording& self) {
  const std::optional<Sample> sample = self.work([](OpenRecording& open) { return open.recording.next(); });
  if (!sample) throw py::stop_iteration();
  return std::visit([](const auto& s) { return py::cast(s); }, *sample);
}

}  // namespace

void bind_recording(py::module_& module) {
  bind_value(module, "Warning", "One kind of problem that a recording survives, and the place of the first.",
             Field{"kind", &Warning::kind}, Field{"count", &Warning::count}, Field{"first", &Warning::first});
  py::class_<GuardedRecording> recording(
      module, "Recording",
      "A recording's samples in time order, as an iterator: it can be read once. Folders and bags.");
  recording
      .def(py::init(&open), py::arg("path"), py::arg("calibration_files") = py::tuple(),
           py::arg("camera_rate_hz") = 0.0, py::arg("mono") = false, py::arg("config") = py::none())
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &next)
      .def_property_readonly(
          "calibration",
          [](GuardedRecording& self) { return self.quick([](OpenRecording& r) { return r.recording.calibration(); }); })
      .def_property_readonly(
          "span",
          [](GuardedRecording& self) {
            const TimeSpan span = self.quick([](OpenRecording& r) { return r.recording.span(); });
            return py::make_tuple(span.first_ns, span.last_ns);
          },
          "First and last stamp of the IMU [ns].")
      .def_property_readonly(
          "warnings",
          [](GuardedRecording& self) {
            return to_python(self.quick([](OpenRecording& r) { return r.recording.warnings(); }));
          },
          "What went wrong up to now, counted by kind.")
      .def("__repr__", [](GuardedRecording& self) {
        return "<Recording " + self.quick([](OpenRecording& r) { return r.path.string(); }) + ">";
      });
}

}  // namespace ear::python
