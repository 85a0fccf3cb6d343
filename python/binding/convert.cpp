#include "python/binding/convert.h"

namespace ear::python {
namespace {

std::string quoted(const py::array& array) {
  return "an array of " + py::str(array.dtype()).cast<std::string>() + " with the shape " +
         py::str(array.attr("shape")).cast<std::string>();
}

std::string shape_text(py::ssize_t rows, py::ssize_t columns) {
  const std::string n = rows < 0 ? "n" : std::to_string(rows);
  return columns == 0 ? "(" + n + ",)" : "(" + n + ", " + std::to_string(columns) + ")";
}

/// One value as YAML shows it.
std::string value_text(const py::object& value) {
  if (value.is_none()) return "~";
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (!py::isinstance<py::array>(value)) return py::str(value).cast<std::string>();
  const auto array = value.cast<py::array>();
  if (array.size() > 16) return quoted(array);
  return py::str(array.attr("tolist")()).cast<std::string>();
}

bool has_fields(py::handle value) { return py::hasattr(value, "_fields"); }

bool is_list_of_fields(py::handle value) {
  return py::isinstance<py::tuple>(value) && py::len(value) > 0 && has_fields(value.cast<py::tuple>()[0]);
}

}  // namespace

std::string described(py::handle given) {
  if (py::isinstance<py::array>(given)) return quoted(given.cast<py::array>());
  if (given.is_none()) return "None";
  std::string text = py::repr(given).cast<std::string>();
  constexpr std::size_t kLongest = 60;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return py::str(py::type::handle_of(given).attr("__name__")).cast<std::string>() + " " + text;
}

void refuse(const std::string& name, const std::string& expected, py::handle given) {
  throw py::type_error(name + ": expected " + expected + ", got " + described(given));
}

std::int64_t integer_from(py::handle given, const std::string& name) {
  if (py::isinstance<py::bool_>(given) || PyIndex_Check(given.ptr()) == 0 || py::isinstance<py::array>(given)) {
    const bool time = name.size() >= 4 && name.compare(name.size() - 4, 4, "t_ns") == 0;
    refuse(name, time ? "an integer number of nanoseconds" : "an integer", given);
  }
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(given.ptr()));
  int overflow = 0;
  const long long value = index ? PyLong_AsLongLongAndOverflow(index.ptr(), &overflow) : 0;
  if (overflow != 0) {
    PyErr_SetString(PyExc_OverflowError, (name + ": expected 64 bits, got " + described(given)).c_str());
    throw py::error_already_set();
  }
  if (PyErr_Occurred() != nullptr) throw py::error_already_set();
  return value;
}

double number_from(py::handle given, const std::string& name) {
  const bool is_number = PyFloat_Check(given.ptr()) != 0 || PyIndex_Check(given.ptr()) != 0 ||
                         py::isinstance(given, py::module_::import("numpy").attr("floating"));
  if (!is_number || py::isinstance<py::bool_>(given) || py::isinstance<py::array>(given)) {
    refuse(name, "a number", given);
  }
  const double value = PyFloat_AsDouble(given.ptr());
  if (PyErr_Occurred() != nullptr) throw py::error_already_set();
  return value;
}

std::filesystem::path path_from(py::handle given, const std::string& name) {
  const auto text = py::reinterpret_steal<py::object>(PyOS_FSPath(given.ptr()));
  if (!text || !py::isinstance<py::str>(text)) {
    PyErr_Clear();
    refuse(name, "a path, as str or os.PathLike", given);
  }
  return text.cast<std::string>();
}

py::array_t<double> numbers_from(py::handle given, py::ssize_t rows, py::ssize_t columns, const std::string& name) {
  const std::string expected = "numbers of the shape " + shape_text(rows, columns);
  if (py::isinstance<py::str>(given) || given.is_none()) refuse(name, expected, given);
  const auto any = py::array::ensure(given);
  if (!any) {
    PyErr_Clear();
    refuse(name, expected, given);
  }
  const char kind = any.dtype().kind();
  const bool fits = any.ndim() == (columns == 0 ? 1 : 2) && (rows < 0 || any.shape(0) == rows) &&
                    (columns == 0 || any.shape(1) == columns);
  if ((kind != 'f' && kind != 'i' && kind != 'u') || !fits) refuse(name, expected, any);
  return py::array_t<double, py::array::c_style | py::array::forcecast>(any);
}

std::string text_of(py::handle fields, const std::string& indent) {
  std::string text;
  for (const py::handle field : fields.attr("_fields")) {
    const auto name = field.cast<std::string>();
    const py::object value = fields.attr(field);
    text += indent + name + ":";
    if (has_fields(value)) {
      text += "\n" + text_of(value, indent + "  ");
    } else if (is_list_of_fields(value)) {
      text += "\n";
      for (const py::handle item : value) text += indent + "  -\n" + text_of(item, indent + "    ");
    } else {
      text += " " + value_text(value) + "\n";
    }
  }
  return text;
}

}  // namespace ear::python
