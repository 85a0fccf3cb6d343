// What sensors deliver: inertial samples, wheel and laser readings, frames of images, frames of features.
#include <cmath>
#include <limits>

#include "ear/types.h"
#include "python/binding/bindings.h"
#include "python/binding/images.h"
#include "python/binding/value.h"
#include "src/recording/frame_queue.h"

namespace ear::python {
namespace {

constexpr double kNotSeen = std::numeric_limits<double>::quiet_NaN();

/// One row per feature; NaN where a feature was not found in the right image.
py::array_t<double> places(const FeatureFrame& frame, bool right) {
  py::array_t<double> array({static_cast<py::ssize_t>(frame.features.size()), py::ssize_t{2}});
  auto rows = array.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    const FeatureObservation& seen = frame.features[static_cast<std::size_t>(i)];
    for (py::ssize_t axis = 0; axis < 2; ++axis) {
      if (right && !seen.has_right) {
        rows(i, axis) = kNotSeen;
      } else {
        rows(i, axis) = right ? seen.right(axis) : seen.left(axis);
      }
    }
  }
  return array;
}

py::array_t<std::uint64_t> ids(const FeatureFrame& frame) {
  py::array_t<std::uint64_t> array(static_cast<py::ssize_t>(frame.features.size()));
  for (std::size_t i = 0; i < frame.features.size(); ++i) array.mutable_data()[i] = frame.features[i].id;
  return array;
}

FeatureFrame make_features(py::handle t_ns, py::handle given_ids, py::handle given_left, py::handle given_right,
                           bool right_skipped, bool repeated) {
  FeatureFrame frame;
  frame.t_ns = integer_from(t_ns, "t_ns");
  frame.right_skipped = right_skipped;
  frame.repeated = repeated;
  const auto list = py::array::ensure(given_ids);
  const char kind = list ? list.dtype().kind() : ' ';
  if (!list || list.ndim() != 1 || (kind != 'i' && kind != 'u' && list.size() > 0)) {
    PyErr_Clear();
    refuse("ids", "integers of the shape (n,)", given_ids);
  }
  const py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast> numbers(list);
  const auto left = numbers_from(given_left, numbers.size(), 2, "left").unchecked<2>();
  frame.features.resize(static_cast<std::size_t>(numbers.size()));
  for (py::ssize_t i = 0; i < numbers.size(); ++i) {
    FeatureObservation& seen = frame.features[static_cast<std::size_t>(i)];
    seen.id = numbers.data()[i];
    seen.left = {left(i, 0), left(i, 1)};
  }
  if (given_right.is_none()) return frame;
  const auto right = numbers_from(given_right, numbers.size(), 2, "right").unchecked<2>();
  for (py::ssize_t i = 0; i < numbers.size(); ++i) {
    FeatureObservation& seen = frame.features[static_cast<std::size_t>(i)];
    seen.has_right = !std::isnan(right(i, 0));
    if (seen.has_right) seen.right = {right(i, 0), right(i, 1)};
  }
  return frame;
}

void bind_frames(py::module_& module) {
  py::class_<RecordedFrame> frame(module, "StereoFrame",
                                  "The images of one instant of a recording: read-only arrays that share its memory.");
  frame.attr("_fields") = py::make_tuple("t_ns", "left", "right");
  frame.def_property_readonly("t_ns", [](const RecordedFrame& self) { return self.t_ns; })
      .def_property_readonly("left", [](const RecordedFrame& self) { return array_of(self.left, self.pixels); })
      .def_property_readonly("right", [](const RecordedFrame& self) { return array_of(self.right, self.pixels); })
      .def("__str__", [](const py::object& self) { return text_of(self); })
      .def("__repr__", [](const RecordedFrame& self) { return "StereoFrame(t_ns=" + std::to_string(self.t_ns) + ")"; });

  py::class_<FeatureFrame> features(
      module, "FeatureFrame", "Features of one frame in normalized coordinates: what a front end hands to a Filter.");
  features.attr("_fields") = py::make_tuple("t_ns", "ids", "left", "right", "right_skipped", "repeated");
  features
      .def(py::init(&make_features), py::arg("t_ns"), py::arg("ids"), py::arg("left"), py::arg("right") = py::none(),
           py::arg("right_skipped") = false, py::arg("repeated") = false)
      .def_property_readonly("t_ns", [](const FeatureFrame& self) { return self.t_ns; })
      .def_property_readonly("ids", &ids)
      .def_property_readonly("left", [](const FeatureFrame& self) { return places(self, false); })
      .def_property_readonly("right", [](const FeatureFrame& self) { return places(self, true); })
      .def_property_readonly("right_skipped", [](const FeatureFrame& self) { return self.right_skipped; })
      .def_property_readonly("repeated", [](const FeatureFrame& self) { return self.repeated; })
      .def("__len__", [](const FeatureFrame& self) { return self.features.size(); })
      .def("__str__", [](const py::object& self) { return text_of(self); })
      .def("__repr__", [](const FeatureFrame& self) {
        return "FeatureFrame(t_ns=" + std::to_string(self.t_ns) + ", " + std::to_string(self.features.size()) +
               " features)";
      });
}

}  // namespace

void bind_samples(py::module_& module) {
  bind_value(module, "ImuSample", "One inertial sample in the body frame: rates [rad/s], specific force [m/s^2].",
             Field{"t_ns", &ImuSample::t_ns}, Field{"gyro_B", &ImuSample::gyro_B},
             Field{"accel_B", &ImuSample::accel_B});
  bind_value(module, "EncoderSample", "One reading of both wheel encoders [count].",
             Field{"t_ns", &EncoderSample::t_ns}, Field{"left_count", &EncoderSample::left_count},
             Field{"right_count", &EncoderSample::right_count});
  bind_value(module, "LaserSample", "One reading of all laser beams [m]; a beam without return is NaN.",
             Field{"t_ns", &LaserSample::t_ns}, Field{"range", &LaserSample::range});
  bind_frames(module);
}

}  // namespace ear::python
