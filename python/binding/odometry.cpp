// class Odometry, and recordings replayed through it.
#include "ear/odometry.h"

#include "python/binding/bindings.h"
#include "python/binding/estimators.h"
#include "python/binding/images.h"
#include "python/binding/recording.h"
#include "src/recording/calibration_files.h"
#include "tools/replay.h"

namespace ear::python {
namespace {

py::object add_stereo(GuardedOdometry& self, py::handle t_ns, py::handle left, py::handle right) {
  const StereoFrame frame{integer_from(t_ns, "t_ns"), view_of(left, "left"), view_of(right, "right")};
  const Calibration& calibration =
      self.quick([](CalibratedOdometry& e) -> const Calibration& { return e.calibration; });
  require_size(frame.left, calibration, 0, "left");
  require_size(frame.right, calibration, 1, "right");
  return to_python(self.work([&](CalibratedOdometry& e) { return e.odometry.add_stereo(frame); }));
}

py::object add_frame(GuardedOdometry& self, const RecordedFrame& frame) {
  return to_python(self.work([&](CalibratedOdometry& e) { return e.odometry.add_stereo(frame); }));
}

/// As `ear run` does it; between frames it looks for Ctrl-C.
py::list replay(GuardedRecording& recording, GuardedOdometry& odometry, const py::object& on_frame) {
  std::vector<Estimate> estimates;
  const auto take = [&](const tools::ReplayedFrame& frame) {
    if (frame.estimate) estimates.push_back(*frame.estimate);
    const py::gil_scoped_acquire held;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!on_frame.is_none()) on_frame(frame.t_ns, to_python(frame.estimate));
  };
  recording.work([&](OpenRecording& open) {
    const py::gil_scoped_acquire held;  // work() gives it up again; both objects are taken in this order
    if (const auto missing = check_sensors(open.recording.calibration())) {
      throw InputError(located(open.path, 0, missing->where, missing->message));
    }
    odometry.work([&](CalibratedOdometry& e) { tools::replay(open.recording, e.odometry, take); });
  });
  py::list list;
  for (const Estimate& estimate : estimates) list.append(estimate);
  return list;
}

}  // namespace

void bind_odometry(py::module_& module) {
  using py::arg;
  py::class_<GuardedOdometry> odometry(module, "Odometry", "Samples and images in, estimates out.");
  odometry.def(py::init([](const Calibration& calibration, const Config& config) {
                 return std::make_unique<GuardedOdometry>(config, calibration);
               }),
               arg("calibration"), arg("config") = Config{});
  bind_common(odometry);
  odometry.def("add_stereo", &add_frame, arg("frame"))
      .def("add_stereo", &add_stereo, arg("t_ns"), arg("left"), arg("right") = py::none(),
           "The estimate at the time of these images, uint8 of the shape (height, width), or None.")
      .def(
          "frame_time",
          [](GuardedOdometry& self, py::handle t_ns) {
            const TimeNs t = integer_from(t_ns, "t_ns");
            return self.quick([&](auto& e) { return e.odometry.frame_time(t); });
          },
          arg("t_ns"), "When a frame with this stamp was taken, by what is known of the clocks [ns, IMU time].")
      .def(
          "step",
          [](GuardedOdometry& self, py::handle t_ns) {
            const TimeNs t = integer_from(t_ns, "t_ns");
            return to_python(self.work([&](CalibratedOdometry& e) { return e.odometry.step(t); }));
          },
          arg("t_ns"), "The estimate at a time without an image [ns], or None.")
      .def_property_readonly(
          "stage_times",
          [](GuardedOdometry& self) { return self.quick([](auto& e) { return e.odometry.stage_times(); }); })
      .def_property_readonly(
          "calibration",
          [](GuardedOdometry& self) { return self.quick([](auto& e) { return e.odometry.calibration(); }); },
          "What was given, with what was learned while running.")
      .def("reset", [](GuardedOdometry& self) { self.work([](auto& e) { e.odometry.reset(); }); });
  module.def("replay", &replay, arg("recording"), arg("odometry"), arg("on_frame") = py::none(),
             "Feeds all samples as `ear run` does; all estimates. on_frame(t_ns, estimate or None) after each frame.");
}

}  // namespace ear::python
