// Settings, with the names and the words of a settings file: every field that src/recording/config_fields.h lists.
#include "python/binding/bindings.h"
#include "python/binding/convert.h"
#include "src/recording/config_fields.h"
#include "src/recording/config_file.h"

namespace ear::python {
namespace {

template <typename E>
E choice_from(py::handle given, const std::string& name) {
  std::string known;
  for (const auto& [word, value] : names_of(E{})) {
    if (py::isinstance<py::str>(given) && given.cast<std::string>() == word) return value;
    known += (known.empty() ? "" : ", ") + std::string(word);
  }
  throw py::value_error(name + ": " + described(given) + " is none of " + known);
}

/// A nested struct is handed out as a part of `self`, which it keeps: `config.filter.window = 8` changes config.
template <typename M>
py::object get(const py::object& self, M& field) {
  if constexpr (std::is_enum_v<M>) {
    return py::str(name_of(field));
  } else if constexpr (std::is_arithmetic_v<M>) {
    return py::cast(field);
  } else {
    return py::cast(&field, py::return_value_policy::reference_internal, self);
  }
}

template <typename M>
void set(M& field, py::handle given, const std::string& name) {
  if constexpr (std::is_enum_v<M>) {
    field = choice_from<M>(given, name);
  } else {
    field = from_python<M>(given, name);
  }
}

template <typename T>
void bind(py::module_& module, const char* name, const char* doc) {
  py::class_<T> type(module, name, doc);
  py::list fields;
  T prototype;
  visit(prototype, [&](const char* key, auto&) {
    fields.append(key);
    const auto read = [key = std::string(key)](const py::object& self) {
      py::object result;
      visit(self.cast<T&>(), [&](const char* k, auto& field) {
        if (key == k) result = get(self, field);
      });
      return result;
    };
    const auto write = [key = std::string(key)](T& self, const py::object& given) {
      visit(self, [&](const char* k, auto& field) {
        if (key == k) set(field, given, key);
      });
    };
    type.def_property(key, read, write);
  });
  type.attr("_fields") = py::tuple(fields);
  type.def(py::init<>())
      .def("copy", [](const T& self) { return T(self); })
      .def("__copy__", [](const T& self) { return T(self); })
      .def("__deepcopy__", [](const T& self, const py::dict&) { return T(self); })
      .def("__str__", [](const py::object& self) { return text_of(self); })
      .def("__repr__", [name](const py::object& self) { return std::string(name) + ":\n" + text_of(self, "  "); });
}

}  // namespace

void bind_settings(py::module_& module) {
  bind<FrontendConfig>(module, "FrontendConfig", "Settings of the front end.");
  bind<PerformanceConfig>(module, "PerformanceConfig", "How much the estimator may cost.");
  bind<PriorConfig>(module, "PriorConfig", "Standard deviations at the start.");
  bind<StandstillConfig>(module, "StandstillConfig", "How the filter recognises that the vehicle stands.");
  bind<OnlineCalibrationConfig>(module, "OnlineCalibrationConfig", "What is calibrated while running.");
  bind<OdometerConfig>(module, "OdometerConfig", "Wheels and lasers.");
  bind<ContactConfig>(module, "ContactConfig", "When the vehicle is on the ground, and when it flies.");
  bind<ImpactConfig>(module, "ImpactConfig", "Which inertial samples are less certain.");
  bind<AnomalyConfig>(module, "AnomalyConfig", "Sensors compared over every interval between frames.");
  bind<FilterConfig>(module, "FilterConfig", "Settings of the filter.");
  bind<Config>(module, "Config", "All settings of the estimator; config/default.yaml has units and reasons.");

  module.def(
      "load_config", [](py::handle file) { return load_config(path_from(file, "file")); }, py::arg("file"),
      "Settings from a YAML file; keys that are left out keep their defaults.");
  module.def(
      "save_config", [](const Config& config, py::handle file) { save_config(config, path_from(file, "file")); },
      py::arg("config"), py::arg("file"), "Writes all settings, so that load_config() gives back the same.");
}

}  // namespace ear::python
