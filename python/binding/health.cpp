// What the estimator reports of itself, with the names of the C++ interface and the words of the program.
#include "ear/health.h"

#include "python/binding/bindings.h"
#include "python/binding/value.h"
#include "src/health_text.h"

namespace ear::python {
namespace {

void bind_words(py::module_& module) {
  py::enum_<HealthStatus>(module, "HealthStatus", "Can one act on the estimate?")
      .value("initialising", HealthStatus::initialising)
      .value("tracking", HealthStatus::tracking)
      .value("degraded", HealthStatus::degraded)
      .value("lost", HealthStatus::lost);
  py::enum_<Aiding>(module, "Aiding", "What carries the estimate, besides the inertial sensors.")
      .value("none", Aiding::none)
      .value("standing", Aiding::standing)
      .value("wheels", Aiding::wheels)
      .value("cameras", Aiding::cameras)
      .value("cameras_and_wheels", Aiding::cameras_and_wheels);
  py::enum_<Reason>(module, "Reason", "Why there is no estimate.")
      .value("none", Reason::none)
      .value("no_frame", Reason::no_frame)
      .value("few_samples", Reason::few_samples)
      .value("other_gravity", Reason::other_gravity)
      .value("moves_unseen", Reason::moves_unseen)
      .value("few_readings", Reason::few_readings)
      .value("wheel_gaps", Reason::wheel_gaps)
      .value("wheels_contradict", Reason::wheels_contradict)
      .value("few_frames", Reason::few_frames)
      .value("cameras_contradict", Reason::cameras_contradict)
      .value("start_is_ahead", Reason::start_is_ahead)
      .value("start_is_past", Reason::start_is_past)
      .value("vague_velocity", Reason::vague_velocity)
      .value("inertia_alone", Reason::inertia_alone)
      .value("velocity_lost", Reason::velocity_lost)
      .value("images_contradict", Reason::images_contradict)
      .value("not_a_number", Reason::not_a_number)
      .value("clock_or_gap", Reason::clock_or_gap)
      .value("proving", Reason::proving);
}

/// By the names of the sources, those for which `of` gives something.
template <typename Of>
py::dict by_source(const Of& of) {
  py::dict result;
  for (std::size_t i = 0; i < kSourceCount; ++i) {
    if (const py::object value = of(i)) result[kSourceNames[i]] = value;
  }
  return result;
}

}  // namespace

void bind_health(py::module_& module) {
  bind_words(module);
  using R = SourceRecord;
  bind_value(module, "SourceRecord", "The last measurement of one source, against what was expected.",
             Field{"innovation", &R::innovation}, Field{"variance", &R::variance}, Field{"gate_ratio", &R::gate_ratio},
             Field{"used", &R::used}, Field{"rejected", &R::rejected}, Field{"last_used_ns", &R::last_used_ns},
             Field{"score", &R::score});
  py::class_<Health> health(module, "Health", "What the estimator reports of itself; str() says it in words.");
  health.attr("_fields") =
      py::make_tuple("status", "reason", "since_ns", "faulty", "onset_ns", "imprecise", "misaligned", "aiding",
                     "quality", "horizontal_sigma", "vertical_sigma", "reset_counter", "load_step", "sources");
  health.def_readonly("status", &Health::status)
      .def_readonly("reason", &Health::reason)
      .def_readonly("since_ns", &Health::since_ns)
      .def_property_readonly("faulty",
                             [](const Health& self) {
                               py::list names;
                               for (std::size_t i = 0; i < kSourceCount; ++i) {
                                 if (self.faulty[i]) names.append(kSourceNames[i]);
                               }
                               return py::tuple(names);
                             })
      .def_property_readonly("onset_ns",
                             [](const Health& self) {
                               return by_source([&](std::size_t i) {
                                 return self.faulty[i] ? py::object(py::int_(self.onset_ns[i])) : py::object();
                               });
                             })
      .def_readonly("imprecise", &Health::imprecise)
      .def_readonly("misaligned", &Health::misaligned)
      .def_readonly("aiding", &Health::aiding)
      .def_readonly("quality", &Health::quality)
      .def_readonly("horizontal_sigma", &Health::horizontal_sigma)
      .def_readonly("vertical_sigma", &Health::vertical_sigma)
      .def_readonly("reset_counter", &Health::reset_counter)
      .def_readonly("load_step", &Health::load_step)
      .def_property_readonly(
          "sources",
          [](const Health& self) { return by_source([&](std::size_t i) { return py::cast(self.sources[i]); }); })
      .def_property_readonly("reason_text", [](const Health& self) { return std::string(to_text(self.reason)); })
      .def("__str__", [](const Health& self) { return to_text(self); })
      .def("__repr__", [](const Health& self) { return "<Health: " + to_text(self) + ">"; });
}

}  // namespace ear::python
