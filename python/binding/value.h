// Plain structs as Python classes whose objects do not change: made by keywords, copied with changes by replace().
// That they do not change is what makes them safe: no Python object refers to the inside of another.
#pragma once

#include <string>
#include <utility>

#include "python/binding/convert.h"

namespace ear::python {

template <typename T, typename M>
struct Field {
  const char* name;
  M T::*member;
};
template <typename T, typename M>
Field(const char*, M T::*) -> Field<T, M>;

/// Throws TypeError for a name that is none of the class's fields.
inline void require_field(py::handle type, const std::string& name) {
  const py::tuple fields = type.attr("_fields");
  if (fields.contains(name.c_str())) return;
  throw py::type_error(type.attr("__name__").cast<std::string>() + ": there is no " + name + "; there are " +
                       py::str(", ").attr("join")(fields).cast<std::string>());
}

/// Binds T with these fields, in this order: constructor, properties, replace(), repr() and str().
template <typename T, typename... M>
py::class_<T> bind_value(py::module_& module, const char* name, const char* doc, Field<T, M>... fields) {
  py::class_<T> type(module, name, doc);
  type.attr("_fields") = py::make_tuple(fields.name...);
  const auto change = [=](T& value, const py::dict& changes) {
    for (const auto& [key, item] : changes) {
      const auto wanted = key.template cast<std::string>();
      require_field(py::type::of<T>(), wanted);
      ((wanted == fields.name ? void(value.*(fields.member) = from_python<M>(item, wanted)) : void()), ...);
    }
  };
  type.def(py::init([change](const py::args& given, const py::kwargs& changes) {
    const py::tuple names = py::type::of<T>().attr("_fields");
    if (given.size() > names.size())
      throw py::type_error("expected at most " + std::to_string(names.size()) + " values");
    py::dict all(changes);
    for (std::size_t i = 0; i < given.size(); ++i) all[names[i]] = given[i];
    T value{};
    change(value, all);
    return value;
  }));
  (type.def_property_readonly(fields.name,
                              [member = fields.member](const T& value) { return to_python(value.*member); }),
   ...);
  type.def("replace", [change](const T& value, const py::kwargs& changes) {
    T copy = value;
    change(copy, changes);
    return copy;
  });
  type.def("__copy__", [](const T& value) { return value; });
  type.def("__deepcopy__", [](const T& value, const py::dict&) { return value; });
  type.def("__str__", [](const py::object& self) { return text_of(self); });
  type.def("__repr__", [name](const py::object& self) {
    std::string text;
    for (const py::handle field : self.attr("_fields")) {
      const py::object value = self.attr(field);
      const bool array = py::isinstance<py::array>(value);
      text += (text.empty() ? "" : ", ") + field.cast<std::string>() + "=" +
              py::repr(array ? py::object(value.attr("tolist")()) : value).template cast<std::string>();
    }
    return std::string(name) + "(" + text + ")";
  });
  return type;
}

}  // namespace ear::python
